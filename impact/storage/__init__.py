"""Green's functions, results and stopped marches on file (HDF5)."""

from impact.names import lazy_names

__getattr__ = lazy_names(__name__)
