"""Identification: values of a scene's keys that explain records of shots, how surely, and what these do not tell."""

from impact.names import lazy_names

__getattr__ = lazy_names(__name__)
