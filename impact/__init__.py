"""Contact between bodies known by their driving-point Green's functions."""

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
from impact.laws import CompiledLaw, Hertz, HuntCrossley, LawError, LinearSpring, Signorini, compiled_law
from impact.modal import ModalGreens, Residual
from impact.problem import Contact, ContactError, ContactProblem
from impact.result import Advice, ImpactResult
from impact.sampled import SampledGreens
from impact.solver import collect, solve
from impact.stepper import ContactStepper, prepare

__all__ = [
    "Advice",
    "Body",
    "Cantilever",
    "CompiledLaw",
    "Contact",
    "ContactError",
    "ContactProblem",
    "ContactStepper",
    "EnergyLedger",
    "ErrorEstimate",
    "GreensFunction",
    "GreensFunctionError",
    "Hertz",
    "HuntCrossley",
    "ImpactResult",
    "LawError",
    "LinearSpring",
    "Load",
    "ModalGreens",
    "ModalState",
    "Residual",
    "SampledGreens",
    "Signorini",
    "StepKernel",
    "cantilever_reed",
    "collect",
    "compiled_law",
    "fixed_rod",
    "free_rod",
    "infinite_beam",
    "infinite_plate",
    "measures",
    "prepare",
    "rigid_mass",
    "rod_with_end_impedance",
    "semi_infinite_rod",
    "single_mode",
    "solve",
    "spring",
]
