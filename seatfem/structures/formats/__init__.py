"""Files of other programs: meshes, matrices, universal files, decks, outlines."""

from impact.names import lazy_names

__getattr__ = lazy_names(__name__)
