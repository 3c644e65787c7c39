"""Files of measured strength: TOML with units in strings, checked like scenes (docs/life.md lists the keys)."""

from __future__ import annotations

import math
from functools import cached_property
from pathlib import Path
from typing import Annotated, Final

from pydantic import Field

from impact.life.strength import UNKNOWN, Curve, LifeError, Strength, basquin, tabled
from seatfem import fields
from seatfem.structures.columns import ColumnsError, read_columns
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
            return tabled(self.points or self._of_file(), scatter=scatter, survival=self.survival)
        second = math.inf if self.endurance_limit else self.second_slope or math.nan
        return basquin(self.knee_stress, self.knee_cycles, self.slope, second, scatter=scatter, survival=self.survival)

    def _of_file(self) -> list[tuple[float, float]]:
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
        return fields.of_same_names(Strength, self, curve=self.curve and self.curve.curve)


def load_strength(path: Path | str) -> Strength:
    """Read a file of measured strength (TOML, up to 1 MB) into SI.

    Raises:
        SceneError: all errors of the file, such as no source, unknown keys, wrong units, values out of range, or S-N
            points that rise.
    """
    return load_table(path, StrengthTable).strength
