"""Files of other programs: meshes, matrices, universal files, decks, outlines."""
