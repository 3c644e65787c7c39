"""Generation of a checked mesh from a geometry, by gmsh in a process of its own, with named boundaries and regions."""

from impact.names import lazy_names

__getattr__ = lazy_names(__name__)
