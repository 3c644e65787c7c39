"""A decision in words: every key, its value, and the reason with its number."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any, Final

import numpy as np

from impact.greens.base import StepKernel
from impact.greens.modal import ModalGreens, Residual
from impact.march import engines
from seatfem.structures.estimates.costs import ALL_MODES, DISCRETE, SeatModel, seat_model
from seatfem.structures.estimates.mesh_size import Sizes, per_wavelength
from seatfem.study.impacts.variations import FEW, FEWER, MANY
from seatfem.study.planning.deciding import Decision
from seatfem.study.planning.filling import has_key, is_given, value_of
from seatfem.study.planning.options import (
    BAND,
    CONTACT_SIZE,
    METHOD,
    MODEL,
    MODES,
    ORDER,
    RINGS,
    SIZE,
    STEP,
    TOLERANCE,
)
from seatfem.study.planning.plan import Choice
from seatfem.study.planning.sensitivity import Changes
from seatfem.study.scene import Scene, method_of

COUPLED: Final = "the seat is no sum of oscillators (its damping couples the modes, or it is stepped): step weights"


def choices_of(decision: Decision, scene: Scene, kept: str) -> tuple[Choice, ...]:
    """Every key of the filled ``scene`` that matters; ``kept``: where its seat is already."""
    found: list[Choice] = []
    for key, reason in _REASONS.items():
        if not has_key(scene, key) or (value := value_of(scene, key)) is None:
            continue
        if key in _OF_THE_MESH and decision.level == "rod":
            continue
        if key == RINGS and decision.seat.rings is None:
            continue
        found.append(_choice(decision, scene, key, value, reason(decision, scene)))
    if kept:
        found.insert(1, Choice("seat", "computed before", f"{kept}, at least as fine: costs nothing", False))
    window = decision.seen.sensitivity.bench.window
    words = f"{window.groups} contacts" if window.touches else "no contact"
    found.append(_history(decision, scene))
    found.append(Choice("run.duration", _time(scene.run.duration), f"{words} at a first look", True))
    found.append(Choice("accuracy.target", _percent(scene.accuracy.target), _asked(scene), _told_target(scene)))
    return tuple(found)


def described(key: str, value: Any) -> str:
    """A key's value with its unit."""
    return _UNITS.get(key, str)(value)


def _history(decision: Decision, scene: Scene) -> Choice:
    """How the past is remembered, and over how many steps: what the run's own choice of an engine says of it."""
    dt = decision.contact.dt
    count = scene.run.duration / dt
    steps, known = f"{_count(count)} steps", _poles(decision, scene, dt, count)
    if known is None:
        return Choice("history", "chosen once the seat is known", f"{steps}; poles for a sum of oscillators", False)
    poles, why = known
    modes = max(1, round(decision.contact.n_modes or 1))
    plan = engines.choose([_stand_in(modes), _stand_in(poles)], 1, max(1, round(count)))
    if poles is None:
        value = "direct sum" if plan.block >= round(count) else "FFT"
        return Choice("history", value, f"{steps}; {why}", False)
    exact = "both bodies are sums of poles: "
    marched = "an exact recursion" if all(plan.by_poles) else f"step weights of {_count(poles)} poles are faster here"
    return Choice("history", "poles", f"{steps}; {exact}{marched}", False)


def _poles(decision: Decision, scene: Scene, dt: float, steps: float) -> tuple[int | None, str] | None:
    """(poles that the seat marches, or ``None`` and why it has step weights); ``None`` before it can be known."""
    if decision.level not in ("rod", "closed form"):
        return (None, COUPLED) if scene.seat.is_convolved else (round(_seat_poles(decision, scene)), "")
    seen = decision.seen.surrogate
    greens = scene.seat.rod() or (seen.greens if seen.exact else None)
    if greens is None:
        return (None, COUPLED) if scene.seat.is_convolved else None
    return greens.marched_poles(dt, steps), "the seat has step weights"


def _seat_poles(decision: Decision, scene: Scene) -> float:
    """Of the finite elements, as far as they are known."""
    model = _model(decision, scene)
    return 0.0 if model is None else model.poles


def _model(decision: Decision, scene: Scene) -> SeatModel | None:
    """The finite elements that are reduced, where their number is known."""
    if decision.level not in DISCRETE:
        return None
    return seat_model(scene.seat, replace(method_of(scene), level=decision.level), scene.run.duration)


def _stand_in(poles: int | None) -> StepKernel:
    """What the choice of an engine looks at: the number of poles, or that there are step weights."""
    if poles is None:
        return StepKernel(None, np.zeros((1, 1, 1)), "step weights")
    zeros = np.zeros(poles)
    return StepKernel(ModalGreens(zeros, zeros, np.zeros((poles, 1)), Residual.none()), None, "poles")


def _choice(decision: Decision, scene: Scene, key: str, value: Any, reason: str) -> Choice:
    return Choice(key, described(key, value), reason, is_given(decision.seen.scene, key))


def _of(decision: Decision, key: str) -> Changes:
    """Of the measures asked for."""
    left = decision.changes.get(key, {})
    return {name: left[name] for name in decision.seen.scene.accuracy.measures if name in left}


def _most(changes: Changes) -> str:
    """The measure that changes most, and by how much."""
    if not changes:
        return "no measure"
    name = max(changes, key=lambda measure: changes[measure])
    return f"{name} by {_percent(changes[name])}"


def _level(decision: Decision, scene: Scene) -> str:
    return decision.seat.why


def _band(decision: Decision, scene: Scene) -> str:
    if decision.level == "spring":
        return "no waves are asked for"
    return f"the highest modes of the reduction, and all above them, change {_most(_of(decision, BAND))}"


def _tolerance(decision: Decision, scene: Scene) -> str:
    return f"that much of g changes {_most(_of(decision, TOLERANCE))}"


def _method(decision: Decision, scene: Scene) -> str:
    if decision.level == "spring":
        return "one factorization, one static solution"
    if (model := _model(decision, scene)) is None:
        return "chosen once the matrices are known"
    n, method = model.sizes.counts.dof, method_of(scene).reduction
    if method not in ("auto", "krylov"):
        return f"about {_count(n)} unknowns"
    if method == "auto" and n <= ALL_MODES:
        return f"about {_count(n)} unknowns: all modes"
    each = f" in each of {model.runs:.0f} harmonics" if model.runs > 1 else ""
    return f"about {_count(n)} unknowns, {model.vectors:.0f} Krylov vectors{each} (Lanczos where the mass is diagonal)"


def _size(decision: Decision, scene: Scene) -> str:
    patch = decision.seen.patch
    assert patch is not None
    assert decision.seat.fineness is not None
    sizes = Sizes(value_of(scene, SIZE), value_of(scene, CONTACT_SIZE))
    waves = per_wavelength(patch, decision.seat.fineness.band, sizes)
    return f"shear wavelength over size {waves:.2g}; the mesh changes {_most(_of(decision, SIZE))}"


def _contact_size(decision: Decision, scene: Scene) -> str:
    patch = decision.seen.patch
    assert patch is not None
    across = patch.width / value_of(scene, CONTACT_SIZE)
    return f"{across:.2g} elements across the struck {1e3 * patch.width:.3g} mm"


def _order(decision: Decision, scene: Scene) -> str:
    if value_of(scene, ORDER) == 1:
        return "straight, and too stiff: order 2 is the cheaper for one percent and less"
    return "curved, and the cheaper for one percent and less"


def _rings(decision: Decision, scene: Scene) -> str:
    left = _of(decision, RINGS)
    if value_of(scene, RINGS) > 1:
        most = max(left, key=lambda name: left[name], default="")
        alone = decision.seen.of_rings(1).get(most, 0.0)
        return (
            f"of {_percent(alone)} of {most} by a patch that moves as its mean, {_percent(left.get(most, 0.0))} is left"
        )
    if not any(left.values()):
        return "the struck end stays plane"
    return f"a patch that moves as its mean changes {_most(left)}"


def _modes(decision: Decision, scene: Scene) -> str:
    many = f", or {MANY}" if value_of(scene, MODES) < FEW else ""
    return f"{FEWER:g} times fewer, or half of half as many{many}, change {_most(_of(decision, MODES))}"


def _step(decision: Decision, scene: Scene) -> str:
    others = "longer and much shorter" if is_given(decision.seen.scene, STEP) else "longer"
    return f"against {others} ones, it changes {_most(_of(decision, STEP))}"


def _asked(scene: Scene) -> str:
    return f"of {', '.join(scene.accuracy.measures)}"


def _told_target(scene: Scene) -> bool:
    return bool({"target", "level"} & scene.accuracy.model_fields_set)


def _count(value: float) -> str:
    """Two digits and the thousands apart."""
    return f"{float(f'{value:.2g}'):,.0f}"


def _percent(value: float) -> str:
    return f"{100 * value:.2g} %"


def _time(value: float) -> str:
    for unit, scale in (("s", 1.0), ("ms", 1e3), ("us", 1e6)):
        if value * scale >= 1:
            return f"{value * scale:.3g} {unit}"
    return f"{1e9 * value:.3g} ns"


def _length(value: float) -> str:
    return f"{1e3 * value:.3g} mm" if value >= 1e-4 else f"{1e6 * value:.3g} um"


def _frequency(value: float) -> str:
    return f"{value / 1e6:.3g} MHz" if value >= 1e6 else f"{value / 1e3:.3g} kHz"


Reason = Callable[[Decision, Scene], str]
_REASONS: Final[Mapping[str, Reason]] = {
    MODEL: _level,
    BAND: _band,
    TOLERANCE: _tolerance,
    METHOD: _method,
    SIZE: _size,
    CONTACT_SIZE: _contact_size,
    ORDER: _order,
    MODES: _modes,
    STEP: _step,
    RINGS: _rings,
}
_OF_THE_MESH: Final = (BAND, TOLERANCE, METHOD, SIZE, CONTACT_SIZE, ORDER)
_UNITS: Final[Mapping[str, Callable[[Any], str]]] = {
    BAND: _frequency,
    TOLERANCE: _percent,
    SIZE: _length,
    CONTACT_SIZE: _length,
    STEP: _time,
}
