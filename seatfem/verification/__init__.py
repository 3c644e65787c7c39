"""Verification cases: problems with a known answer, each solved by the public functions."""
