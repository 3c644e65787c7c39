"""Contact between bodies known by their driving-point Green's functions.

What every contact needs is loaded at once; the rest of the names below on first use.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from impact.advice import Advice
from impact.after import measures
from impact.after.energy import EnergyLedger
from impact.after.result import ImpactResult
from impact.beams.cantilever import Cantilever
from impact.bodies.body import Body, Load, ModalState, rigid_mass
from impact.bodies.reeds import cantilever_reed
from impact.exact.closed_form import (
    fixed_rod,
    free_rod,
    infinite_beam,
    infinite_plate,
    rod_with_end_impedance,
    semi_infinite_rod,
    single_mode,
    spring,
)
from impact.greens.base import ErrorEstimate, GreensFunction, GreensFunctionError, StepKernel
from impact.greens.modal import ModalGreens, Residual
from impact.greens.sampled import SampledGreens
from impact.march.laws import (
    CompiledLaw,
    Hertz,
    HuntCrossley,
    Law,
    LawError,
    LinearSpring,
    PlainLaw,
    Signorini,
    compiled_law,
)
from impact.march.problem import Contact, ContactError, ContactProblem
from impact.march.stepper import ContactStepper, StepState, prepare
from impact.measured.passivity import PassivityReport, passivity, require_passive
from impact.runs.solver import collect, solve

if TYPE_CHECKING:
    from impact.after.regime import Regime, regime_card
    from impact.after.stresses import (
        PeakStress,
        ReedStress,
        bending_stress,
        peak_bending_stress,
        reed_stress,
        rod_stress,
    )
    from impact.beams.clamped import ClampedClamped
    from impact.beams.timoshenko import TimoshenkoCantilever
    from impact.beams.tip_mass import TipMassCantilever
    from impact.bodies.loads import Gravity, PointForce, Pressure, PressureField
    from impact.bodies.reeds import GivenShape, ModeShape, StaticShape, reed
    from impact.bodies.time_series import TimeSeries, read_time_series
    from impact.exact.half_space import HalfSpacePatch, half_space_patch, without_patch
    from impact.greens.poles import PoleGreens
    from impact.greens.sums import ScaledGreens, SumGreens
    from impact.measured.nearest_passive import repair
    from impact.measured.pole_passivity import PolePassivity, pole_passivity
    from impact.measured.reading import read_impulse_response, sampling_advice
    from impact.runs.batch import ImpactBatch, solve_many
    from impact.runs.budget import Budget
    from impact.runs.budgeting import Coarser, error_budget
    from impact.storage.hdf5 import StorageError, load_greens, load_results, save_greens, save_results

__all__ = [
    "Advice",
    "Body",
    "Budget",
    "Cantilever",
    "ClampedClamped",
    "Coarser",
    "CompiledLaw",
    "Contact",
    "ContactError",
    "ContactProblem",
    "ContactStepper",
    "EnergyLedger",
    "ErrorEstimate",
    "GivenShape",
    "Gravity",
    "GreensFunction",
    "GreensFunctionError",
    "HalfSpacePatch",
    "Hertz",
    "HuntCrossley",
    "ImpactBatch",
    "ImpactResult",
    "Law",
    "LawError",
    "LinearSpring",
    "Load",
    "ModalGreens",
    "ModalState",
    "ModeShape",
    "PassivityReport",
    "PeakStress",
    "PlainLaw",
    "PointForce",
    "PoleGreens",
    "PolePassivity",
    "Pressure",
    "PressureField",
    "ReedStress",
    "Regime",
    "Residual",
    "SampledGreens",
    "ScaledGreens",
    "Signorini",
    "StaticShape",
    "StepKernel",
    "StepState",
    "StorageError",
    "SumGreens",
    "TimeSeries",
    "TimoshenkoCantilever",
    "TipMassCantilever",
    "bending_stress",
    "cantilever_reed",
    "collect",
    "compiled_law",
    "error_budget",
    "fixed_rod",
    "free_rod",
    "half_space_patch",
    "infinite_beam",
    "infinite_plate",
    "load_greens",
    "load_results",
    "measures",
    "passivity",
    "peak_bending_stress",
    "pole_passivity",
    "prepare",
    "read_impulse_response",
    "read_time_series",
    "reed",
    "reed_stress",
    "regime_card",
    "repair",
    "require_passive",
    "rigid_mass",
    "rod_stress",
    "rod_with_end_impedance",
    "sampling_advice",
    "save_greens",
    "save_results",
    "semi_infinite_rod",
    "single_mode",
    "solve",
    "solve_many",
    "spring",
    "without_patch",
]

_HOME = {
    "read_impulse_response": "measured.reading",
    "sampling_advice": "measured.reading",
    "repair": "measured.nearest_passive",
    "Budget": "runs.budget",
    "Coarser": "runs.budgeting",
    "error_budget": "runs.budgeting",
    "ImpactBatch": "runs.batch",
    "solve_many": "runs.batch",
    "ClampedClamped": "beams.clamped",
    "HalfSpacePatch": "exact.half_space",
    "half_space_patch": "exact.half_space",
    "without_patch": "exact.half_space",
    "Gravity": "bodies.loads",
    "PointForce": "bodies.loads",
    "Pressure": "bodies.loads",
    "PressureField": "bodies.loads",
    "PoleGreens": "greens.poles",
    "PolePassivity": "measured.pole_passivity",
    "pole_passivity": "measured.pole_passivity",
    "GivenShape": "bodies.reeds",
    "ModeShape": "bodies.reeds",
    "StaticShape": "bodies.reeds",
    "reed": "bodies.reeds",
    "Regime": "after.regime",
    "regime_card": "after.regime",
    "StorageError": "storage.hdf5",
    "load_greens": "storage.hdf5",
    "load_results": "storage.hdf5",
    "save_greens": "storage.hdf5",
    "save_results": "storage.hdf5",
    "PeakStress": "after.stresses",
    "ReedStress": "after.stresses",
    "bending_stress": "after.stresses",
    "peak_bending_stress": "after.stresses",
    "reed_stress": "after.stresses",
    "rod_stress": "after.stresses",
    "ScaledGreens": "greens.sums",
    "SumGreens": "greens.sums",
    "TimeSeries": "bodies.time_series",
    "read_time_series": "bodies.time_series",
    "TimoshenkoCantilever": "beams.timoshenko",
    "TipMassCantilever": "beams.tip_mass",
}


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module 'impact' has no attribute {name!r}")
    return getattr(import_module(f"impact.{_HOME[name]}"), name)


def __dir__() -> list[str]:
    return sorted(__all__)
