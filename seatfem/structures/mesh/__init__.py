"""The way from geometry to a checked mesh: gmsh in a process of its own, named boundaries and regions."""

from impact.names import lazy_names

__getattr__ = lazy_names(__name__)
