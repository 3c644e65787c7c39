"""Bodies: a Green's function with the motion that it would have without contact; releases, loads, time series."""

from impact.names import lazy_names

__getattr__ = lazy_names(__name__)
