"""From matrices to a Green's function: the roads, each with its error estimate."""
