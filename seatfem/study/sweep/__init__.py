"""Studies: a scene over many values of its keys, the table of what comes out, and what follows from the table."""

from impact.names import lazy_names

__getattr__ = lazy_names(__name__)
