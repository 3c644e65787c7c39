"""Ladders: keys of a scene's method with coarser and finer values, each with all that changing it tells."""
