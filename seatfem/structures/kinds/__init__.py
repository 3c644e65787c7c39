"""Kinds of structures, each loaded when a scene names it (`structure.HOMES`).

A kind from another package is known once its subclass of `Structure` is defined.
"""

from impact.names import public_names

__getattr__, __dir__, __all__ = public_names(__name__, __file__)
