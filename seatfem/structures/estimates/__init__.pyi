# ruff: noqa: I001 (one import a module)
from seatfem.structures.estimates import sizes as sizes, surrogate as surrogate
