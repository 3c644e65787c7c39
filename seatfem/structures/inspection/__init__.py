"""Inspection of the CAD, mesh and drawing files of a scene before planning, with results cached in the process."""

from impact.names import lazy_names

__getattr__ = lazy_names(__name__)
