"""Whole runs: one, many side by side, and those behind an error budget."""
