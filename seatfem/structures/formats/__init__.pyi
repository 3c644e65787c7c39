# ruff: noqa: I001 (one import a module)
from seatfem.structures.formats import (
    _meshio_worker as _meshio_worker,
    abaqus as abaqus,
    calculix_deck as calculix_deck,
    decks as decks,
    dxf as dxf,
    file_mesh as file_mesh,
    matrices as matrices,
    mesh_files as mesh_files,
    nastran_mesh as nastran_mesh,
    uff as uff,
    universal as universal,
    writing as writing,
)
