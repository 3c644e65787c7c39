"""Contact between bodies known by their driving-point Green's functions.

What every contact needs is loaded at once; the rest of the names below on first use.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from impact import measures
from impact.beam import Cantilever, cantilever_reed
from impact.body import Body, Load, ModalState, rigid_mass
from impact.closed_form import (
    fixed_rod,
    free_rod,
    infinite_beam,
    infinite_plate,
    rod_with_end_impedance,
    semi_infinite_rod,
    single_mode,
    spring,
)
from impact.energy import EnergyLedger
from impact.greens import ErrorEstimate, GreensFunction, GreensFunctionError, StepKernel
from impact.laws import CompiledLaw, Hertz, HuntCrossley, LawError, LinearSpring, PlainLaw, Signorini, compiled_law
from impact.modal import ModalGreens, Residual
from impact.passivity import PassivityReport, passivity, require_passive
from impact.problem import Contact, ContactError, ContactProblem
from impact.result import Advice, ImpactResult
from impact.sampled import SampledGreens
from impact.solver import collect, solve
from impact.stepper import ContactStepper, StepState, prepare

if TYPE_CHECKING:
    from impact.batch import ImpactBatch, solve_many
    from impact.budget import Budget
    from impact.budgeting import Coarser, error_budget
    from impact.clamped import ClampedClamped
    from impact.half_space import HalfSpacePatch, half_space_patch, without_patch
    from impact.loads import Gravity, PointForce, Pressure, PressureField
    from impact.measured import read_impulse_response, sampling_advice
    from impact.nearest_passive import repair
    from impact.pole_passivity import PolePassivity, pole_passivity
    from impact.poles import PoleGreens
    from impact.reeds import GivenShape, ModeShape, StaticShape, reed
    from impact.regime import Regime, regime_card
    from impact.storage import StorageError, load_greens, load_results, save_greens, save_results
    from impact.stress import PeakStress, ReedStress, bending_stress, peak_bending_stress, reed_stress, rod_stress
    from impact.sums import ScaledGreens, SumGreens
    from impact.time_series import TimeSeries, read_time_series
    from impact.timoshenko import TimoshenkoCantilever
    from impact.tip_mass import TipMassCantilever

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
    "read_impulse_response": "measured",
    "sampling_advice": "measured",
    "repair": "nearest_passive",
    "Budget": "budget",
    "Coarser": "budgeting",
    "error_budget": "budgeting",
    "ImpactBatch": "batch",
    "solve_many": "batch",
    "ClampedClamped": "clamped",
    "HalfSpacePatch": "half_space",
    "half_space_patch": "half_space",
    "without_patch": "half_space",
    "Gravity": "loads",
    "PointForce": "loads",
    "Pressure": "loads",
    "PressureField": "loads",
    "PoleGreens": "poles",
    "PolePassivity": "pole_passivity",
    "pole_passivity": "pole_passivity",
    "GivenShape": "reeds",
    "ModeShape": "reeds",
    "StaticShape": "reeds",
    "reed": "reeds",
    "Regime": "regime",
    "regime_card": "regime",
    "StorageError": "storage",
    "load_greens": "storage",
    "load_results": "storage",
    "save_greens": "storage",
    "save_results": "storage",
    "PeakStress": "stress",
    "ReedStress": "stress",
    "bending_stress": "stress",
    "peak_bending_stress": "stress",
    "reed_stress": "stress",
    "rod_stress": "stress",
    "ScaledGreens": "sums",
    "SumGreens": "sums",
    "TimeSeries": "time_series",
    "read_time_series": "time_series",
    "TimoshenkoCantilever": "timoshenko",
    "TipMassCantilever": "tip_mass",
}


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module 'impact' has no attribute {name!r}")
    return getattr(import_module(f"impact.{_HOME[name]}"), name)


def __dir__() -> list[str]:
    return sorted(__all__)
