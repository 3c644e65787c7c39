"""The Green's function of a second-order model's ports, by a reduction that is named or chosen."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cache
from importlib.metadata import version
from typing import Final

from impact.greens.base import GreensFunction
from impact.notices import Progress, silent
from impact.quantities import check_numbers, in_time
from seatfem.structures.errors import ModelError
from seatfem.structures.method import AUTO, Aims, memory
from seatfem.structures.model import Damping, SecondOrderModel, check_model
from seatfem.structures.reduction.factorization import Backend
from seatfem.structures.reduction.krylov import Krylov
from seatfem.structures.reduction.modal import Modal
from seatfem.structures.reduction.modes import ConvergenceError
from seatfem.structures.reduction.reducer import Reducer, Reduction, defined
from seatfem.structures.reduction.second_order import SecondOrderKrylov
from seatfem.structures.reduction.transient import Transient

_OURS: Final[tuple[type[Reducer], ...]] = (Krylov, Modal, Transient, SecondOrderKrylov)


def reducers() -> Mapping[str, Reducer]:
    """Return all reductions by name, those of this package first, then those defined elsewhere.

    Raises:
        ModelError: two reductions have the same name.
    """
    by_name: dict[str, Reducer] = {}
    for kind in dict.fromkeys((*_OURS, *defined())):
        reducer = kind()
        if reducer.name in by_name:
            raise ModelError(
                f"two reductions are named {reducer.name!r}, rename one: {type(by_name[reducer.name])} and {kind}"
            )
        by_name[reducer.name] = reducer
    return by_name


def named(name: str) -> Reducer:
    """Return the reduction of that name. Raises `ModelError` with the known names if there is none."""
    known = reducers()
    if name not in known:
        raise ModelError(f"method {name!r} is unknown; choose from {', '.join((AUTO, *known))}")
    return known[name]


def ranked(model: SecondOrderModel, damping: Damping, aims: Aims) -> list[tuple[Reducer, str]]:
    """Return the reductions that can be used, the cheapest first, each with the reason in a sentence with numbers.

    Raises:
        ModelError: none can be used; the message gives the reason of each.
    """
    known = reducers().values()
    refused = {each.name: why for each in known if (why := each.refusal(model, damping, aims))}
    usable = [(each.cost(model, aims), each) for each in known if each.name not in refused]
    if not usable:
        raise ModelError("; ".join(dict.fromkeys(refused.values())))
    usable.sort(key=lambda one: one[0].seconds)
    reasons = dict.fromkeys(why.partition(":")[0] for why in refused.values())
    ways = []
    for number, (cost, way) in enumerate(usable):
        time = f"about {in_time(cost.seconds)} predicted" if cost.seconds else "in no time"
        later = [
            f"{other.name} {in_time(other_cost.seconds)}"
            for other_cost, other in usable[number + 1 :]
            if other_cost.seconds < math.inf
        ]
        ways.append((way, "; ".join([f"{model.size} unknowns: {cost.effort}, {time}", *later, *reasons])))
    return ways


def _cheapest(
    model: SecondOrderModel, damping: Damping, aims: Aims, progress: Progress
) -> tuple[Reducer, str, Reduction]:
    """Return the result of the cheapest reduction that reaches the tolerance; where the number of vectors is stated,
    of the cheapest alone. Raises `ConvergenceError` with the reason of each that does not."""
    ways, missed = ranked(model, damping, aims), list[str]()
    for reducer, reason in ways if aims.max_vectors is None else ways[:1]:
        try:
            reduction = reducer.reduce(model, damping, aims, progress)
        except ConvergenceError as error:
            missed.append(f"{reducer.name}: {str(error).partition(': use method=')[0]}")
            continue
        return reducer, "; ".join([reason, *(f"not by {why}" for why in missed)]), reduction
    raise ConvergenceError("; ".join(missed))


MEASURE: Final = 1e-100, 1e100  # accepted range of the largest entry of M, of K and of each port [SI]


def greens_function(
    model: SecondOrderModel,
    *,
    bandwidth: float,
    duration: float,
    tolerance: float,
    damping_ratio: float = 0.0,
    method: str = AUTO,
    max_vectors: int | None = None,
    ports: Sequence[str] = (),
    backend: Backend = "auto",
    progress: Progress = silent,
) -> GreensFunction:
    """Return the driving-point and cross Green's functions of the model's ports, g = B' sin(sqrt(A) t)/sqrt(A) B, A =
    M^-1 K.

    The error is that of g convolved with a Hann pulse of width 1/bandwidth, over the duration, relative to the largest
    value of the convolution; ``error_estimate.reduction`` states it. Motion above the band is represented by a passive
    exponential with the residual static compliance and the initial velocity 1/Z of the continuum.

    Args:
        bandwidth: frequency up to which g is accurate [Hz].
        duration: time for which g is needed [s]: its ``valid_for``, which is without limit for modes, and if damping
            makes g vanish before (`method.memory`). A longer run is refused.
        tolerance: largest estimated relative error.
        damping_ratio: uniform modal damping ratio, added to the model's own damping: C and loss factors.
        method: "krylov" (one factorization, Ritz pairs), "modes" (eigensolve + residual flexibility), "second_order"
            (any C: complex poles), "transient" (any C: time stepping). "auto" chooses; ``origin["reason"]`` says why,
            with numbers.
        max_vectors: most Krylov vectors; default 800, for a second-order space 500; not used by modes and time
            stepping.
        ports: names of the ports to use; (): all of the model's.
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
    method: str = AUTO,
    max_vectors: int | None = None,
    ports: Sequence[str] = (),
    backend: Backend = "auto",
    progress: Progress = silent,
) -> Reduction:
    """Return the same as `greens_function`, with the modes if the reduction computes any."""
    check_model(model)
    aims = Aims(bandwidth, duration, tolerance, max_vectors, backend)
    return reduced(model.with_ports(ports) if ports else model, aims, damping_ratio, method, progress)


def reduced(
    model: SecondOrderModel,
    aims: Aims,
    damping_ratio: float = 0.0,
    method: str = AUTO,
    progress: Progress = silent,
) -> Reduction:
    """Return the result of `reduce_model` for all ports, with bandwidth, duration, tolerance etc. as ``aims``."""
    check_numbers(ModelError, damping_ratio=damping_ratio)
    if not (damping_ratio >= 0 and math.isfinite(damping_ratio)):
        raise ModelError(f"damping_ratio = {damping_ratio} must be >= 0 and finite")
    named_reducer = None if method == AUTO else named(method)
    if not model.ports:
        raise ModelError("the model has no port to be pushed at; give it one")
    _refuse_beyond_measure(model)
    damping, remembered = model.damping.plus(damping_ratio), memory(damping_ratio, aims.bandwidth)
    lasting = replace(aims, duration=min(aims.duration, remembered))
    if named_reducer is None:
        reducer, reason, reduction = _cheapest(model, damping, lasting, progress)
    else:
        if why := named_reducer.refusal(model, damping, aims):
            raise ModelError(why)
        reducer, reason = named_reducer, "asked for"
        reduction = reducer.reduce(model, damping, lasting, progress)
    origin = {
        "method": reducer.name,
        "reason": reason,
        "bandwidth_Hz": aims.bandwidth,
        "duration_s": aims.duration,
        "tolerance": aims.tolerance,
        "damping_ratio": damping_ratio,
        "rayleigh": None if model.C is None or model.rayleigh is None else list(model.rayleigh),
        "dof": model.size,
        **reduction.greens.origin,
        **({"advice": advice} if (advice := reducer.advice(model)) else {}),
        "versions": dict(_versions()),
    }
    known = reduction.greens.known_for(math.inf if reducer.any_time or remembered <= aims.duration else aims.duration)
    return replace(reduction, greens=known.with_error(known.error, origin))


@cache
def _versions() -> Mapping[str, str]:
    """Return the versions of the packages by which a Green's function is computed."""
    return {name: version(name) for name in ("numpy", "scipy", "scikit-fem")}


def _refuse_beyond_measure(model: SecondOrderModel) -> None:
    """Raise `ModelError` for entries whose products would leave the range of floats."""
    sizes = {name: abs(matrix).max() for name, matrix in (("M", model.M), ("K", model.K))}
    sizes |= {f"port {name!r}": abs(port.vector).max() for name, port in model.ports.items()}
    for name, size in sizes.items():
        if not MEASURE[0] <= size <= MEASURE[1]:
            raise ModelError(
                f"{name}: its largest entry is {size:.3g}, products of it leave the range of numbers "
                f"({MEASURE[0]:g} to {MEASURE[1]:g} is accepted): check its units"
            )
