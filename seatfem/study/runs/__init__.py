"""A scene, carried out: contact, error bars, files and pictures."""

from impact.names import lazy_names

__getattr__ = lazy_names(__name__)
