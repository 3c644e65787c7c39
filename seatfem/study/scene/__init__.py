"""Scene files: TOML with units in strings, checked with all errors at once."""

from impact.names import public_names

__getattr__, __dir__, __all__ = public_names(__name__, __file__, {"strength": "seatfem.life.table"})
