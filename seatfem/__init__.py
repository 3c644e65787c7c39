"""From the geometry of a seat to its Green's function, and the application around it.

The names below are loaded on first use, so that `import seatfem` costs nothing.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from impact.measured.frf import FrequencyResponse, read_frf
    from impact.measured.pole_fit import fit_impulse_response, fit_poles
    from seatfem.pictures.cell_grid import revolve
    from seatfem.structures.elements.assembly import assemble
    from seatfem.structures.elements.axisymmetric import assemble_axisymmetric
    from seatfem.structures.formats.matrices import read_matrices
    from seatfem.structures.formats.mesh_files import read_mesh
    from seatfem.structures.formats.mesh_writing import write_mesh
    from seatfem.structures.formats.uff import read_frf_uff, read_modes_uff
    from seatfem.structures.materials import Material, Orthotropic
    from seatfem.structures.mesh.meridian import MeridianMesh, make_meridian
    from seatfem.structures.mesh.meshing import make_mesh
    from seatfem.structures.mesh.seat_mesh import SeatMesh
    from seatfem.structures.mesh.spec import MeshSpec
    from seatfem.structures.model import ModelError, Port, SecondOrderModel
    from seatfem.structures.reduction.greens import greens_function, reduce_model
    from seatfem.structures.reduction.harmonics import ring_greens
    from seatfem.structures.reduction.modes import Modes, solve_modes
    from seatfem.structures.reduction.reducer import Reduction
    from seatfem.structures.reduction.ring_patches import RingPatch
    from seatfem.structures.store import Store, content_key
    from seatfem.study.runs.pipeline import run_scene
    from seatfem.study.scene import load_scene
    from seatfem.study.trade.chart import draw_trade
    from seatfem.study.trade.table import write_trade
    from seatfem.study.trade.trade import Trade, measure_trade

__all__ = [
    "FrequencyResponse",
    "Material",
    "MeridianMesh",
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
    "Trade",
    "assemble",
    "assemble_axisymmetric",
    "content_key",
    "draw_trade",
    "fit_impulse_response",
    "fit_poles",
    "greens_function",
    "load_scene",
    "make_meridian",
    "make_mesh",
    "measure_trade",
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
    "write_mesh",
    "write_trade",
]

_HOME = {
    "Trade": "seatfem.study.trade.trade",
    "measure_trade": "seatfem.study.trade.trade",
    "draw_trade": "seatfem.study.trade.chart",
    "write_trade": "seatfem.study.trade.table",
    "FrequencyResponse": "impact.measured.frf",
    "read_frf": "impact.measured.frf",
    "read_matrices": "seatfem.structures.formats.matrices",
    "fit_impulse_response": "impact.measured.pole_fit",
    "fit_poles": "impact.measured.pole_fit",
    "Store": "seatfem.structures.store",
    "content_key": "seatfem.structures.store",
    "read_frf_uff": "seatfem.structures.formats.uff",
    "read_modes_uff": "seatfem.structures.formats.uff",
    "assemble": "seatfem.structures.elements.assembly",
    "assemble_axisymmetric": "seatfem.structures.elements.axisymmetric",
    "ring_greens": "seatfem.structures.reduction.harmonics",
    "RingPatch": "seatfem.structures.reduction.ring_patches",
    "revolve": "seatfem.pictures.cell_grid",
    "Reduction": "seatfem.structures.reduction.reducer",
    "greens_function": "seatfem.structures.reduction.greens",
    "reduce_model": "seatfem.structures.reduction.greens",
    "MeshSpec": "seatfem.structures.mesh.spec",
    "SeatMesh": "seatfem.structures.mesh.seat_mesh",
    "MeridianMesh": "seatfem.structures.mesh.meridian",
    "make_meridian": "seatfem.structures.mesh.meridian",
    "make_mesh": "seatfem.structures.mesh.meshing",
    "read_mesh": "seatfem.structures.formats.mesh_files",
    "write_mesh": "seatfem.structures.formats.mesh_writing",
    "Material": "seatfem.structures.materials",
    "Orthotropic": "seatfem.structures.materials",
    "ModelError": "seatfem.structures.model",
    "Port": "seatfem.structures.model",
    "SecondOrderModel": "seatfem.structures.model",
    "Modes": "seatfem.structures.reduction.modes",
    "solve_modes": "seatfem.structures.reduction.modes",
    "run_scene": "seatfem.study.runs.pipeline",
    "load_scene": "seatfem.study.scene",
}


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module 'seatfem' has no attribute {name!r}")
    return getattr(import_module(_HOME[name]), name)


def __dir__() -> list[str]:
    return sorted(__all__)
