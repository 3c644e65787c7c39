"""A note on contacts of few steps: only where the step's own error is not measured, or above the target."""

from types import SimpleNamespace
from typing import Any

import pytest

from impact.after.regime import UNRESOLVED
from impact.notices import Advice
from impact.runs.variations import SAFETY, Budget
from seatfem.study.runs import round as rounds

CONTACTS = Advice(UNRESOLVED, 0.26, 0.1, "the step does not resolve them", "use dt <= 3.5e-09 s")
TARGET = 0.05


def notes(by_step: float | None, *, judged: tuple[str, ...] = ("peak",)) -> tuple[str, ...]:
    """Return the notes of a round whose 64 N err by ``by_step`` [N] by the step, and miss the target by the model."""
    parts = {} if by_step is None else {"time_step": {"peak": by_step}}
    plan = SimpleNamespace(
        scene=SimpleNamespace(accuracy=SimpleNamespace(target=TARGET), stopper=None),
        method=SimpleNamespace(reed=SimpleNamespace(n_modes=None)),
        is_given=lambda key: False,
    )
    budget = Budget({"peak": 64.0}, {**parts, "model": {"peak": 20.0}})
    done: Any = SimpleNamespace(
        plan=plan, left=budget, judged=judged, met=False, result=SimpleNamespace(advice=(CONTACTS,))
    )
    return rounds._advice(done)


def test_a_measured_small_error_of_the_step_silences_the_note() -> None:
    """The force was 63.8 N, and 63.9 N at half the step."""
    assert notes(0.1) == ()


@pytest.mark.parametrize("by_step", [None, 1.01 * TARGET * 64 / SAFETY])
def test_an_unknown_or_large_one_does_not(by_step: float | None) -> None:
    (note,) = notes(by_step)
    assert UNRESOLVED in note
    assert "use run.time_step <= 3.5 ns" in note
    (unjudged,) = notes(0.1, judged=())
    assert UNRESOLVED in unjudged
