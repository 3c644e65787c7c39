"""Green's functions: what every one answers for itself, and the representations."""
