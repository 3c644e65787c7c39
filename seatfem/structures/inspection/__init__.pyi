# ruff: noqa: I001 (one import a module)
from seatfem.structures.inspection import cad as cad, mesh_file as mesh_file, outline as outline
