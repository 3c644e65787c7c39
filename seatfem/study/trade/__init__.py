"""Measured trade of speed for accuracy: time and error of a scene at many fidelities, with the Pareto front."""
