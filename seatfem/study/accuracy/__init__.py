"""The error budget of a run."""
