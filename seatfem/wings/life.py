"""[life] of a scene: fatigue of the bodies after a run, its results in words, and its margin as a measure."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, ClassVar, Final

from impact.quantities import in_digits, percent
from seatfem.fields import Contradictions, Table
from seatfem.life import lives
from seatfem.life.table import LifeTable, StrengthTable
from seatfem.readings import BAR, Summary, as_number, is_known
from seatfem.results import Result
from seatfem.study.scene.measures import ContactRecord, Measure, Stress
from seatfem.study.scene.models import Scene
from seatfem.study.scene.wings import Assessed, Assessment

if TYPE_CHECKING:
    from seatfem.study.runs.afterwards import FinishedRun


OF_SPEED: Final = ("margin", "m_per_s", "limit_m_per_s")
"""Suffixes of the keys life_speed_... that the sentence on the closing speed needs."""


class Life(LifeTable, Assessment):
    """Fatigue of the reed under its bending stress, and of the seat's surface (`seat_strength`). Stress tensors, of
    plates and finite elements, are evaluated on their critical planes. One run is one block of stress that repeats:
    from its end the stress returns to its start, so an initial deflection, such as a release, repeats with every block.
    If loads repeat with the crank, `block = "last cycle"` uses only the last turn, without the transient at the start.
    summary.json has life_margin, the factor on all stresses at which the damage over the design life is 1; life_cycles,
    blocks to failure; life_damage_per_cycle; life_at, the body and the place; and life_speed_margin, allowed over
    largest closing speed. Theory: [life.md](life.md)."""

    table, description = "life", "fatigue life asked for; not computed where absent"
    file_tables: ClassVar[Mapping[str, type[Table]]] = {"strength": StrengthTable, "seat_strength": StrengthTable}
    rows = (
        Result("life_margin", "fatigue margin", "life"),
        Result("life_cycles", "cycles to failure", "life", demand="life_design_cycles"),
        Result("life_damage_per_cycle", "damage per cycle", "life"),
        Result("life_multiaxial_margin", "fatigue margin, multiaxial", "life"),
        Result("life_contact_margin", "fatigue margin, contact", "life"),
        Result("life_speed_margin", "margin on closing speed", "life"),
    )
    captions: ClassVar[Mapping[str, str]] = {"margin.png": "Margin against speed."}
    section = ("life_", "Life")
    margins: ClassVar[Mapping[str, str]] = {
        "life_margin": "",
        "life_multiaxial_margin": "",
        "life_contact_margin": "",
        "life_speed_margin": "landing_closing_speed_m_per_s",
    }
    sources = ("life_strength_source", "life_speed_source")
    basis = "life_basis"
    gaps = ("life_not_judged",)
    absent_words = (
        "No strength is stated: name a file with that of your material, and its source, as [life] strength; without it "
        "fatigue is not judged."
    )

    @classmethod
    def sentence(cls, summary: Summary) -> str:
        return life_sentence(summary)

    def check(self, scene: Scene) -> Contradictions:
        geometry, duration = scene.geometry, scene.run.duration
        yield from self.contradictions_with(geometry, scene.turn, duration, stressed=scene.stress is not None)
        if LifeMargin.name in scene.accuracy.measures and not self.needs_reed_stress:
            words = "no strength of the reed is stated: add life.strength, or remove the measure"
            yield "strength", f"{LifeMargin.name} is asked, and {words}"

    @property
    def needs_reed_stress(self) -> bool:
        return self.demand() is not None

    @property
    def needs_whole_contact(self) -> bool:
        return bool(self.contact_criterion)

    def assess(self, run: FinishedRun) -> Assessed:
        return lives.assess(self, run)


class LifeMargin(Measure):
    """Margin over the reed's design life, inversely proportional to the stress in the whole run.

    It is evaluated from stress histories after the last round; plans and rounds use `Stress` in its place.
    """

    name, key, words = "life_margin", "life_margin", "fatigue margin"
    data = ("stress",)
    judged_by = Stress.name
    needs = "life.strength"

    def is_known(self, blow: ContactRecord) -> bool:
        return False

    def evaluate(self, blow: ContactRecord) -> float:
        return math.nan


def life_sentence(summary: Summary) -> str:
    """Return the life of the reed in one line, with the source of its strength; "" if it was not requested.

    Values that the summary lacks, as one of an earlier version may, are omitted from the sentences.
    """
    sentences = []
    if LifeMargin.key in summary:
        margin, cycles = as_number(summary[LifeMargin.key]), as_number(summary.get("life_cycles"))
        design_cycles, share = (as_number(summary.get(f"life_{key}")) for key in ("design_cycles", "survival"))
        bar = as_number(summary.get(BAR + LifeMargin.key))
        body = _body_at(summary, "life_at")
        asked_for = "the cycles asked for" if design_cycles is None else f"{in_digits(design_cycles)} cycles"
        asked_for += "" if share is None else f" with {percent(share, 6)} survival"
        plus = "" if bar is None else f" +- {in_digits(bar, 2)}"
        if bar is not None and margin is not None and not is_known(LifeMargin.key, margin, bar):
            plus += " (not known)"
        if margin is None:
            sentences.append(f"no multiple of the stress uses up the life of {asked_for}")
        elif margin >= 1:
            sentences.append(f"the {body} endures {asked_for} even with {in_digits(margin)}{plus} times the stress")
        else:
            lived = "at once" if cycles is None else f"after {in_digits(cycles)} of {asked_for}"
            sentences.append(f"the {body} fails {lived}; it would endure {in_digits(margin)}{plus} of the stress")
        sentences[-1] += _in_brackets(summary, "life_at", "life_criterion", "life_strength_source")
    for name in ("multiaxial", "contact"):
        if (margin := as_number(summary.get(f"life_{name}_margin"))) is None:
            continue
        design_cycles = as_number(summary.get(f"life_{name}_cycles"))
        through = "the cycles of the two limits" if design_cycles is None else f"{in_digits(design_cycles)} cycles"
        body = name if name == "contact" else _body_at(summary, f"life_{name}_at")
        note = _in_brackets(summary, f"life_{name}_at", f"life_{name}_criterion", "life_strength_source")
        sentences.append(f"the {body} endures {through} with {in_digits(margin)} times the stress{note}")
    speed, closing, limit = (as_number(summary.get(f"life_speed_{key}")) for key in OF_SPEED)
    if speed and closing is not None and limit is not None:
        share_of_limit = f"{in_digits(1 / speed)} of the {in_digits(limit)} m/s allowed"
        note = _in_brackets(summary, "life_speed_source")
        sentences.append(f"it closes at {in_digits(closing)} m/s, {share_of_limit}{note}")
    return f"fatigue: {'; '.join(sentences)}".replace("\n", "\\n") if sentences else ""


def _body_at(summary: Summary, key: str) -> str:
    """Return the body of a place such as "reed, x = 3 mm"; "body" if the summary does not name one."""
    return str(summary.get(key) or "body").partition(",")[0]


def _in_brackets(summary: Summary, *keys: str) -> str:
    """Return the values of the keys that the summary has, in parentheses; "" if it has none."""
    stated = [str(value) for key in keys if (value := summary.get(key))]
    return f" ({'; '.join(stated)})" if stated else ""
