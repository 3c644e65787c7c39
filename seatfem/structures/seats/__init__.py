"""The seat of a scene: level of modelling, matrices, Green's function, the store of those computed before."""
