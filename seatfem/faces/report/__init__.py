"""Report of a run: one web page that needs no network."""

from impact.names import lazy_names

__getattr__ = lazy_names(__name__)
