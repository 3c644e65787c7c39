"""From the geometry of a seat to its Green's function, and the application around it.

The names below are loaded on first use, so that `import seatfem` costs nothing.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from seatfem.elements.assembly import assemble
    from seatfem.elements.axisymmetric import assemble_axisymmetric
    from seatfem.formats.matrices import read_matrices
    from seatfem.formats.mesh_files import read_mesh
    from seatfem.formats.uff import read_frf_uff, read_modes_uff
    from seatfem.materials import Material, Orthotropic
    from seatfem.measured.frf import FrequencyResponse, read_frf
    from seatfem.measured.pole_fit import fit_impulse_response, fit_poles
    from seatfem.mesh.meshing import MeshSpec, SeatMesh, make_mesh
    from seatfem.model import ModelError, Port, SecondOrderModel
    from seatfem.roads.greens import Reduction, greens_function, reduce_model
    from seatfem.roads.harmonics import ring_greens
    from seatfem.roads.modes import Modes, solve_modes
    from seatfem.roads.ring_patches import RingPatch
    from seatfem.runs.pipeline import run_scene
    from seatfem.scene import load_scene
    from seatfem.seats.store import Store, content_key
    from seatfem.views.revolved_grid import revolve

__all__ = [
    "FrequencyResponse",
    "Material",
    "MeshSpec",
    "ModelError",
    "Modes",
    "Orthotropic",
    "Port",
    "Reduction",
    "RingPatch",
    "SeatMesh",
    "SecondOrderModel",
    "Store",
    "assemble",
    "assemble_axisymmetric",
    "content_key",
    "fit_impulse_response",
    "fit_poles",
    "greens_function",
    "load_scene",
    "make_mesh",
    "read_frf",
    "read_frf_uff",
    "read_matrices",
    "read_mesh",
    "read_modes_uff",
    "reduce_model",
    "revolve",
    "ring_greens",
    "run_scene",
    "solve_modes",
]

_HOME = {
    "FrequencyResponse": "frf",
    "read_frf": "frf",
    "read_matrices": "matrices",
    "fit_impulse_response": "pole_fit",
    "fit_poles": "pole_fit",
    "Store": "store",
    "content_key": "store",
    "read_frf_uff": "uff",
    "read_modes_uff": "uff",
    "assemble": "assembly",
    "assemble_axisymmetric": "axisymmetric",
    "ring_greens": "harmonics",
    "RingPatch": "ring_patches",
    "revolve": "revolved_grid",
    "Reduction": "greens",
    "greens_function": "greens",
    "reduce_model": "greens",
    "MeshSpec": "meshing",
    "SeatMesh": "meshing",
    "make_mesh": "meshing",
    "read_mesh": "mesh_files",
    "Material": "materials",
    "Orthotropic": "materials",
    "ModelError": "model",
    "Port": "model",
    "SecondOrderModel": "model",
    "Modes": "modes",
    "solve_modes": "modes",
    "run_scene": "pipeline",
    "load_scene": "scene",
}


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module 'seatfem' has no attribute {name!r}")
    return getattr(import_module(f"seatfem.{_HOME[name]}"), name)


def __dir__() -> list[str]:
    return sorted(__all__)
