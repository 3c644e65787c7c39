"""Generation of a checked mesh from a geometry, by gmsh in a process of its own, with named boundaries and regions."""
