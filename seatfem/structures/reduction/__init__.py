"""The way from matrices to a Green's function: the reductions, each with its error estimate."""

from impact.names import lazy_names

__getattr__ = lazy_names(__name__)
