"""The measured trade of speed for accuracy: a scene at every fidelity, time against error, the Pareto front."""
