"""Bodies: a Green's function with initial conditions and loads; releases of reeds and time series."""
