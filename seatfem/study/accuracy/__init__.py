"""How exact: what each open key moves, and the error budget of a run."""
