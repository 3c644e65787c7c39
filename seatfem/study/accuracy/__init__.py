"""How exact: what each open key moves, the error budget of a run, and all safety factors on one page."""
