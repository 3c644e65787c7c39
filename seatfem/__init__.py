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
    from seatfem.formats.mesh_writing import write_mesh
    from seatfem.formats.uff import read_frf_uff, read_modes_uff
    from seatfem.materials import Material, Orthotropic
    from seatfem.measured.frf import FrequencyResponse, read_frf
    from seatfem.measured.pole_fit import fit_impulse_response, fit_poles
    from seatfem.mesh.meridian import MeridianMesh, make_meridian
    from seatfem.mesh.meshing import MeshSpec, SeatMesh, make_mesh
    from seatfem.model import ModelError, Port, SecondOrderModel
    from seatfem.roads.greens import Reduction, greens_function, reduce_model
    from seatfem.roads.harmonics import ring_greens
    from seatfem.roads.modes import Modes, solve_modes
    from seatfem.roads.ring_patches import RingPatch
    from seatfem.runs.pipeline import run_scene
    from seatfem.scene import load_scene
    from seatfem.seats.store import Store, content_key
    from seatfem.trading.chart import draw_trade
    from seatfem.trading.table import write_trade
    from seatfem.trading.trade import Trade, measure_trade
    from seatfem.views.revolved_grid import revolve

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
    "Trade": "trading.trade",
    "measure_trade": "trading.trade",
    "draw_trade": "trading.chart",
    "write_trade": "trading.table",
    "FrequencyResponse": "measured.frf",
    "read_frf": "measured.frf",
    "read_matrices": "formats.matrices",
    "fit_impulse_response": "measured.pole_fit",
    "fit_poles": "measured.pole_fit",
    "Store": "seats.store",
    "content_key": "seats.store",
    "read_frf_uff": "formats.uff",
    "read_modes_uff": "formats.uff",
    "assemble": "elements.assembly",
    "assemble_axisymmetric": "elements.axisymmetric",
    "ring_greens": "roads.harmonics",
    "RingPatch": "roads.ring_patches",
    "revolve": "views.revolved_grid",
    "Reduction": "roads.greens",
    "greens_function": "roads.greens",
    "reduce_model": "roads.greens",
    "MeshSpec": "mesh.meshing",
    "SeatMesh": "mesh.meshing",
    "MeridianMesh": "mesh.meridian",
    "make_meridian": "mesh.meridian",
    "make_mesh": "mesh.meshing",
    "read_mesh": "formats.mesh_files",
    "write_mesh": "formats.mesh_writing",
    "Material": "materials",
    "Orthotropic": "materials",
    "ModelError": "model",
    "Port": "model",
    "SecondOrderModel": "model",
    "Modes": "roads.modes",
    "solve_modes": "roads.modes",
    "run_scene": "runs.pipeline",
    "load_scene": "scene",
}


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module 'seatfem' has no attribute {name!r}")
    return getattr(import_module(f"seatfem.{_HOME[name]}"), name)


def __dir__() -> list[str]:
    return sorted(__all__)
