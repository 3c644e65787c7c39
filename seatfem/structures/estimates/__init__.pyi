# ruff: noqa: I001 (one import a module)
from seatfem.structures.estimates import costs as costs, samples as samples, sizes as sizes, surrogate as surrogate
