"""Bodies: a Green's function with the motion that it would have without contact; releases, loads, time series."""
