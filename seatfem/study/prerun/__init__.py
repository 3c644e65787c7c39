"""Runs before the run: only the impact that is judged, on a seat that stands in for the real one."""
