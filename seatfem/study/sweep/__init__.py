"""Studies: a scene over many values of its keys, the table of what comes out, and what follows from the table."""
