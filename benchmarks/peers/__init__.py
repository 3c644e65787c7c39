"""Other programs on the same mesh: a file a peer."""
