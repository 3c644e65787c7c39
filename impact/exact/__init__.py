"""Closed forms: Green's functions of rods, springs, beams, plates and the half-space, stresses at contacts."""

from impact.names import public_names

__getattr__, __dir__, __all__ = public_names(__name__, __file__)
