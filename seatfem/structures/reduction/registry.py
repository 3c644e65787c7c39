"""All reductions there are, by name, and the cheapest of those that can be used."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Final

from impact.quantities import in_time
from seatfem.structures.damping import Damping
from seatfem.structures.errors import ModelError
from seatfem.structures.method import AUTO, Aims
from seatfem.structures.model import SecondOrderModel
from seatfem.structures.reduction.krylov import Krylov
from seatfem.structures.reduction.lanczos import Lanczos
from seatfem.structures.reduction.modal import Modal
from seatfem.structures.reduction.reducer import Reducer, defined
from seatfem.structures.reduction.second_order_krylov import SecondOrderKrylov
from seatfem.structures.reduction.transient import Transient

_OURS: Final[tuple[type[Reducer], ...]] = (Krylov, Modal, Transient, Lanczos, SecondOrderKrylov)


def reducers() -> Mapping[str, Reducer]:
    """Return one of each kind, ours first, then those that were defined elsewhere.

    Raises:
        ModelError: two kinds have one name.
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
    """Return the reduction of that name. Raises `ModelError`, which lists those there are."""
    known = reducers()
    if name not in known:
        raise ModelError(f"method {name!r} is unknown; choose from {', '.join((AUTO, *known))}")
    return known[name]


def refusal(reducer: Reducer, model: SecondOrderModel, damping: Damping, aims: Aims) -> str:
    """Return why a reduction cannot be used, here or on the ranks of PETSc; "" where it can."""
    if aims.distributed and not reducer.distributes:
        able = " and ".join(name for name, each in reducers().items() if each.distributes)
        return f"backend='slepc' has {able}, not {reducer.name}: leave seat.greens.backend out, or take one of them"
    return reducer.refusal(model, damping, aims)


def choose(model: SecondOrderModel, damping: Damping, aims: Aims) -> tuple[Reducer, str]:
    """Return (the cheapest that can be used, why in a sentence with numbers), all of them asked.

    Raises:
        ModelError: none can be used; why each does not.
    """
    known = [each for each in reducers().values() if each.distributes or not aims.distributed]
    refused = {each.name: why for each in known if (why := each.refusal(model, damping, aims))}
    serving = [(each.cost(model, aims), each) for each in known if each.name not in refused]
    if not serving:
        raise ModelError("; ".join(dict.fromkeys(refused.values())))
    (cost, best), *others = sorted(serving, key=lambda one: one[0].seconds)
    time = f"about {in_time(cost.seconds)} predicted" if cost.seconds else "in no time"
    against = [
        f"{other.name} {in_time(predicted.seconds)}" for predicted, other in others if predicted.seconds < math.inf
    ]
    reasons = dict.fromkeys(why.partition(":")[0] for why in refused.values())
    return best, "; ".join([f"{model.size} unknowns: {cost.effort}, {time}", *against, *reasons])
