"""Bodies: a Green's function with initial conditions and loads; releases of reeds and time series."""

from impact.names import lazy_names

__getattr__ = lazy_names(__name__)
