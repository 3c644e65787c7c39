"""[life] of a scene: design life, strength and criteria of fatigue, and curves of margins, with their checks; and the
files of strength that it names."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, ClassVar, Final, Literal

from pydantic import Field

from impact.life import damage, places
from impact.life import multiaxial as multiaxial_criteria
from impact.life.strength import OWN, UNKNOWN, Curve, LifeError, Strength, basquin, tabled
from seatfem import fields, units
from seatfem.structures.columns import ColumnsError, read_columns
from seatfem.study.scene import contradictions
from seatfem.study.scene.contact import STEEPEST
from seatfem.study.scene.lips import ContactGeometry
from seatfem.study.scene.problems import SceneError
from seatfem.study.scene.tables import load_table

COLUMNS: Final = {"stress": "strength", "cycles": ""}
Count = Annotated[float, Field(gt=0)]


class CurveTable(fields.Table):
    """Stress amplitude against cycles: a knee with slopes, or points."""

    knee_stress: fields.Stress | None = fields.absent("amplitude at the knee")
    knee_cycles: Count | None = fields.absent("cycles at the knee")
    slope: float | None = fields.absent("k above the knee, N ~ S^-k", ge=1, le=1000)
    second_slope: float | None = fields.absent("below the knee; 2k - 1 (Haibach) where nothing is stated", gt=0)
    endurance_limit: bool = fields.default(False, "whether amplitudes below the knee do no damage at all")
    points: tuple[tuple[fields.Stress, Count], ...] = fields.default(
        (), "instead of the knee: [amplitude, cycles], falling"
    )
    file: fields.ExistingFile | None = fields.absent(
        "instead of points: CSV with the header `stress [MPa],cycles`, amplitudes that fall"
    )
    scatter: float | None = fields.absent("standard deviation of log10 N", ge=0)
    survival: fields.Fraction = fields.default(0.5, "share of specimens that survive the curve as it is stated")

    def contradictions(self) -> fields.Contradictions:
        knee = {key: getattr(self, key) for key in ("knee_stress", "knee_cycles", "slope")}
        if self.points and self.file is not None:
            yield "file", "points are given too; keep one of the two"
        measured, key = self.points or self.file, "points" if self.points else "file"
        if measured and (any(knee.values()) or self.second_slope or self.endurance_limit):
            yield key, "a curve is given by a knee and slopes or by points; give one of them"
        if missing := [key for key, value in knee.items() if value is None and not measured]:
            words = f"a curve needs knee_stress, knee_cycles and slope, or points; missing: {', '.join(missing)}"
            yield missing[0], words
        if self.endurance_limit and self.second_slope:
            yield "second_slope", "an endurance limit leaves no second slope; state one of them"
        with fields.problem_of(key, LifeError, ColumnsError):
            _ = self.curve

    @cached_property
    def curve(self) -> Curve:
        """Return the curve in SI."""
        scatter = UNKNOWN if self.scatter is None else self.scatter
        if self.knee_stress is None or self.knee_cycles is None or self.slope is None:
            return tabled(self.points or self._read_points(), scatter=scatter, survival=self.survival)
        second = math.inf if self.endurance_limit else self.second_slope or math.nan
        return basquin(self.knee_stress, self.knee_cycles, self.slope, second, scatter=scatter, survival=self.survival)

    def _read_points(self) -> list[tuple[float, float]]:
        """Return amplitude and cycles of each row of the file. Raises `ColumnsError`."""
        assert self.file is not None
        table = read_columns(self.file, COLUMNS, tuple(COLUMNS))
        return list(zip(table["stress"].tolist(), table["cycles"].tolist(), strict=True))


class StrengthTable(fields.Table):
    """A material's fatigue strength, with its source. What nobody measured is left out."""

    source: fields.Source = Field(description="citation of the numbers: report, standard, data sheet, page")
    grade: str = fields.default("", "of the material")
    direction: str = fields.default("", "of loading, as against rolling")
    thickness: fields.Length | None = fields.absent("of the specimens")
    temperature: fields.Temperature | None = fields.absent("of the tests")
    specimens: int | None = fields.absent("their number", gt=0)
    ultimate: fields.Stress | None = fields.absent("tensile strength: goodman, gerber")
    fatigue_strength: fields.Stress | None = fields.absent("coefficient sf': morrow")
    walker_exponent: float | None = fields.absent("gamma: walker", gt=0, le=1)
    loading_ratio: float = fields.default(-1.0, "smin/smax of the curve", lt=1)
    curve: CurveTable | None = fields.absent("amplitude against cycles: every life")
    torsion_limit: fields.Stress | None = fields.absent("fully reversed shear t-1: crossland, dang_van, papadopoulos")
    bending_limit: fields.Stress | None = fields.absent("fully reversed bending f-1: the same")
    limit_cycles: Count | None = fields.absent("N of the two limits")
    impact_velocity: fields.Speed | None = fields.absent("largest speed of closing allowed")

    def contradictions(self) -> fields.Contradictions:
        try:
            _ = self.strength
        except LifeError as problem:
            key, _, words = str(problem).removeprefix("strength.").partition(": ")
            yield key, words

    @cached_property
    def strength(self) -> Strength:
        """Return the strength in SI."""
        return fields.build_from_fields(Strength, self, curve=self.curve and self.curve.curve)


def load_strength(path: Path | str) -> Strength:
    """Read a file of measured strength (TOML, up to 1 MB) into SI.

    Raises:
        SceneError: all errors of the file, such as no source, unknown keys, wrong units, values out of range, or S-N
            points that rise.
    """
    return load_table(path, StrengthTable).strength


if TYPE_CHECKING:
    from pathlib import Path


UNITS = {"speed": ("m/s", 1.0), "tilt": ("deg", math.degrees(1.0)), "lift": ("mm", 1e3)}
"""Unit of each curve in tables and pictures, and the factor from SI to it."""


OF_A_CURVE: Final = 4
"""Most runs, in addition to the values in the scene, in search of the value with a margin of 1."""


class Curves(fields.Table):
    """Margins over other values of a key: the contact is computed again for each value, with the same method; all other
    keys stay. Files: margin_over_speed.csv and .png, ...; in summary.json life_allowed_speed_m_per_s, ... is the value
    with a margin of 1, if the curve reaches it."""

    speed: tuple[fields.Speed, ...] = fields.default(
        (), "of the reed at its start, towards the seat or its stopper as the reed's velocity, as [1, 2, 4] m/s"
    )
    tilt: tuple[fields.Tilt, ...] = fields.default((), "of the reed on the seat's lip: contact.tilt")
    lift: tuple[fields.Gap, ...] = fields.default((), "to the stopper: its gap, or its lift where that is stated")

    def contradictions(self) -> fields.Contradictions:
        curves = {name: getattr(self, name) for name in UNITS if getattr(self, name)}
        if not curves:
            yield "speed", "no curve is asked for: give speed, tilt or lift, or remove the table"
        for name, values in curves.items():
            if len(set(values)) < 2:
                yield name, f"a curve needs two values or more, not {len(set(values))}"

    def asked(self) -> Iterator[tuple[str, tuple[float, ...]]]:
        """Yield the name of each curve with its distinct values [SI] in ascending order."""
        yield from ((name, tuple(sorted(set(values)))) for name in UNITS if (values := getattr(self, name)))

    @property
    def runs(self) -> tuple[int, int]:
        """Return the least and the largest number of runs of all curves."""
        curves = dict(self.asked())
        least = sum(map(len, curves.values()))
        return least, least + OF_A_CURVE * len(curves)

    def check(self, geometry: ContactGeometry) -> fields.Contradictions:
        """Yield contradictions for values that the contacts cannot have."""
        for name, value in ((name, value) for name, values in self.asked() for value in values):
            unit, factor = UNITS[name]
            try:
                problems = [words for _, words in contradictions.find_start_conflicts(varied(geometry, name, value))]
            except fields.KeyProblem as problem:
                problems = [str(problem)]
            yield from ((name, f"{value * factor:g} {unit}: {words}") for words in problems)


def varied(geometry: ContactGeometry, name: str, value: float) -> ContactGeometry:
    """Return the contacts with another speed [m/s], tilt [rad] or lift [m]. Raises `KeyProblem` if the scene has no
    such key."""
    reed, contact, stopper = geometry.reed, geometry.contact, geometry.stopper
    if name == "tilt":
        one = (contact.ports or geometry.usual_ports) == 1
        if geometry.seat.lip_face.no_lip or one:
            raise fields.KeyProblem(
                "tilt", "contact is not along a lip: state contact.ports, 16 or more, or contact.tilt"
            )
        if abs(value) > STEEPEST:
            raise fields.KeyProblem("tilt", f"it must be at most {math.degrees(STEEPEST):g} deg")
        return replace(geometry, contact=contact.model_copy(update={"tilt": value}))
    if name == "lift":
        if stopper is None:
            raise fields.KeyProblem("lift", "the scene has no [stopper]; add one")
        key = "gap" if stopper.lift is None else "lift"
        return replace(geometry, stopper=stopper.model_copy(update={key: value}))
    release = getattr(reed, "release", None)
    if (stated := getattr(reed, "velocity", None)) is not None:
        return replace(geometry, reed=reed.model_copy(update={"velocity": math.copysign(value, stated)}))
    if (stated := getattr(release, "velocity", None)) is not None:
        thrown = release.model_copy(update={"velocity": math.copysign(value, stated)})  # type: ignore[union-attr]
        return replace(geometry, reed=reed.model_copy(update={"release": thrown}))
    raise fields.KeyProblem("speed", "the reed does not start with a velocity: state one, or run over loads instead")


OF_SPEED: Final = frozenset({"impact_speed_limit", "source"})
"""Keys that need no strength file."""
Of = Literal["reed", "seat", "contact"]
TURNS: Final = 2  # least number of turns of the crank for block = "last cycle", to exclude the initial transient


class LifeTable(fields.Table):
    """The keys of [life], and the demands that they state."""

    sample: ClassVar[str] = """
impact_speed_limit = "6 m/s"
source = "report, page"
"""

    strength: fields.ExistingFile | None = fields.absent("file of measured strength of the reed's material")
    seat_strength: fields.ExistingFile | None = fields.absent(
        "the same of the seat's, whose surface is judged, too; needs [stress]"
    )
    criterion: str = fields.default("goodman", "for mean stress: goodman, gerber, morrow, walker or swt")
    multiaxial: str = fields.default(
        "", "in addition, for stress tensors of plates and seats: crossland, dang_van, papadopoulos"
    )
    survival: fields.Fraction | None = fields.absent(
        "share of parts that survive, as 0.999; that of the S-N curve where absent"
    )
    cycles: float | None = fields.absent("blocks to be survived; or give hours and rpm", gt=0)
    hours: float | None = fields.absent("of running to be survived, with rpm", gt=0)
    rpm: fields.Rpm | None = fields.absent("blocks a minute, with hours: a number (1/min), or with its unit")
    block: Literal["run", "last cycle"] = fields.default("run", "what repeats: the run, or the crank's last turn")
    contact_criterion: str = fields.default(
        "", "for the stress below a contact of Hertz: crossland, dang_van, papadopoulos; cycles may be absent"
    )
    contact_modulus: fields.Modulus | None = fields.absent(
        "E* of both bodies, 1/E* = (1 - nu1^2)/E1 + (1 - nu2^2)/E2, with contact_criterion"
    )
    contact_poisson: fields.PoissonRatio = fields.default(0.3, "of the body whose strength it is")
    curves: Curves | None = fields.absent("margins over other speeds, tilts and lifts")
    impact_speed_limit: fields.Speed | None = fields.absent(
        "largest speed of closing that experience allows; that of the strength file where absent"
    )
    source: str = fields.default("", "citation of impact_speed_limit")

    def contradictions(self) -> fields.Contradictions:
        if self.impact_speed_limit is not None and not self.source.strip():
            yield "source", "required key is missing: citation of impact_speed_limit"
        if self.source and self.impact_speed_limit is None:
            yield "source", "there is no impact_speed_limit; remove the key"
        if self.strength is None and self.contact_criterion:
            yield "strength", "required key is missing: a file of strength, for contact_criterion"
        if self.strength is None and self.seat_strength is None:
            if idle := [key for key in type(self).model_fields if key in self.model_fields_set - OF_SPEED]:
                yield idle[0], "there is no strength to judge by; give life.strength, or remove the key"
            if self.impact_speed_limit is None:
                yield "strength", "required key is missing: a file of strength (or impact_speed_limit)"
            return
        if self.cycles is not None and (beside := self.given_keys("hours", "rpm")):
            yield beside[0], "cycles is given too; keep cycles, or hours with rpm"
        if (self.contact_modulus is None) != (not self.contact_criterion):
            missing = "contact_modulus" if self.contact_criterion else "contact_criterion"
            yield missing, "required key is missing: contact_criterion and contact_modulus go together"
        if self.cycles is None and self.hours is None and (self.rpm is not None or not self.contact_criterion):
            words = "hours of running" if self.rpm is not None else "blocks to be survived, or hours with rpm"
            yield "hours" if self.rpm is not None else "cycles", f"required key is missing: {words}"
        if self.hours is not None and self.rpm is None:
            yield "rpm", f"required key is missing: blocks a minute, for hours = {self.hours:g}"
        for of in ("reed", "seat", "contact"):
            self.demand(of)

    @property
    def judges_bending(self) -> bool:
        """Return whether fatigue by stress in the bodies is evaluated."""
        return (self.strength or self.seat_strength) is not None and self.blocks > 0

    @property
    def blocks(self) -> float:
        """Return the number of blocks to be survived."""
        return self.cycles or 60 * (self.hours or 0.0) * (self.rpm or 0.0)

    def strength_of(self, key: str = "strength") -> Strength | None:
        """Return the strength in the file of ``key``; ``None`` without file. Raises `KeyProblem` for a wrong file."""
        if (path := getattr(self, key)) is None:
            return None
        try:
            return self.known.get(path) or self.known.setdefault(path, load_strength(path))
        except SceneError as problem:
            raise fields.KeyProblem(key, str(problem).replace("\n", "; ")) from None

    @cached_property
    def known(self) -> dict[Path, Strength]:
        """Return the strengths that are read already, by their files."""
        return {}

    def demand(self, of: Of = "reed") -> places.Demand | None:
        """Return design life and criteria of a body or the contact; ``None`` without a strength, or if not asked for.

        Raises `KeyProblem` for a wrong file of strength, or one without the data for the criterion or the survival.
        """
        file = "seat_strength" if of == "seat" else "strength"
        bends, criterion_key = of != "contact", "contact_criterion" if of == "contact" else "multiaxial"
        judged = self.judges_bending if bends else self.contact_criterion
        if not judged or (strength := self.strength_of(file)) is None:
            return None
        key, judge, axes = file, None, None
        survival = OWN if self.survival is None else self.survival
        try:
            if bends:
                [curve] = strength.needed("a life", "curve")
                key = "criterion"
                judge = damage.mean_stress(self.criterion, strength)
                key = "survival"
                curve.stress(self.blocks, survival)
            if criterion := getattr(self, criterion_key):
                key = criterion_key
                axes = multiaxial_criteria.multiaxial(criterion, strength)
        except LifeError as problem:
            raise fields.KeyProblem(key, f"{problem} ({file}: {getattr(self, file).name})") from None
        return places.Demand(strength, judge, self.blocks, survival, axes)

    def allowed_speed(self) -> Strength | None:
        """Return the largest closing speed allowed, as strength with its source; ``None`` if none is stated."""
        if self.impact_speed_limit is not None:
            return Strength(self.source, impact_velocity=self.impact_speed_limit)
        strength = self.strength_of()
        return None if strength is None or math.isnan(strength.impact_velocity) else strength

    def contradictions_with(
        self, geometry: ContactGeometry, turn: float, duration: float, *, stressed: bool
    ) -> fields.Contradictions:
        """Yield contradictions if the scene has no stress for a criterion, or too few turns of the crank [s] within the
        ``duration`` [s]; ``turn``: nan without a crank; ``stressed``: whether stress in the seat is computed.
        """
        contact, reed = geometry.contact, geometry.reed
        if self.contact_criterion and (not contact.law.sphere_stiffness or contact.rings > 1):
            words = "the stress below a contact is known of a law of Hertz, not in rings"
            yield "contact_criterion", f"{words}: state one, or remove the key"
        if self.judges_bending and self.strength is not None:
            yield from (("strength", words) for words in reed.stress_problems("a life"))
        if self.seat_strength is not None and not stressed:
            yield "seat_strength", "stress in the seat is not computed: add the table [stress]"
        if self.multiaxial and not self.seat_strength:
            asked = reed.stress_problems("a criterion of several axes", tensors=True)
            yield from (("multiaxial", f"{words}, or give seat_strength") for words in asked)
        if self.curves is not None:
            yield from fields.within("curves", self.curves.check(geometry))
        if self.block == "last cycle":
            if math.isnan(turn):
                yield "block", "no load of one rpm repeats in this scene; take the run as the block"
            elif duration < TURNS * turn * (1 - 1e-9):
                whole, each = (units.write_quantity(time, "time") for time in (duration, turn))
                words = f"run.duration = {whole} holds fewer than {TURNS} turns of {each}, so that the last one"
                yield "block", f"{words} would hold the start: watch longer, or take the run as the block"
