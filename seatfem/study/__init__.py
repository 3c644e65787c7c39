"""What is asked of bodies that strike each other: scenes, plans, runs, trades."""

from impact.names import lazy_names

__getattr__ = lazy_names(__name__)
