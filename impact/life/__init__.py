"""Fatigue under repeated blocks of stress: cycles, mean stress, S-N curves, Miner's sum, multiaxial criteria."""

from impact.names import public_names

__getattr__, __dir__, __all__ = public_names(__name__, __file__)
