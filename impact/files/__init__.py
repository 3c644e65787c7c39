"""Files that are whole or absent when written, and bounded and checked when read."""

from impact.names import lazy_names

__getattr__ = lazy_names(__name__)
