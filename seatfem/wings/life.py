"""[life] of a scene: fatigue of the bodies after a run, its results in words, and its margin as a measure."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, ClassVar

from seatfem.fields import Contradictions, Table
from seatfem.life import lives, words
from seatfem.life.strength import StrengthTable
from seatfem.life.table import LifeTable
from seatfem.readings import Summary
from seatfem.results import Result
from seatfem.study.scene.measures import ContactRecord, Measure, Stress
from seatfem.study.scene.models import Scene
from seatfem.study.scene.wings import Assessed, Assessment

if TYPE_CHECKING:
    from seatfem.study.runs.afterwards import FinishedRun


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
        Result("life_margin", "margin on stress", "life"),
        Result("life_cycles", "cycles to failure", "life", demand="life_design_cycles"),
        Result("life_damage_per_cycle", "damage per cycle", "life"),
        Result("life_multiaxial_margin", "margin, several axes", "life"),
        Result("life_contact_margin", "margin, contact", "life"),
        Result("life_speed_margin", "margin on speed", "life"),
    )
    captions: ClassVar[Mapping[str, str]] = {"margin.png": "Margin against speed."}
    section = ("life_", "Life")
    absent_words = "Fatigue was not judged; [life] in the scene asks for it."

    @classmethod
    def sentence(cls, summary: Summary) -> str:
        return words.life_sentence(summary)

    def check(self, scene: Scene) -> Contradictions:
        geometry, duration = scene.geometry, scene.run.duration
        yield from self.contradictions_with(geometry, scene.turn, duration, stressed=scene.stress is not None)

    @property
    def needs_reed_stress(self) -> bool:
        return self.demand() is not None

    @property
    def needs_whole_contact(self) -> bool:
        return bool(self.contact_criterion)

    def after_run(self, run: FinishedRun) -> Assessed:
        return lives.assess(self, run)


class LifeMargin(Measure):
    """Margin over the reed's design life, inversely proportional to the stress in the whole run.

    It is evaluated from stress histories after the last round; plans and rounds use `Stress` in its place.
    """

    name, key, words = "life_margin", "life_margin", "margin over the design life"
    needs_stress = True
    judged_by = Stress.name

    def problem(self, scene: Scene) -> str:
        judged = (each for each in scene.assessments if isinstance(each, Life))
        stated = any(each.needs_reed_stress for each in judged)
        return "" if stated else "no strength of the reed is stated: add life.strength, or remove the measure"

    def is_known(self, blow: ContactRecord) -> bool:
        return False

    def evaluate(self, blow: ContactRecord) -> float:
        return math.nan
