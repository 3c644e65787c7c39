"""Gas flow through a reed valve, and the gas in the cylinder behind it."""

from impact.names import public_names

__getattr__, __dir__, __all__ = public_names(__name__, __file__)
