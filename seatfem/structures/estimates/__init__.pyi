# ruff: noqa: I001 (one import a module)
from seatfem.structures.estimates import coarse as coarse, costs as costs, sizes as sizes, surrogate as surrogate
