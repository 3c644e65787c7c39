"""The steps of a study as tests take them, from one place: where each of them lives is the product's matter."""
# ruff: noqa: F401 (they are for the tests)

from impact.greens.base import ErrorEstimate, GreensFunction, GreensFunctionError
from impact.greens.modal import ModalGreens, Residual
from impact.notices import silent
from impact.runs.variations import SAFETY, Budget
from impact.storage.hdf5 import load_greens, load_results, save_greens
from seatfem.faces.cli import BAD_INPUT, DONE, FAILED, run_command
from seatfem.machine.resources import Stopwatch
from seatfem.structures.cache import Store, key_of
from seatfem.structures.errors import ModelError
from seatfem.structures.kinds import kinds_of
from seatfem.structures.lip import Lip
from seatfem.structures.method import LevelError, Method, Solved, bed
from seatfem.structures.rings import Division
from seatfem.study.error_budget import error_budget
from seatfem.study.impacts.bodies import problem_of
from seatfem.study.impacts.contact import RunError, run_contacts
from seatfem.study.impacts.touches import SOURCES, Touches, values_of_record
from seatfem.study.ladders.ladder import ComputedRun
from seatfem.study.method import stated_method
from seatfem.study.plan import Plan
from seatfem.study.runs.converge import begin_plan, refine_plan
from seatfem.study.runs.forecast import converge, look_at
from seatfem.study.runs.next_round import Limits
from seatfem.study.runs.pipeline import run_scene
from seatfem.study.runs.round import Round
from seatfem.study.runs.rounds import rounds
from seatfem.study.scene import Scene, SceneError, load_scene
from seatfem.study.scene.files import check_files
from tests.as_stated import seat_of, solved_striker, striker_of
