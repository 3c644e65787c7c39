"""Elastic bodies: from geometry, mesh, matrices or measurement to the Green's function of their ports."""
