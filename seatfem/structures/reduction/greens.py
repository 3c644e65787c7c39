"""From a second-order model to the Green's function of its ports, by the road that suits."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from importlib.metadata import version
from typing import Final, TypedDict, get_args

from impact.brief import brief
from impact.greens.base import GreensFunction
from impact.greens.modal import ModalGreens
from impact.greens.poles import PoleGreens
from impact.greens.sampled import SampledGreens
from impact.progress import Progress, silent
from seatfem.structures.model import ModelError, SecondOrderModel
from seatfem.structures.reduction.choice import choose
from seatfem.structures.reduction.damping import Damping, damping_of, uniform_loss
from seatfem.structures.reduction.factorization import Backend
from seatfem.structures.reduction.forgetting import memory, valid_for
from seatfem.structures.reduction.krylov import krylov_greens
from seatfem.structures.reduction.lanczos import lanczos_greens
from seatfem.structures.reduction.methods import Method
from seatfem.structures.reduction.modal_road import modal_greens
from seatfem.structures.reduction.modes import Modes
from seatfem.structures.reduction.second_order_krylov import second_order_greens
from seatfem.structures.reduction.transient import transient_greens

__all__ = ["Method", "Reduction", "greens_function", "reduce_model"]

_MODES_ARE_CHEAP = 3000  # unknowns
MOST_VECTORS: Final = 800  # Krylov; ...
MOST_SECOND_ORDER: Final = 500  # ... of a second-order space; ...
MEASURE: Final = 1e-100, 1e100  # of the entries of M, K and ports, SI
MOST_STEPS: Final = 20_000  # ... of Lanczos, where no given max_vectors says otherwise


@dataclass(frozen=True)
class Reduction:
    """A Green's function, and the modes of the body that were found on the way (krylov and modes; else ``None``)."""

    greens: GreensFunction
    modes: Modes | None

    __repr__ = brief


def greens_function(
    model: SecondOrderModel,
    *,
    bandwidth: float,
    duration: float,
    tolerance: float,
    damping_ratio: float = 0.0,
    method: Method = "auto",
    max_vectors: int | None = None,
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
        duration: [s], how long g is needed: ``valid_for`` of the answer, which is without limit for modes, and where
            ``damping_ratio`` has forgotten the band's tail before (`forgetting.memory`). A run that lasts
            longer is refused.
        tolerance: largest estimated relative error.
        damping_ratio: uniform modal damping ratio, added to the model's own damping: C and loss factors.
        method: "krylov" (one factorization, Ritz pairs), "lanczos" (diagonal mass, products only), "modes"
            (eigensolve + residual flexibility), "second_order" (any C: complex poles), "transient" (any C: time
            stepping). "auto" chooses; ``origin["reason"]`` says why, with numbers.
        max_vectors: most Krylov vectors, or Lanczos steps; default 800, of a second-order space 500, of Lanczos 20,000.
            Modes and time stepping do not ask for it.
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
        max_vectors=max_vectors,
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
    max_vectors: int | None = None,
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
    if max_vectors is not None and max_vectors < 1:
        raise ModelError(f"max_vectors = {max_vectors} must be at least 1")
    if method not in get_args(Method):
        raise ModelError(f"method {method!r} is unknown; choose from {', '.join(get_args(Method))}")
    model = _with_ports(model, ports)
    _refuse_beyond_measure(model)
    road, reason = choose(model, duration) if method == "auto" else (method, "asked for")
    forgotten = duration if road == "transient" else min(duration, memory(damping_ratio, bandwidth))
    aims = Aims(bandwidth=bandwidth, duration=forgotten, tolerance=tolerance, progress=progress)
    greens, modes = _run(model, road, damping_ratio, backend, max_vectors, aims)
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
        **({"advice": advice} if (advice := _advice(road, model)) else {}),
        "versions": {name: version(name) for name in ("numpy", "scipy", "scikit-fem")},
    }
    known = greens.known_for(valid_for(road, damping_ratio, bandwidth, duration))
    return Reduction(known.with_error(known.error, origin), modes)


class Aims(TypedDict):
    """What every road is asked for."""

    bandwidth: float
    duration: float
    tolerance: float
    progress: Progress


def _run(
    model: SecondOrderModel, road: Method, ratio: float, backend: Backend, max_vectors: int | None, aims: Aims
) -> tuple[ModalGreens | PoleGreens | SampledGreens, Modes | None]:
    if road == "transient":
        _refuse_modal_damping(model, ratio)
        return transient_greens(model, backend=backend, **aims), None
    if road == "second_order":
        most = max_vectors or MOST_SECOND_ORDER
        return second_order_greens(model, _beside(model, ratio), backend=backend, max_vectors=most, **aims), None
    damping = damping_of(model, ratio)
    if road == "lanczos":
        return lanczos_greens(model, damping, max_steps=max_vectors or MOST_STEPS, **aims), None
    if road == "krylov":
        return krylov_greens(model, damping, backend=backend, max_vectors=max_vectors or MOST_VECTORS, **aims)
    return modal_greens(model, damping, backend=backend, **aims)


def _beside(model: SecondOrderModel, ratio: float) -> Damping:
    """Modal damping in addition to whatever C is."""
    eta = uniform_loss(model)
    return Damping(ratio + (eta or 0.0) / 2, loss=model.loss if eta is None else None)


def _refuse_modal_damping(model: SecondOrderModel, ratio: float) -> None:
    if ratio > 0:
        raise ModelError(
            f"damping_ratio = {ratio}: uniform modal damping is a function of M^-1 K and has no sparse C: it cannot be "
            "stepped in time; use method='krylov', 'lanczos' or 'modes', or give the model a C"
        )
    if model.loss is not None and model.loss.nnz:
        raise ModelError(
            "loss factors (structural damping) are defined by the frequency and cannot be stepped in time; use "
            "method='krylov', or 'second_order' if there are dashpots too"
        )


def _advice(road: Method, model: SecondOrderModel) -> str:
    """What would be quicker, if the road was asked for against the cost."""
    if road == "modes" and model.size > _MODES_ARE_CHEAP:
        return (
            "modes cost far more than the Green's function needs: method='krylov' reaches the same error with one "
            "factorization and a tenth of the vectors (benchmarks/demo_greens.py)"
        )
    return ""


def _refuse_beyond_measure(model: SecondOrderModel) -> None:
    """Numbers whose products leave the range of floats."""
    sizes = {name: abs(matrix).max() for name, matrix in (("M", model.M), ("K", model.K))}
    sizes |= {f"port {name!r}": abs(port.vector).max() for name, port in model.ports.items()}
    for name, size in sizes.items():
        if not MEASURE[0] <= size <= MEASURE[1]:
            raise ModelError(
                f"{name}: its largest entry is {size:.3g}, products of it leave the range of numbers "
                f"({MEASURE[0]:g} to {MEASURE[1]:g} is accepted): check its units"
            )


def _with_ports(model: SecondOrderModel, names: Sequence[str] | None) -> SecondOrderModel:
    if not model.ports:
        raise ModelError("the model has no port: nothing can push it")
    if names is None:
        return model
    unknown = [name for name in names if name not in model.ports]
    if unknown:
        raise ModelError(f"no port {', '.join(unknown)}; the model has {', '.join(model.ports)}")
    return replace(model, ports={name: model.ports[name] for name in names})
