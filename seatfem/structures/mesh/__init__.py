"""The way from geometry to a checked mesh: gmsh in a process of its own, named boundaries and regions."""
