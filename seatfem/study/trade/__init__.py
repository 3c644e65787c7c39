"""Measured trade of speed for accuracy: time and error of a scene at many fidelities, with the Pareto front."""

from impact.names import lazy_names

__getattr__ = lazy_names(__name__)
