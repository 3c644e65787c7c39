"""Green's functions: the interface of all, and their representations."""

from impact.names import lazy_names

__getattr__ = lazy_names(__name__)
