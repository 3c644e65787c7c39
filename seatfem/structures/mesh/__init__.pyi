# ruff: noqa: I001 (one import a module)
from seatfem.structures.mesh import (
    _gmsh_base as _gmsh_base,
    _gmsh_inspect as _gmsh_inspect,
    _gmsh_solid as _gmsh_solid,
    _gmsh_worker as _gmsh_worker,
    checks as checks,
    gmsh_process as gmsh_process,
    io as io,
    meshing as meshing,
    plane_meshes as plane_meshes,
    spec as spec,
)
