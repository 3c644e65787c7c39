"""Stress in bodies of finite elements: at points and on surfaces, from the contact forces of a run."""

from impact.names import public_names

__getattr__, __dir__, __all__ = public_names(__name__, __file__)
