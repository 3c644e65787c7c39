"""Contact between bodies known by their driving-point Green's functions.

The names below are loaded on first use: what reads a file or asks for a version does not wait for the compiler.
"""

from typing import TYPE_CHECKING

from impact.names import lazy_names

if TYPE_CHECKING:
    from impact.advice import Advice
    from impact.after import measures
    from impact.after.landings import ContactRecord, Landing, find_landings
    from impact.after.regime import Regime, regime_card
    from impact.after.result import EnergyLedger, ImpactResult
    from impact.after.rods import (
        displacement_response,
        fixed_rod_modes,
        force_response,
        modal_displacement,
        rod_axial_force,
        rod_displacement,
    )
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
    from impact.exact.half_space import (
        HalfSpacePatch,
        disk_compliance,
        half_space_patch,
        punch_compliance,
        square_compliance,
        without_patch,
    )
    from impact.greens.base import ErrorEstimate, GreensFunction, GreensFunctionError, StepKernel
    from impact.greens.modal import ModalGreens, Residual
    from impact.greens.poles import PoleGreens
    from impact.greens.receptance import receptance
    from impact.greens.sampled import SampledGreens
    from impact.greens.state_space import StateSpace, state_space
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
    from impact.measured.frf import FrequencyResponse
    from impact.measured.nearest_passive import repair
    from impact.measured.passivity import PassivityReport, passivity, require_passive
    from impact.measured.pole_fit import fit_poles
    from impact.measured.pole_passivity import PolePassivity, pole_passivity
    from impact.measured.reading import read_impulse_response, sampling_advice
    from impact.pictures.greens_plots import plot_greens
    from impact.pictures.lip_plots import plot_lip
    from impact.pictures.plots import plot_energy, plot_force, plot_motion
    from impact.runs.batch import ImpactBatch, solve_many
    from impact.runs.budget import Budget
    from impact.runs.budgeting import Coarser, error_budget
    from impact.runs.solver import collect, solve
    from impact.storage.checkpoint import restore_checkpoint, save_checkpoint
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
    "ContactRecord",
    "ContactStepper",
    "EnergyLedger",
    "ErrorEstimate",
    "FrequencyResponse",
    "GivenShape",
    "Gravity",
    "GreensFunction",
    "GreensFunctionError",
    "HalfSpacePatch",
    "Hertz",
    "HuntCrossley",
    "ImpactBatch",
    "ImpactResult",
    "Landing",
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
    "StateSpace",
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
    "disk_compliance",
    "displacement_response",
    "error_budget",
    "find_landings",
    "fit_poles",
    "fixed_rod",
    "fixed_rod_modes",
    "force_response",
    "free_rod",
    "half_space_patch",
    "infinite_beam",
    "infinite_plate",
    "load_greens",
    "load_results",
    "measures",
    "modal_displacement",
    "passivity",
    "peak_bending_stress",
    "plot_energy",
    "plot_force",
    "plot_greens",
    "plot_lip",
    "plot_motion",
    "pole_passivity",
    "prepare",
    "punch_compliance",
    "read_impulse_response",
    "read_time_series",
    "receptance",
    "reed",
    "reed_stress",
    "regime_card",
    "repair",
    "require_passive",
    "restore_checkpoint",
    "rigid_mass",
    "rod_axial_force",
    "rod_displacement",
    "rod_stress",
    "rod_with_end_impedance",
    "sampling_advice",
    "save_checkpoint",
    "save_greens",
    "save_results",
    "semi_infinite_rod",
    "single_mode",
    "solve",
    "solve_many",
    "spring",
    "square_compliance",
    "state_space",
    "without_patch",
]

__getattr__ = lazy_names(
    __name__,
    {
        "impact.advice": "Advice",
        "impact.after.landings": "ContactRecord Landing find_landings",
        "impact.after.measures": "measures",
        "impact.after.regime": "Regime regime_card",
        "impact.after.result": "EnergyLedger ImpactResult",
        "impact.after.rods": "displacement_response fixed_rod_modes force_response modal_displacement "
        "rod_axial_force rod_displacement",
        "impact.after.stresses": "PeakStress ReedStress bending_stress peak_bending_stress reed_stress rod_stress",
        "impact.beams.cantilever": "Cantilever",
        "impact.beams.clamped": "ClampedClamped",
        "impact.beams.stepped": "SteppedCantilever",
        "impact.beams.timoshenko": "TimoshenkoCantilever",
        "impact.beams.tip_mass": "TipMassCantilever",
        "impact.bodies.base_motion": "BaseMotion",
        "impact.bodies.body": "Body Load ModalState rigid_mass",
        "impact.bodies.loads": "Gravity PointForce Pressure PressureField",
        "impact.bodies.reeds": "GivenShape ModeShape StaticShape cantilever_reed reed",
        "impact.bodies.time_series": "TimeSeries read_time_series",
        "impact.exact.closed_form": "fixed_rod free_rod infinite_beam infinite_plate rod_with_end_impedance "
        "semi_infinite_rod single_mode spring",
        "impact.exact.half_space": "HalfSpacePatch disk_compliance half_space_patch punch_compliance "
        "square_compliance without_patch",
        "impact.greens.base": "ErrorEstimate GreensFunction GreensFunctionError StepKernel",
        "impact.greens.modal": "ModalGreens Residual",
        "impact.greens.poles": "PoleGreens",
        "impact.greens.receptance": "receptance",
        "impact.greens.sampled": "SampledGreens",
        "impact.greens.state_space": "StateSpace state_space",
        "impact.greens.sums": "ScaledGreens SumGreens",
        "impact.march.film": "SqueezeFilm",
        "impact.march.laws": "CompiledLaw Hertz HuntCrossley Law LawError LinearSpring PlainLaw Signorini compiled_law",
        "impact.march.prepared": "prepare",
        "impact.march.problem": "Contact ContactError ContactProblem",
        "impact.march.stepper": "ContactStepper StepState",
        "impact.measured.frf": "FrequencyResponse",
        "impact.measured.nearest_passive": "repair",
        "impact.measured.passivity": "PassivityReport passivity require_passive",
        "impact.measured.pole_fit": "fit_poles",
        "impact.measured.pole_passivity": "PolePassivity pole_passivity",
        "impact.measured.reading": "read_impulse_response sampling_advice",
        "impact.pictures.greens_plots": "plot_greens",
        "impact.pictures.lip_plots": "plot_lip",
        "impact.pictures.plots": "plot_energy plot_force plot_motion",
        "impact.runs.batch": "ImpactBatch solve_many",
        "impact.runs.budget": "Budget",
        "impact.runs.budgeting": "Coarser error_budget",
        "impact.runs.solver": "collect solve",
        "impact.storage.checkpoint": "restore_checkpoint save_checkpoint",
        "impact.storage.hdf5": "StorageError load_greens load_results save_greens save_results",
    },
    former={
        "contact_stress": "impact.exact.contact_stress",
        "half_space": "impact.exact.half_space",
        "pekeris": "impact.exact.disk_response",
        "rods": "impact.after.rods",
        "after.contact_stress": "impact.exact.contact_stress",
    },
)


def __dir__() -> list[str]:
    return sorted(__all__)
