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
    from seatfem.pictures.plots import plot_mesh, plot_modes
    from seatfem.pictures.stress_plot import plot_margins
    from seatfem.structures.elements.assembly import assemble
    from seatfem.structures.elements.axisymmetric import assemble_axisymmetric
    from seatfem.structures.elements.mindlin import PlateMesh, assemble_plate, plate_ports
    from seatfem.structures.formats.matrices import read_matrices
    from seatfem.structures.formats.mesh_files import read_mesh
    from seatfem.structures.formats.uff import read_frf_uff, read_modes_uff
    from seatfem.structures.formats.writing import write_mesh
    from seatfem.structures.lands import FaceLip, face_lip
    from seatfem.structures.lip import AnyLip, Lip
    from seatfem.structures.materials import Material, Orthotropic
    from seatfem.structures.mesh.meshing import SeatMesh, make_mesh
    from seatfem.structures.mesh.plane_meshes import MeridianMesh, make_meridian
    from seatfem.structures.mesh.spec import MeshSpec
    from seatfem.structures.model import ModelError, Port, SecondOrderModel
    from seatfem.structures.reduction.greens import greens_function, reduce_model
    from seatfem.structures.reduction.harmonics import ring_greens
    from seatfem.structures.reduction.lip_modes import face_greens, lip_greens
    from seatfem.structures.reduction.modes import Modes, solve_modes
    from seatfem.structures.reduction.reducer import Reduction
    from seatfem.structures.reduction.ring_patches import RingPatch
    from seatfem.structures.sheets import PlateModes, Sheet, plate_modes
    from seatfem.structures.store import Store, content_key
    from seatfem.study.runs.pipeline import margin_curve, run_scene
    from seatfem.study.scene import load_scene
    from seatfem.study.scene.strength import load_strength
    from seatfem.study.sweep.optimum import optimise
    from seatfem.study.sweep.sweep import sweep
    from seatfem.study.trade.report import draw_trade, write_trade
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
        "seatfem.pictures.plots": "plot_mesh plot_modes",
        "seatfem.pictures.stress_plot": "plot_margins",
        "seatfem.structures.elements.assembly": "assemble",
        "seatfem.structures.elements.axisymmetric": "assemble_axisymmetric",
        "seatfem.structures.elements.mindlin": "PlateMesh assemble_plate plate_ports",
        "seatfem.structures.formats.matrices": "read_matrices",
        "seatfem.structures.formats.mesh_files": "read_mesh",
        "seatfem.structures.formats.uff": "read_frf_uff read_modes_uff",
        "seatfem.structures.formats.writing": "write_mesh",
        "seatfem.structures.lands": "FaceLip face_lip",
        "seatfem.structures.lip": "AnyLip Lip",
        "seatfem.structures.materials": "Material Orthotropic",
        "seatfem.structures.mesh.meshing": "SeatMesh make_mesh",
        "seatfem.structures.mesh.plane_meshes": "MeridianMesh make_meridian",
        "seatfem.structures.mesh.spec": "MeshSpec",
        "seatfem.structures.model": "ModelError Port SecondOrderModel",
        "seatfem.structures.reduction.greens": "greens_function reduce_model",
        "seatfem.structures.reduction.harmonics": "ring_greens",
        "seatfem.structures.reduction.lip_modes": "face_greens lip_greens",
        "seatfem.structures.reduction.modes": "Modes solve_modes",
        "seatfem.structures.reduction.reducer": "Reduction",
        "seatfem.structures.reduction.ring_patches": "RingPatch",
        "seatfem.structures.sheets": "PlateModes Sheet plate_modes",
        "seatfem.structures.store": "Store content_key",
        "seatfem.study.runs.pipeline": "margin_curve run_scene",
        "seatfem.study.scene": "load_scene",
        "seatfem.study.scene.strength": "load_strength",
        "seatfem.study.sweep.optimum": "optimise",
        "seatfem.study.sweep.sweep": "sweep",
        "seatfem.study.trade.report": "draw_trade write_trade",
        "seatfem.study.trade.trade": "Trade measure_trade",
    },
    former={"geometry": "seatfem.structures.shapes"},
)


def __dir__() -> list[str]:
    return sorted(__all__)
