"""From the geometry of a seat to its Green's function, and the application around it.

The names below are loaded on first use, so that `import seatfem` costs nothing.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from impact.names import lazy_names

if TYPE_CHECKING:
    from impact.measured.frf import FrequencyResponse, read_frf
    from impact.measured.pole_fit import fit_impulse_response, fit_poles
    from seatfem.pictures.cell_grid import revolve
    from seatfem.pictures.margin_plot import plot_margins
    from seatfem.pictures.plots import plot_mesh, plot_modes
    from seatfem.structures.elements.assembly import assemble
    from seatfem.structures.elements.axisymmetric import assemble_axisymmetric
    from seatfem.structures.elements.mindlin import PlateMesh, assemble_plate, plate_ports
    from seatfem.structures.formats.matrices import read_matrices
    from seatfem.structures.formats.mesh_files import read_mesh
    from seatfem.structures.formats.mesh_writing import write_mesh
    from seatfem.structures.formats.uff import read_frf_uff, read_modes_uff
    from seatfem.structures.lands import FaceLip, face_lip
    from seatfem.structures.lip import AnyLip, Lip
    from seatfem.structures.materials import Material, Orthotropic
    from seatfem.structures.mesh.meridian import MeridianMesh, make_meridian
    from seatfem.structures.mesh.meshing import SeatMesh, make_mesh
    from seatfem.structures.mesh.spec import MeshSpec
    from seatfem.structures.model import ModelError, Port, SecondOrderModel
    from seatfem.structures.reduction.face_modes import face_greens
    from seatfem.structures.reduction.greens import greens_function, reduce_model
    from seatfem.structures.reduction.harmonics import ring_greens
    from seatfem.structures.reduction.lip_modes import lip_greens
    from seatfem.structures.reduction.modes import Modes, solve_modes
    from seatfem.structures.reduction.reducer import Reduction
    from seatfem.structures.reduction.ring_patches import RingPatch
    from seatfem.structures.sheets import PlateModes, Sheet, plate_modes
    from seatfem.structures.store import Store, content_key
    from seatfem.study.runs.margin_curve import margin_curve
    from seatfem.study.runs.pipeline import run_scene
    from seatfem.study.scene import load_scene
    from seatfem.study.scene.strength import load_strength
    from seatfem.study.sweep.optimum import optimise
    from seatfem.study.sweep.sweep import sweep
    from seatfem.study.trade.chart import draw_trade
    from seatfem.study.trade.table import write_trade
    from seatfem.study.trade.trade import Trade, measure_trade

__all__ = [
    "AnyLip",
    "FaceLip",
    "FrequencyResponse",
    "Lip",
    "Material",
    "MeridianMesh",
    "MeshSpec",
    "ModelError",
    "Modes",
    "Orthotropic",
    "PlateMesh",
    "PlateModes",
    "Port",
    "Reduction",
    "RingPatch",
    "SeatMesh",
    "SecondOrderModel",
    "Sheet",
    "Store",
    "Trade",
    "assemble",
    "assemble_axisymmetric",
    "assemble_plate",
    "content_key",
    "draw_trade",
    "face_greens",
    "face_lip",
    "fit_impulse_response",
    "fit_poles",
    "greens_function",
    "lip_greens",
    "load_scene",
    "load_strength",
    "make_meridian",
    "make_mesh",
    "margin_curve",
    "measure_trade",
    "optimise",
    "plate_modes",
    "plate_ports",
    "plot_margins",
    "plot_mesh",
    "plot_modes",
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
    "sweep",
    "write_mesh",
    "write_trade",
]

__getattr__ = lazy_names(
    __name__,
    {
        "impact.measured.frf": "FrequencyResponse read_frf",
        "impact.measured.pole_fit": "fit_impulse_response fit_poles",
        "seatfem.pictures.cell_grid": "revolve",
        "seatfem.pictures.margin_plot": "plot_margins",
        "seatfem.pictures.plots": "plot_mesh plot_modes",
        "seatfem.structures.elements.assembly": "assemble",
        "seatfem.structures.elements.axisymmetric": "assemble_axisymmetric",
        "seatfem.structures.elements.mindlin": "PlateMesh assemble_plate plate_ports",
        "seatfem.structures.lands": "FaceLip face_lip",
        "seatfem.structures.formats.matrices": "read_matrices",
        "seatfem.structures.formats.mesh_files": "read_mesh",
        "seatfem.structures.formats.mesh_writing": "write_mesh",
        "seatfem.structures.formats.uff": "read_frf_uff read_modes_uff",
        "seatfem.structures.lip": "AnyLip Lip",
        "seatfem.structures.materials": "Material Orthotropic",
        "seatfem.structures.mesh.meridian": "MeridianMesh make_meridian",
        "seatfem.structures.mesh.meshing": "SeatMesh make_mesh",
        "seatfem.structures.mesh.spec": "MeshSpec",
        "seatfem.structures.model": "ModelError Port SecondOrderModel",
        "seatfem.structures.reduction.face_modes": "face_greens",
        "seatfem.structures.reduction.greens": "greens_function reduce_model",
        "seatfem.structures.reduction.harmonics": "ring_greens",
        "seatfem.structures.reduction.lip_modes": "lip_greens",
        "seatfem.structures.reduction.modes": "Modes solve_modes",
        "seatfem.structures.reduction.reducer": "Reduction",
        "seatfem.structures.reduction.ring_patches": "RingPatch",
        "seatfem.structures.sheets": "PlateModes Sheet plate_modes",
        "seatfem.structures.store": "Store content_key",
        "seatfem.study.runs.margin_curve": "margin_curve",
        "seatfem.study.runs.pipeline": "run_scene",
        "seatfem.study.scene": "load_scene",
        "seatfem.study.scene.strength": "load_strength",
        "seatfem.study.sweep.optimum": "optimise",
        "seatfem.study.sweep.sweep": "sweep",
        "seatfem.study.trade.chart": "draw_trade",
        "seatfem.study.trade.table": "write_trade",
        "seatfem.study.trade.trade": "Trade measure_trade",
    },
    former={"geometry": "seatfem.structures.shapes"},
)


def __dir__() -> list[str]:
    return sorted(__all__)
