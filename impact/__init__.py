"""Contact between bodies known by their driving-point Green's functions."""

from impact.greens import ErrorEstimate, GreensFunction, GreensFunctionError, StepKernel
from impact.modal import ModalGreens, Residual

__all__ = ["ErrorEstimate", "GreensFunction", "GreensFunctionError", "ModalGreens", "Residual", "StepKernel"]
