"""Contact between bodies known by their driving-point Green's functions."""

from impact import measures
from impact.beam import Cantilever, cantilever_reed
from impact.body import Body, ModalState, rigid_mass
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
from impact.laws import Hertz, LawError, LinearSpring, Signorini
from impact.modal import ModalGreens, Residual
from impact.result import Advice, ImpactResult
from impact.solver import ContactError, ContactProblem, solve

__all__ = [
    "Advice",
    "Body",
    "Cantilever",
    "ContactError",
    "ContactProblem",
    "EnergyLedger",
    "ErrorEstimate",
    "GreensFunction",
    "GreensFunctionError",
    "Hertz",
    "ImpactResult",
    "LawError",
    "LinearSpring",
    "ModalGreens",
    "ModalState",
    "Residual",
    "Signorini",
    "StepKernel",
    "cantilever_reed",
    "fixed_rod",
    "free_rod",
    "infinite_beam",
    "infinite_plate",
    "measures",
    "rigid_mass",
    "rod_with_end_impedance",
    "semi_infinite_rod",
    "single_mode",
    "solve",
    "spring",
]
