"""Figures of impacts and of Green's functions."""

from impact.names import lazy_names

__getattr__ = lazy_names(__name__)
