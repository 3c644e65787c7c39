"""Contact between bodies known by their driving-point Green's functions.

The names below are loaded on first use: what reads a file or asks for a version does not wait for the compiler.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from impact.advice import Advice
    from impact.after import measures
    from impact.after.regime import Regime, regime_card
    from impact.after.result import EnergyLedger, ImpactResult
    from impact.after.stresses import (
        PeakStress,
        ReedStress,
        bending_stress,
        peak_bending_stress,
        reed_stress,
        rod_stress,
    )
    from impact.beams.cantilever import Cantilever
    from impact.beams.clamped import ClampedClamped
    from impact.beams.stepped import SteppedCantilever
    from impact.beams.timoshenko import TimoshenkoCantilever
    from impact.beams.tip_mass import TipMassCantilever
    from impact.bodies.base_motion import BaseMotion
    from impact.bodies.body import Body, Load, ModalState, rigid_mass
    from impact.bodies.loads import Gravity, PointForce, Pressure, PressureField
    from impact.bodies.reeds import GivenShape, ModeShape, StaticShape, cantilever_reed, reed
    from impact.bodies.time_series import TimeSeries, read_time_series
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
    from impact.exact.half_space import HalfSpacePatch, half_space_patch, without_patch
    from impact.greens.base import ErrorEstimate, GreensFunction, GreensFunctionError, StepKernel
    from impact.greens.modal import ModalGreens, Residual
    from impact.greens.poles import PoleGreens
    from impact.greens.sampled import SampledGreens
    from impact.greens.sums import ScaledGreens, SumGreens
    from impact.march.film import SqueezeFilm
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
    from impact.march.prepared import prepare
    from impact.march.problem import Contact, ContactError, ContactProblem
    from impact.march.stepper import ContactStepper, StepState
    from impact.measured.nearest_passive import repair
    from impact.measured.passivity import PassivityReport, passivity, require_passive
    from impact.measured.pole_passivity import PolePassivity, pole_passivity
    from impact.measured.reading import read_impulse_response, sampling_advice
    from impact.pictures.greens_plots import plot_greens
    from impact.pictures.lip_plots import plot_lip
    from impact.pictures.plots import plot_energy, plot_force, plot_motion
    from impact.runs.batch import ImpactBatch, solve_many
    from impact.runs.budget import Budget
    from impact.runs.budgeting import Coarser, error_budget
    from impact.runs.solver import collect, solve
    from impact.storage.hdf5 import StorageError, load_greens, load_results, save_greens, save_results

__all__ = [
    "Advice",
    "BaseMotion",
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
    "SqueezeFilm",
    "StaticShape",
    "StepKernel",
    "StepState",
    "SteppedCantilever",
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
    "plot_energy",
    "plot_force",
    "plot_greens",
    "plot_lip",
    "plot_motion",
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

_LATER = {
    "advice": "Advice",
    "after.measures": "measures",
    "after.regime": "Regime regime_card",
    "after.result": "EnergyLedger ImpactResult",
    "after.stresses": "PeakStress ReedStress bending_stress peak_bending_stress reed_stress rod_stress",
    "beams.cantilever": "Cantilever",
    "beams.clamped": "ClampedClamped",
    "beams.stepped": "SteppedCantilever",
    "beams.timoshenko": "TimoshenkoCantilever",
    "beams.tip_mass": "TipMassCantilever",
    "bodies.base_motion": "BaseMotion",
    "bodies.body": "Body Load ModalState rigid_mass",
    "bodies.loads": "Gravity PointForce Pressure PressureField",
    "bodies.reeds": "GivenShape ModeShape StaticShape cantilever_reed reed",
    "bodies.time_series": "TimeSeries read_time_series",
    "exact.closed_form": "fixed_rod free_rod infinite_beam infinite_plate rod_with_end_impedance semi_infinite_rod "
    "single_mode spring",
    "exact.half_space": "HalfSpacePatch half_space_patch without_patch",
    "greens.base": "ErrorEstimate GreensFunction GreensFunctionError StepKernel",
    "greens.modal": "ModalGreens Residual",
    "greens.poles": "PoleGreens",
    "greens.sampled": "SampledGreens",
    "greens.sums": "ScaledGreens SumGreens",
    "march.film": "SqueezeFilm",
    "march.laws": "CompiledLaw Hertz HuntCrossley Law LawError LinearSpring PlainLaw Signorini compiled_law",
    "march.problem": "Contact ContactError ContactProblem",
    "march.prepared": "prepare",
    "march.stepper": "ContactStepper StepState",
    "measured.nearest_passive": "repair",
    "measured.passivity": "PassivityReport passivity require_passive",
    "measured.pole_passivity": "PolePassivity pole_passivity",
    "measured.reading": "read_impulse_response sampling_advice",
    "pictures.greens_plots": "plot_greens",
    "pictures.lip_plots": "plot_lip",
    "pictures.plots": "plot_energy plot_force plot_motion",
    "runs.batch": "ImpactBatch solve_many",
    "runs.budget": "Budget",
    "runs.budgeting": "Coarser error_budget",
    "runs.solver": "collect solve",
    "storage.hdf5": "StorageError load_greens load_results save_greens save_results",
}
_HOME = {name: module for module, names in _LATER.items() for name in names.split()}


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module 'impact' has no attribute {name!r}")
    home = import_module(f"impact.{_HOME[name]}")
    return home if name == "measures" else getattr(home, name)


def __dir__() -> list[str]:
    return sorted(__all__)
