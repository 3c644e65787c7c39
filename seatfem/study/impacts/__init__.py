"""The contact problem of a scene, its measures, and what changes them: the parts of an error budget."""

from impact.names import lazy_names

__getattr__ = lazy_names(__name__)
