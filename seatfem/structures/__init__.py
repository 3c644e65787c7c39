"""Elastic bodies: from geometry, mesh, matrices or measurement to the Green's function of their ports."""

from impact.names import lazy_names

__getattr__ = lazy_names(__name__)
