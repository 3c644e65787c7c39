"""A decision in words: every key, its value, and the reason with its number."""

from collections.abc import Callable, Mapping
from typing import Final

import numpy as np

from impact.greens import base, modal
from impact.march import history
from impact.quantities import percent
from seatfem.structures.estimates.costs import ALL_MODES
from seatfem.structures.estimates.surrogate import Sizes, per_wavelength
from seatfem.structures.method import BEYOND, Solver
from seatfem.structures.rings import arc_rings_to_compare
from seatfem.study.impacts.validity import BEAM, ONE_PORT
from seatfem.study.ladders.ladder import large_percent
from seatfem.study.ladders.table import described
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
from seatfem.study.planning.costs import closed_form, striker_poles
from seatfem.study.planning.deciding import Decision
from seatfem.study.planning.plan import Choice
from seatfem.study.prerun import lips, sensitivity
from seatfem.study.safety import FEW, FEWER, LIP_SHARE, MANY
from seatfem.study.scene import Accuracy
from seatfem.study.scene.measures import short_words
from seatfem.units import write_quantity

OF_SOLVERS: Final[Mapping[Solver, str]] = {
    "double": "",
    "single": " of factors in single precision, projected in double",
    "two grids": " by conjugate gradients on two grids, projected in double",
}
WORDS: Final = {ONE_PORT: "a single contact point", BEAM: "a beam model of the reed"}
COUPLED: Final = (
    "general method, because the seat has no uncoupled modes: its damping couples them, or it was computed step by step"
)


def choices_of(decision: Decision, method: RunMethod, at_hand: str) -> tuple[Choice, ...]:
    """Return the choices of keys that matter, with values of ``method``; ``at_hand``: place of a reused seat, or ""."""
    choices: list[Choice] = []
    scene, of_the_mesh = decision.context.scene, decision.level != "rod"
    for key, reason in _REASONS.items():
        if not has_key(scene, key) or (value := method.value(key)) is None:
            continue
        irrelevant = key in _WHERE_FELT and not any(each in decision.changes for each in _WHERE_FELT[key])
        if (key in _OF_THE_MESH and not of_the_mesh) or irrelevant:
            continue
        errors = _of(decision, key)
        choices.append(
            Choice(key, described(key, value), reason(decision, method), is_given(scene, key), _most(errors))
        )
    plate = scene.reed.thin_plate
    if ONE_PORT in decision.changes and method.ports is None and plate is not None:
        why = "one contact in place of lip segments; error by segments on a half-space"
        stated = write_quantity(plate.radius, "length")
        key, value = ("reed.contact_radius", stated) if plate.states_contact else (PORTS, "1")
        choices.append(Choice(key, value, why, plate.states_contact, _most(_of(decision, ONE_PORT))))
    if at_hand:
        choices.insert(1, Choice("seat", "computed before", f"{at_hand}, at least as fine: no computing time", False))
    window = decision.context.sensitivity.bench.window
    number = f"{window.groups} contact{'s'[: window.groups != 1]}" if window.touches else "no contact"
    choices.append(_history(decision, method))
    choices.append(Choice("run.duration", described(STEP, scene.run.duration), f"a quick trial run saw {number}", True))
    accuracy = scene.accuracy
    choices.append(Choice("accuracy.target", large_percent(accuracy.target), _asked(accuracy), _told_target(accuracy)))
    return tuple(choices)


def _history(decision: Decision, method: RunMethod) -> Choice:
    """Return the choice of the history engine (modal recursion, FFT or direct sum), predicted as the run makes it."""
    dt = decision.contact.method.time_step or 0.0
    count = decision.context.scene.run.duration / dt
    steps, known = f"{_count(count)} steps", _poles(decision, method, dt, count)
    if known is None:
        why = f"{steps}; modal recursion if the seat has uncoupled modes"
        return Choice("history", "chosen once the seat is known", why, False)
    poles, why = known
    known_reed = decision.context.sensitivity.bench.striker
    scene = decision.context.scene
    marched_by_reed = striker_poles(scene.reed, method.reed, dt, scene.run.duration, known_reed)
    reed = None if marched_by_reed is None else max(1, round(marched_by_reed))
    plan = history.choose([_stand_in(reed), _stand_in(poles)], 1, max(1, round(count)))
    if poles is not None and reed is None:
        poles, why = None, "general method, because the reed has no uncoupled modes"
    if poles is None:
        value = "direct sum" if plan.block >= round(count) else "FFT"
        return Choice("history", value, f"{steps}; {why}", False)
    if all(plan.by_poles):
        return Choice("history", "poles", f"{steps}; fast method: modal recursion", False)
    return Choice(
        "history", "poles", f"{steps}; convolution is faster here than recursion over {_count(poles)} modes", False
    )


def _poles(decision: Decision, method: RunMethod, dt: float, steps: float) -> tuple[int | None, str] | None:
    """Return the number of poles of the seat, or ``None`` and why it has step weights; only ``None`` if unknown yet."""
    scene, surrogate = decision.context.scene, decision.context.surrogate
    convolved = scene.seat.is_convolved
    if decision.level not in ("rod", "closed form"):
        elements = None if decision.level == "spring" else decision.context.elements_of(method.seat)[0]
        return (None, COUPLED) if convolved else (round(0.0 if elements is None else elements.poles), "")
    form = closed_form(scene.seat, method.seat) if decision.level == "rod" else None
    greens = surrogate.greens if surrogate.exact else form
    if greens is None:
        return (None, COUPLED) if convolved else None
    return greens.marched_poles(dt, steps), "general method, because the seat has no uncoupled modes"


def _stand_in(poles: int | None) -> base.StepKernel:
    """Return a kernel with this number of poles, or with step weights, for `history.choose`."""
    if poles is None:
        return base.StepKernel(None, np.zeros((1, 1, 1)), "step weights")
    zeros = np.zeros(poles)
    return base.StepKernel(modal.ModalGreens(zeros, zeros, np.zeros((poles, 1)), modal.Residual.none()), None, "poles")


def _of(decision: Decision, key: str) -> sensitivity.Changes:
    """Return the relative errors of the judged measures by a key."""
    errors = decision.changes.get(key, {})
    return {name: errors[name] for name in decision.context.scene.accuracy.judged if name in errors}


def _most(changes: sensitivity.Changes) -> str:
    """Return the largest change and its measure in words; "" if none is known."""
    if not changes:
        return ""
    name = max(changes, key=lambda measure: changes[measure])
    return f"{large_percent(changes[name])} of {_spoken(name)}"


def _spoken(name: str) -> str:
    """Return a measure in words, without its landing."""
    return short_words(name)


def _level(decision: Decision, method: RunMethod) -> str:
    return decision.seat.why


def _band(decision: Decision, method: RunMethod) -> str:
    if decision.level == "spring":
        return "not used: the seat is static"
    return "highest frequency of the seat's response that is kept"


def _tolerance(decision: Decision, method: RunMethod) -> str:
    return "error allowed in the seat's response"


def _reduction(decision: Decision, method: RunMethod) -> str:
    if decision.level == "spring":
        return "one static solution" + (" for each segment of the lip" if method.seat.in_arcs else "")
    model, _ = decision.context.elements_of(method.seat)
    if model is None:
        return "chosen once the matrices are known"
    n = model.sizes.counts.dof
    if model.kept is not None and method.ports is not None:
        modes = model.kept - len(method.seat.division.names)
        kept = f"{modes:.0f} modes up to {BEYOND:g} times the bandwidth"
        return f"about {_count(n)} unknowns, {kept}, one static solution per segment"
    if method.seat.reduction not in ("auto", "krylov"):
        return f"about {_count(n)} unknowns"
    if method.seat.reduction == "auto" and n <= ALL_MODES:
        return f"about {_count(n)} unknowns: all modes"
    each = f" in each of {model.runs:.0f} harmonics" if model.runs > 1 else ""
    return f"about {_count(n)} unknowns, {model.vectors:.0f} Krylov vectors{each}{OF_SOLVERS[model.solver]}"


def _size(decision: Decision, method: RunMethod) -> str:
    patch = decision.context.patch
    assert patch is not None
    sizes = Sizes(method.value(SIZE), method.value(CONTACT_SIZE))
    waves = per_wavelength(patch, decision.seat.seat.bandwidth or 0.0, sizes)
    return f"{waves:.2g} elements per shortest shear wavelength"


def _contact_size(decision: Decision, method: RunMethod) -> str:
    patch = decision.context.patch
    assert patch is not None
    across = patch.width / method.value(CONTACT_SIZE)
    enough = f"mesh {write_quantity(method.value(CONTACT_SIZE), 'length', 3)}: {across:.2g} elements across"
    return f"contact face {write_quantity(patch.width, 'length', 3)} wide, {enough}"


def _order(decision: Decision, method: RunMethod) -> str:
    if method.seat.order == 1:
        return "linear elements, which are too stiff: for errors of 1 % or less order 2 is cheaper"
    return "quadratic elements"


def _rings(decision: Decision, method: RunMethod) -> str:
    errors = _of(decision, RINGS)
    if method.seat.in_arcs:
        return f"parts across the lip width; error estimated with {arc_rings_to_compare(method.seat.rings or 1)[0]}"
    if (method.seat.rings or 1) > 1:
        most = max(errors, key=lambda name: errors[name], default="")
        alone = decision.context.of_rings(1).get(most, 0.0)
        return f"parts of the contact face; treated as one (mean displacement) it would cost {large_percent(alone)}"
    if not any(errors.values()):
        return "the struck end face stays plane"
    return "contact face treated as one (mean displacement)"


def _ports(decision: Decision, method: RunMethod) -> str:
    if decision.context.one_port is not None and PORTS not in decision.context.stated.given:
        change = {name: decision.context.simpler[ONE_PORT][name] for name in decision.context.scene.accuracy.judged}
        within = f"within {percent(LIP_SHARE)} of the target, margins included"
        return f"a single contact point instead of lip segments: {_most(change)}, {within}"
    why = lips.several_needed(decision.context.scene)
    against = f" ({why})" if why and not is_given(decision.context.scene, PORTS) else ""
    return f"segments of the lip; error estimated with twice as many{_simpler(decision, ONE_PORT)}{against}"


def _reed_band(decision: Decision, method: RunMethod) -> str:
    return (
        f"modes of the reed up to this frequency; error estimated by leaving out the highest{_simpler(decision, BEAM)}"
    )


def _simpler(decision: Decision, model: str) -> str:
    """Return in words the largest change of a judged measure by a simpler model of the striker; "" if unknown."""
    changes = decision.context.simpler.get(model, {})
    judged = {name: changes[name] for name in decision.context.scene.accuracy.judged if name in changes}
    return f"; {WORDS[model]} would be off by {_most(judged)}" if judged else ""


def _modes(decision: Decision, method: RunMethod) -> str:
    return _number_of_modes(method.value(MODES), "reed")


def _seat_modes(decision: Decision, method: RunMethod) -> str:
    return _number_of_modes(method.value(SEAT_MODES), "seat")


def _number_of_modes(number: int, body: str) -> str:
    many = f" and {MANY}" if number < FEW else ""
    return f"modes of the {body}; error estimated with {FEWER:g} times fewer{many}"


def _step(decision: Decision, method: RunMethod) -> str:
    others = "longer and much shorter" if is_given(decision.context.scene, STEP) else "longer"
    return f"error estimated with {others} steps"


def _asked(accuracy: Accuracy) -> str:
    landing = "" if accuracy.landing == "run" else f" of the {accuracy.landing} landing"
    return f"of {' and '.join(map(_spoken, accuracy.measures))}{landing}"


def _told_target(accuracy: Accuracy) -> bool:
    return bool({"target", "level"} & accuracy.model_fields_set)


def _count(value: float) -> str:
    """Return a number rounded to two digits, with separators of thousands."""
    return f"{float(f'{value:.2g}'):,.0f}"


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
"""Keys that are listed only if the decision has an error by one of these."""
_OF_THE_MESH: Final = (BAND, TOLERANCE, REDUCTION, SIZE, CONTACT_SIZE, ORDER)
