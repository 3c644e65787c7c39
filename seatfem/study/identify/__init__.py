"""Identification: fit of a scene's keys to measured records, with confidence intervals of the keys."""

from impact.names import lazy_names

__getattr__ = lazy_names(__name__)
