"""Inspection of the CAD, mesh and drawing files of a scene before planning, with results cached in the process."""
