"""Identification: fit of a scene's keys to measured records, with confidence intervals of the keys."""
