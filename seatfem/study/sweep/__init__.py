"""Studies: runs of a scene for many values of its keys, the table of results, and its statistics."""

from impact.names import lazy_names

__getattr__ = lazy_names(__name__)
