"""A run to look at in a browser, drawn by this machine."""
