"""From a second-order model to the Green's function of its ports, by the road that suits."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from importlib.metadata import version
from typing import Literal, get_args

from impact.greens import GreensFunction
from impact.modal import ModalGreens
from impact.progress import Progress, silent
from impact.sampled import SampledGreens
from seatfem.damping import damping_of
from seatfem.factorization import Backend
from seatfem.krylov import krylov_greens
from seatfem.model import ModelError, SecondOrderModel
from seatfem.modes import Modes, modal_greens
from seatfem.transient import transient_greens

Method = Literal["auto", "krylov", "modes", "transient"]
_SMALL = 600  # unknowns up to which all modes cost nothing


@dataclass(frozen=True)
class Reduction:
    """A Green's function, and the modes of the body that were found on the way (``None`` from the transient road)."""

    greens: GreensFunction
    modes: Modes | None


def greens_function(
    model: SecondOrderModel,
    *,
    bandwidth: float,
    duration: float,
    tolerance: float,
    damping_ratio: float = 0.0,
    method: Method = "auto",
    ports: Sequence[str] | None = None,
    backend: Backend = "auto",
    progress: Progress = silent,
) -> GreensFunction:
    """Driving-point and cross Green's functions of the model's ports, g = B' sin(sqrt(A) t)/sqrt(A) B, A = M^-1 K.

    The error is that of g convolved with a Hann pulse of width 1/bandwidth, over the duration, relative to the largest
    value of the convolution; ``error_estimate.reduction`` states it. What happens above the band is carried by a
    passive exponential with the static compliance left out and the first velocity 1/Z of the continuum.

    Args:
        bandwidth: [Hz].
        duration: [s], how long g is needed.
        tolerance: largest estimated relative error.
        damping_ratio: uniform modal damping ratio; for Rayleigh damping give the model a C.
        method: "krylov" (Ritz pairs), "modes" (eigensolve + residual flexibility), "transient" (time stepping).
        ports: names of the ports to use; default: all of the model's.
        backend: sparse factorization.
        progress: called with the stage and the fraction done.

    Raises:
        ModelError: an unusable argument or damping. ConvergenceError: the tolerance is not reached.
        FactorizationError: K + s^2 M is not positive definite.
    """
    return reduce_model(
        model,
        bandwidth=bandwidth,
        duration=duration,
        tolerance=tolerance,
        damping_ratio=damping_ratio,
        method=method,
        ports=ports,
        backend=backend,
        progress=progress,
    ).greens


def reduce_model(
    model: SecondOrderModel,
    *,
    bandwidth: float,
    duration: float,
    tolerance: float,
    damping_ratio: float = 0.0,
    method: Method = "auto",
    ports: Sequence[str] | None = None,
    backend: Backend = "auto",
    progress: Progress = silent,
) -> Reduction:
    """As `greens_function`, with the modes found on the way."""
    for name, value in (("bandwidth", bandwidth), ("duration", duration), ("tolerance", tolerance)):
        if not (value > 0 and math.isfinite(value)):
            raise ModelError(f"{name} = {value} must be positive and finite")
    if not (damping_ratio >= 0 and math.isfinite(damping_ratio)):
        raise ModelError(f"damping_ratio = {damping_ratio} must be >= 0 and finite")
    if method not in get_args(Method):
        raise ModelError(f"method {method!r} is unknown; choose from {', '.join(get_args(Method))}")
    model = _with_ports(model, ports)
    road, reason = _choose(model, damping_ratio) if method == "auto" else (method, "asked for")
    greens: ModalGreens | SampledGreens
    modes: Modes | None
    if road == "transient":
        if damping_ratio > 0:
            raise ModelError(
                f"damping_ratio = {damping_ratio}: uniform modal damping is a function of M^-1 K and has no sparse C: "
                "it cannot be stepped in time; use method='krylov' or 'modes', or give the model a C"
            )
        greens, modes = (
            transient_greens(
                model, bandwidth=bandwidth, duration=duration, tolerance=tolerance, backend=backend, progress=progress
            ),
            None,
        )
    else:
        solve = krylov_greens if road == "krylov" else modal_greens
        greens, modes = solve(
            model,
            damping_of(model, damping_ratio),
            bandwidth=bandwidth,
            duration=duration,
            tolerance=tolerance,
            backend=backend,
            progress=progress,
        )
    origin = {
        "method": road,
        "reason": reason,
        "bandwidth_Hz": bandwidth,
        "duration_s": duration,
        "tolerance": tolerance,
        "damping_ratio": damping_ratio,
        "rayleigh": None if model.C is None or model.rayleigh is None else list(model.rayleigh),
        "dof": model.size,
        **greens.origin,
        "versions": {name: version(name) for name in ("numpy", "scipy", "scikit-fem")},
    }
    return Reduction(replace(greens, origin=origin), modes)


def _choose(model: SecondOrderModel, damping_ratio: float) -> tuple[Literal["krylov", "modes", "transient"], str]:
    if model.C is not None and model.rayleigh is None:
        if damping_ratio > 0:
            raise ModelError(f"damping_ratio = {damping_ratio} and a damping matrix C at once: give one of them")
        return "transient", "C is not alpha M + beta K: damping couples the modes, so the model is stepped in time"
    if model.size <= _SMALL:
        return "modes", f"{model.size} unknowns: all modes at once cost less than anything else"
    return "krylov", f"{model.size} unknowns: one factorization, and far fewer vectors than there are modes in the band"


def _with_ports(model: SecondOrderModel, names: Sequence[str] | None) -> SecondOrderModel:
    if not model.ports:
        raise ModelError("the model has no port: nothing can push it")
    if names is None:
        return model
    unknown = [name for name in names if name not in model.ports]
    if unknown:
        raise ModelError(f"no port {', '.join(unknown)}; the model has {', '.join(model.ports)}")
    return replace(model, ports={name: model.ports[name] for name in names})
