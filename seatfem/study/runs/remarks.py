"""What a reader of a run must know beside its numbers: assumptions, limits of the theory, advice, bars not known."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

from seatfem.study.impacts.validity import stopper_notes, validity_advice
from seatfem.study.method import MODES, STEP
from seatfem.study.runs.round import Round
from seatfem.study.scene.measures import key_of

NARROWER: Final = "a narrower seat.greens.bandwidth"
OF_EITHER: Final = "a narrower band (or fewer modes) of the seat, or of the stopper where that is the one"


def remarks(done: Round) -> tuple[str, ...]:
    """In sentences, the most general first."""
    limits = map(str, validity_advice(done.plan.scene, done.seat.greens, done.striker.greens))
    return (*_assumed_reed(done), *limits, *_advice(done), *stopper_notes(done.plan.scene), *_no_bar(done))


def _assumed_reed(done: Round) -> tuple[str, ...]:
    """What of the reed was not given and taken from the paper's, with its value."""
    assumed = done.plan.scene.reed.assumed()
    return (f"not given, taken from the paper's reed: {', '.join(assumed)}",) if assumed else ()


def _advice(done: Round) -> tuple[str, ...]:
    """Of the run, in keys of the scene; about a step that was chosen, and whose error is within the target, none."""
    measured = done.met and not done.plan.is_given(STEP)
    narrower, told = NARROWER if done.plan.scene.stopper is None else OF_EITHER, []
    for advice in done.result.advice:
        of_the_step = "dt <=" in advice.remedy
        if not (measured and of_the_step):
            keys = {"dt <=": f"{STEP} <=", "fewer modes": f"fewer {MODES}" if "striker" in advice.name else narrower}
            remedy = advice.remedy
            for word, key in keys.items():
                remedy = remedy.replace(word, key)
            told.append(str(replace(advice, remedy=remedy)))
    return tuple(told)


def _no_bar(done: Round) -> tuple[str, ...]:
    if not done.without_bar:
        return ()
    keys, names = (", ".join(words) for words in ([key_of(n) for n in done.without_bar], done.without_bar))
    return (
        f"{keys} has no error bar: the plan took the seat for a spring, which serves the measures asked for, and what "
        f"that leaves out of others is not known; add {names} to accuracy.measures",
    )
