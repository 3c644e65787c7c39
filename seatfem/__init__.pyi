# ruff: noqa: I001 (one import a module)
from impact.notices import SeatfemError as SeatfemError
from impact.measured.frf import FrequencyResponse as FrequencyResponse, read_frf as read_frf
from impact.measured.pole_fit import fit_impulse_response as fit_impulse_response, fit_poles as fit_poles
from seatfem.pictures.plots import plot_mesh as plot_mesh, plot_modes as plot_modes
from seatfem.life.maps import plot_margins as plot_margins
from seatfem.life.lives import margin_curve as margin_curve
from seatfem.life.table import load_strength as load_strength
from seatfem.structures.elements.assembly import assemble as assemble
from seatfem.structures.elements.axisymmetric import assemble_axisymmetric as assemble_axisymmetric
from seatfem.structures.elements.mindlin import (
    PlateMesh as PlateMesh,
    assemble_plate as assemble_plate,
    plate_ports as plate_ports,
)
from seatfem.structures.formats.matrices import read_matrices as read_matrices
from seatfem.structures.formats.mesh_files import read_mesh as read_mesh
from seatfem.structures.formats.uff import read_modes_uff as read_modes_uff
from seatfem.structures.formats.uff_responses import read_frf_uff as read_frf_uff
from seatfem.structures.formats.writing import write_mesh as write_mesh
from seatfem.structures.lands import FaceLip as FaceLip, face_lip as face_lip
from seatfem.structures.lip import AnyLip as AnyLip, Lip as Lip
from seatfem.structures.materials import Material as Material, Orthotropic as Orthotropic
from seatfem.structures.mesh.meshing import SeatMesh as SeatMesh, make_mesh as make_mesh
from seatfem.structures.mesh.plane_meshes import MeridianMesh as MeridianMesh, make_meridian as make_meridian
from seatfem.structures.mesh.spec import MeshSpec as MeshSpec
from seatfem.structures.model import ModelError as ModelError, Port as Port, SecondOrderModel as SecondOrderModel
from seatfem.structures.reduction.greens import greens_function as greens_function, reduce_model as reduce_model
from seatfem.structures.reduction.harmonics import (
    RingPatch as RingPatch,
    ring_greens as ring_greens,
)
from seatfem.structures.reduction.lip_modes import face_greens as face_greens, lip_greens as lip_greens
from seatfem.structures.reduction.modes import Modes as Modes, solve_modes as solve_modes
from seatfem.structures.reduction.reducer import Reduction as Reduction
from seatfem.structures.sheets import PlateModes as PlateModes, Sheet as Sheet, plate_modes as plate_modes
from seatfem.structures.cache import Store as Store, content_key as content_key
from seatfem.study.runs.forecast import converge as converge
from seatfem.study.runs.outcome import RunResult as RunResult
from seatfem.study.runs.pipeline import run as run, run_scene as run_scene
from seatfem.study.scene import load_scene as load_scene
from seatfem.study.sweep.sweep import (
    optimise as optimise,
    sweep as sweep,
)
from seatfem.study.trade.report import draw_trade as draw_trade, write_trade as write_trade
from seatfem.study.trade.trade import Trade as Trade, measure_trade as measure_trade
from seatfem import (
    __main__ as __main__,
    faces as faces,
    fields as fields,
    jobs as jobs,
    machine as machine,
    pictures as pictures,
    readings as readings,
    results as results,
    structures as structures,
    study as study,
    units as units,
    verify as verify,
)
