"""Green's functions, results and stopped marches on file (HDF5)."""
