"""The way from matrices to a Green's function: the reductions, each with its error estimate."""
