"""Files that are complete or absent when written, and limited in size and checked when read."""

from impact.names import lazy_names

__getattr__ = lazy_names(__name__)
