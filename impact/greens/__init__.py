"""Green's functions: the interface of all, and their representations."""
