"""The measured trade of speed for accuracy: a scene at every fidelity, time against error, the Pareto front."""

from impact.names import lazy_names

__getattr__ = lazy_names(__name__)
