"""Green's functions: what every one answers for itself, and the representations."""

from impact.names import lazy_names

__getattr__ = lazy_names(__name__)
