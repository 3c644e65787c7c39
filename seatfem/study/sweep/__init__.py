"""Studies: runs of a scene for many values of its keys, the table of results, and its statistics."""
