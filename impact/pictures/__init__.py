"""Figures of impacts and of Green's functions."""
