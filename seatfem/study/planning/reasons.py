"""A decision in words: every key, its value, and the reason with its number."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, Final

import numpy as np

from impact.greens.base import StepKernel
from impact.greens.modal import ModalGreens, Residual
from impact.march import engines
from impact.quantities import percent
from impact.runs.variations import NARROWER
from seatfem.structures.estimates.costs import ALL_MODES
from seatfem.structures.estimates.mesh_size import Sizes, per_wavelength
from seatfem.structures.method import BEYOND
from seatfem.structures.rings import across_behind
from seatfem.study.accuracy.sensitivity import Changes
from seatfem.study.impacts.simpler import BEAM, ONE_PORT
from seatfem.study.method import (
    BAND,
    CONTACT_SIZE,
    MODEL,
    MODES,
    ORDER,
    PORTS,
    REDUCTION,
    REED_BAND,
    RINGS,
    SEAT_MODES,
    SIZE,
    STEP,
    TOLERANCE,
    RunMethod,
    has_key,
    is_given,
)
from seatfem.study.planning.costs import closed_form, finite_elements, striker_poles
from seatfem.study.planning.deciding import Decision
from seatfem.study.planning.lips import several_needed
from seatfem.study.planning.plan import Choice
from seatfem.study.safety import FEW, FEWER, LIP_SHARE, MANY
from seatfem.study.scene import Scene
from seatfem.study.scene.measures import asked_name

WORDS: Final = {ONE_PORT: "one port", BEAM: "a beam"}
COUPLED: Final = "the seat is no sum of oscillators (its damping couples the modes, or it is stepped): step weights"


def choices_of(decision: Decision, method: RunMethod, at_hand: str) -> tuple[Choice, ...]:
    """Every key that matters, as ``method`` has it; ``at_hand``: where its seat is already."""
    found: list[Choice] = []
    scene, of_the_mesh = decision.seen.scene, decision.level != "rod"
    for key, reason in _REASONS.items():
        if not has_key(scene, key) or (value := method.value(key)) is None:
            continue
        unfelt = key in _WHERE_FELT and not any(each in decision.changes for each in _WHERE_FELT[key])
        if (key in _OF_THE_MESH and not of_the_mesh) or unfelt:
            continue
        found.append(Choice(key, described(key, value), reason(decision, method), is_given(scene, key)))
    if at_hand:
        found.insert(1, Choice("seat", "computed before", f"{at_hand}, at least as fine: costs nothing", False))
    window = decision.seen.sensitivity.bench.window
    words = f"{window.groups} contacts" if window.touches else "no contact"
    found.append(_history(decision, method))
    found.append(Choice("run.duration", _time(scene.run.duration), f"{words} at a first look", True))
    found.append(Choice("accuracy.target", _percent(scene.accuracy.target), _asked(scene), _told_target(scene)))
    return tuple(found)


def described(key: str, value: Any) -> str:
    """A key's value with its unit."""
    return _UNITS.get(key, str)(value)


def _history(decision: Decision, method: RunMethod) -> Choice:
    """How the past is remembered, and over how many steps: what the run's own choice of an engine says of it."""
    dt = decision.contact.dt
    count = decision.seen.scene.run.duration / dt
    steps, known = f"{_count(count)} steps", _poles(decision, method, dt, count)
    if known is None:
        return Choice("history", "chosen once the seat is known", f"{steps}; poles for a sum of oscillators", False)
    poles, why = known
    known_reed = decision.seen.sensitivity.bench.striker
    marched_by_reed = striker_poles(decision.seen.scene, method, dt, count, known_reed)
    reed = None if marched_by_reed is None else max(1, round(marched_by_reed))
    plan = engines.choose([_stand_in(reed), _stand_in(poles)], 1, max(1, round(count)))
    if poles is not None and reed is None:
        poles, why = None, "the striker has step weights"
    if poles is None:
        value = "direct sum" if plan.block >= round(count) else "FFT"
        return Choice("history", value, f"{steps}; {why}", False)
    exact = "both bodies are sums of poles: "
    marched = "an exact recursion" if all(plan.by_poles) else f"step weights of {_count(poles)} poles are faster here"
    return Choice("history", "poles", f"{steps}; {exact}{marched}", False)


def _poles(decision: Decision, method: RunMethod, dt: float, steps: float) -> tuple[int | None, str] | None:
    """(poles that the seat marches, or ``None`` and why it has step weights); ``None`` before it can be known."""
    scene, surrogate = decision.seen.scene, decision.seen.surrogate
    convolved = scene.seat.is_convolved
    if decision.level not in ("rod", "closed form"):
        elements = None if decision.level == "spring" else finite_elements(scene, method)
        return (None, COUPLED) if convolved else (round(0.0 if elements is None else elements.poles), "")
    greens = surrogate.greens if surrogate.exact else closed_form(scene, method) if decision.level == "rod" else None
    if greens is None:
        return (None, COUPLED) if convolved else None
    return greens.marched_poles(dt, steps), "the seat has step weights"


def _stand_in(poles: int | None) -> StepKernel:
    """What the choice of an engine looks at: the number of poles, or that there are step weights."""
    if poles is None:
        return StepKernel(None, np.zeros((1, 1, 1)), "step weights")
    zeros = np.zeros(poles)
    return StepKernel(ModalGreens(zeros, zeros, np.zeros((poles, 1)), Residual.none()), None, "poles")


def _of(decision: Decision, key: str) -> Changes:
    """Of the measures asked for."""
    left = decision.changes.get(key, {})
    return {name: left[name] for name in decision.seen.scene.accuracy.judged if name in left}


def _most(changes: Changes) -> str:
    """The measure that changes most, and by how much."""
    if not changes:
        return "no measure"
    name = max(changes, key=lambda measure: changes[measure])
    return f"{asked_name(name)} by {_percent(changes[name])}"


def _level(decision: Decision, method: RunMethod) -> str:
    return decision.seat.why


def _band(decision: Decision, method: RunMethod) -> str:
    if decision.level == "spring":
        return "no waves are asked for"
    return f"the highest modes of the reduction, and all above them, change {_most(_of(decision, BAND))}"


def _tolerance(decision: Decision, method: RunMethod) -> str:
    return f"that much of g changes {_most(_of(decision, TOLERANCE))}"


def _reduction(decision: Decision, method: RunMethod) -> str:
    if decision.level == "spring":
        return "one factorization, " + ("statics of each arc" if method.seat.in_arcs else "one static solution")
    model = finite_elements(decision.seen.scene, method)
    if model is None:
        return "chosen once the matrices are known"
    n = model.sizes.counts.dof
    if model.kept is not None and method.ports is not None:
        modes = model.kept - len(method.seat.division.names)
        return f"about {_count(n)} unknowns, {modes:.0f} modes up to {BEYOND:g} times the band, statics of each arc"
    if method.seat.reduction not in ("auto", "krylov"):
        return f"about {_count(n)} unknowns"
    if method.seat.reduction == "auto" and n <= ALL_MODES:
        return f"about {_count(n)} unknowns: all modes"
    each = f" in each of {model.runs:.0f} harmonics" if model.runs > 1 else ""
    return f"about {_count(n)} unknowns, {model.vectors:.0f} Krylov vectors{each} (Lanczos where the mass is diagonal)"


def _size(decision: Decision, method: RunMethod) -> str:
    patch = decision.seen.patch
    assert patch is not None
    sizes = Sizes(method.value(SIZE), method.value(CONTACT_SIZE))
    waves = per_wavelength(patch, decision.seat.method.bandwidth or 0.0, sizes)
    return f"shear wavelength over size {waves:.2g}; the mesh changes {_most(_of(decision, SIZE))}"


def _contact_size(decision: Decision, method: RunMethod) -> str:
    patch = decision.seen.patch
    assert patch is not None
    across = patch.width / method.value(CONTACT_SIZE)
    return f"{across:.2g} elements across the struck {1e3 * patch.width:.3g} mm"


def _order(decision: Decision, method: RunMethod) -> str:
    if method.seat.order == 1:
        return "straight, and too stiff: order 2 is the cheaper for one percent and less"
    return "curved, and the cheaper for one percent and less"


def _rings(decision: Decision, method: RunMethod) -> str:
    left = _of(decision, RINGS)
    if method.seat.in_arcs:
        return f"parts across the lip: {across_behind(method.seat.rings or 1)[0]} of them change {_most(left)}"
    if (method.seat.rings or 1) > 1:
        most = max(left, key=lambda name: left[name], default="")
        alone = decision.seen.of_rings(1).get(most, 0.0)
        return (
            f"of {_percent(alone)} of {asked_name(most)} by a patch that moves as its mean, "
            f"{_percent(left.get(most, 0.0))} is left"
        )
    if not any(left.values()):
        return "the struck end stays plane"
    return f"a patch that moves as its mean changes {_most(left)}"


def _ports(decision: Decision, method: RunMethod) -> str:
    if decision.seen.one_port is not None:
        change = {name: decision.seen.simpler[ONE_PORT][name] for name in decision.seen.scene.accuracy.judged}
        within = f"within {percent(LIP_SHARE)} of the target, margins included"
        return f"in place of arcs of the lip, it changes {_most(change)}: {within}"
    why = several_needed(decision.seen.scene)
    against = f" ({why})" if why and not is_given(decision.seen.scene, PORTS) else ""
    return f"twice as many arcs of the lip change {_most(_of(decision, PORTS))}{_simpler(decision, ONE_PORT)}{against}"


def _reed_band(decision: Decision, method: RunMethod) -> str:
    highest = _most(_of(decision, REED_BAND))
    return f"the plate's highest modes, to 1/{NARROWER:g} of the last, change {highest}{_simpler(decision, BEAM)}"


def _simpler(decision: Decision, model: str) -> str:
    """What a simpler model of the striker would change in what is asked for."""
    there = decision.seen.simpler.get(model, {})
    asked = {name: there[name] for name in decision.seen.scene.accuracy.judged if name in there}
    return f"; {WORDS[model]} in place, {_most(asked)}" if asked else ""


def _modes(decision: Decision, method: RunMethod) -> str:
    many = f", or {MANY}" if method.value(MODES) < FEW else ""
    return f"{FEWER:g} times fewer, or half of half as many{many}, change {_most(_of(decision, MODES))}"


def _seat_modes(decision: Decision, method: RunMethod) -> str:
    many = f", or {MANY}" if method.value(SEAT_MODES) < FEW else ""
    return f"{FEWER:g} times fewer, or half of half as many{many}, change {_most(_of(decision, SEAT_MODES))}"


def _step(decision: Decision, method: RunMethod) -> str:
    others = "longer and much shorter" if is_given(decision.seen.scene, STEP) else "longer"
    return f"against {others} ones, it changes {_most(_of(decision, STEP))}"


def _asked(scene: Scene) -> str:
    accuracy = scene.accuracy
    landing = "" if accuracy.landing == "run" else f" of the {accuracy.landing} landing"
    return f"of {', '.join(accuracy.measures)}{landing}"


def _told_target(scene: Scene) -> bool:
    return bool({"target", "level"} & scene.accuracy.model_fields_set)


def _count(value: float) -> str:
    """Two digits and the thousands apart."""
    return f"{float(f'{value:.2g}'):,.0f}"


def _percent(value: float) -> str:
    return percent(value) if value < 1 else f"{100 * value:,.0f} %"


def _time(value: float) -> str:
    for unit, scale in (("s", 1.0), ("ms", 1e3), ("us", 1e6)):
        if value * scale >= 1:
            return f"{value * scale:.3g} {unit}"
    return f"{1e9 * value:.3g} ns"


def _length(value: float) -> str:
    return f"{1e3 * value:.3g} mm" if value >= 1e-4 else f"{1e6 * value:.3g} um"


def _frequency(value: float) -> str:
    return f"{value / 1e6:.3g} MHz" if value >= 1e6 else f"{value / 1e3:.3g} kHz"


Reason = Callable[[Decision, RunMethod], str]
_REASONS: Final[Mapping[str, Reason]] = {
    MODEL: _level,
    BAND: _band,
    TOLERANCE: _tolerance,
    REDUCTION: _reduction,
    SIZE: _size,
    CONTACT_SIZE: _contact_size,
    ORDER: _order,
    SEAT_MODES: _seat_modes,
    MODES: _modes,
    STEP: _step,
    RINGS: _rings,
    PORTS: _ports,
    REED_BAND: _reed_band,
}
_WHERE_FELT: Final = {RINGS: (RINGS,), PORTS: (PORTS, ONE_PORT), REED_BAND: (REED_BAND,)}
"""Keys that are told where these are among what a decision leaves."""
_OF_THE_MESH: Final = (BAND, TOLERANCE, REDUCTION, SIZE, CONTACT_SIZE, ORDER)
_UNITS: Final[Mapping[str, Callable[[Any], str]]] = {
    BAND: _frequency,
    REED_BAND: _frequency,
    TOLERANCE: _percent,
    SIZE: _length,
    CONTACT_SIZE: _length,
    STEP: _time,
}
