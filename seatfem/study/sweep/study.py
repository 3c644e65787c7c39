"""Study files: a scene, what varies of it, by which design, and what is asked of the table."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Annotated, Any, Final, Literal

from pydantic import AfterValidator, Field, model_validator

from seatfem.fields import Contradictions, ExistingFile, Table, absent, default, kinds_below
from seatfem.study.scene.load import load_table
from seatfem.study.sweep.goal import Optimise
from seatfem.study.sweep.variations import AnyVariation, Listed, Range, Variation

Design = Literal["grid", "zip", "latin_hypercube", "sobol", "monte_carlo", "sobol_indices"]
DRAWN: Final = ("latin_hypercube", "sobol", "monte_carlo", "sobol_indices")
"""Designs that draw each value from its distribution."""
POWERS: Final = ("sobol", "sobol_indices")
"""Those whose number has to be a power of two: Sobol's points are even for no other."""
CONTACT_DATA: Final = ("contact.gap", "reed.velocity", "reed.release.tip_deflection", "reed.release.deflection")
"""What scenes that are marched side by side may differ in: the gap, how fast and how far deflected the striker is."""
MOST_KEYS: Final = 100
DEEPEST: Final = 8  # parts of a key
LONGEST: Final = 200  # characters of it
OF_VARIATIONS: Final = {
    field.alias or name for kind in kinds_below(Variation) for name, field in kind.model_fields.items()
} - {"number"}  # of which a scene may have tables
MOST_SCENES: Final = 100_000  # some 3 ms to check each


def _whole_key(key: str) -> str:
    parts = key.split(".")
    if not all(part.strip() for part in parts) or len(parts) > DEEPEST or len(key) > LONGEST:
        raise ValueError(f"{key[:LONGEST]!r} is no key of a scene; write its tables and its name, as reed.thickness")
    return key


def _objective(text: str) -> str:
    words = text.split()
    if len(words) not in (1, 2) or (len(words) == 2 and words[0] not in ("min", "max")):
        raise ValueError(f"{text!r}: write a key of summary.json, or 'max ' before one of which more is better")
    return text


Objective = Annotated[str, AfterValidator(_objective)]
WholeKey = Annotated[str, AfterValidator(_whole_key)]


class Outputs(Table):
    """What is asked of the table."""

    measures: tuple[str, ...] = default(
        (),
        "keys of summary.json; those that the scene is judged by where absent, of its accuracy.measures",
        max_length=MOST_KEYS,
    )
    pareto: tuple[Objective, Objective] | None = absent(
        "two measures, of which less is better, as 'max life_margin' more; none where absent"
    )

    def asked(self) -> tuple[str, ...]:
        """Return all keys that are named, each once."""
        return tuple(dict.fromkeys((*self.measures, *(text.split()[-1] for text in self.pareto or ()))))


class Study(Table):
    """Many scenes: one of them, with other values of some keys."""

    title: str = default("", "for reports and pictures")
    scene: ExistingFile = Field(description="the scene's file; what it does not state is chosen for each scene anew")
    design: Design = default("grid", "how the values are combined")
    number: int | None = absent("scenes that are drawn", strict=True, ge=1, le=MOST_SCENES)
    seed: int = default(1, "of what is drawn", strict=True, ge=0, lt=2**32)
    limit: int = default(10_000, "scenes that are allowed at most", strict=True, ge=1, le=MOST_SCENES)
    vary: dict[WholeKey, AnyVariation] = Field(
        min_length=1, max_length=MOST_KEYS, description="values by dotted key of the scene"
    )
    error_bars: Literal["every", "sampled"] = default(
        "every",
        "every scene has its own, or some run in full and the others, which must differ in contact data "
        "alone, are marched side by side with theirs",
    )
    outputs: Outputs = default({}, "what is asked of the table")
    optimise: Optimise | None = absent("of the values in between, which are best; none where absent")

    @model_validator(mode="before")
    @classmethod
    def _dotted(cls, given: object) -> object:
        """Return [vary] with reed.thickness = ... as with "reed.thickness" = ..."""
        if isinstance(given, Mapping) and isinstance(vary := given.get("vary"), Mapping):
            return {**given, "vary": dict(_flat(vary))}
        return given

    @property
    def heading(self) -> str:
        """Return the heading, for people."""
        return self.title or self.scene.stem.replace("_", " ")

    @property
    def is_drawn(self) -> bool:
        """Return whether values are drawn from distributions."""
        return self.design in DRAWN

    @property
    def number_of_scenes(self) -> int:
        """Return the number of scenes of the design."""
        if self.design == "grid":
            numbers: list[int] = [len(each.levels(key)) for key, each in self.vary.items()]
            return math.prod(numbers)
        if self.design == "zip":
            return len(next(iter(self.vary.values())).levels(""))
        assert self.number is not None
        return self.number * (len(self.vary) + 2 if self.design == "sobol_indices" else 1)

    @property
    def asks_for_stress(self) -> bool:
        """Return whether any output or goal is a stress, or comes from one."""
        names = (*self.outputs.asked(), *(() if self.optimise is None else self.optimise.measures))
        return any(word in name for name in names for word in ("stress", "life"))

    def contradictions(self) -> Contradictions:
        yield from self._contradictions_of_design() if self.optimise is None else self._contradictions_of_search()

    def _contradictions_of_search(self) -> Contradictions:
        for key in {"design", "number"} & self.model_fields_set:
            yield key, "[optimise] chooses the scenes; remove the key, or the table"
        if self.error_bars == "sampled":
            words = "'sampled' is for designs; [optimise] chooses its scenes one by one, leave error_bars out there"
            yield "error_bars", words
        if self.outputs.pareto:
            yield "outputs.pareto", "[optimise] has one measure to improve; make the other a limit there"
        for key, each in self.vary.items():
            if not isinstance(each, Range) or each.number is not None:
                yield f"vary.{key}", "[optimise] needs bounds: write { from = ..., to = ... } and no number"
            if key.split(".")[0] == "accuracy":
                yield f"vary.{key}", "[optimise] sets the accuracy itself; see optimise.coarse"
        least = 2 * len(self.vary) + 3
        if self.optimise is not None and self.optimise.most < least:
            words = f"{self.optimise.most} evaluations are too few for {len(self.vary)} keys: at least {least}"
            yield "optimise.most", words

    def _contradictions_of_design(self) -> Contradictions:
        for key, each in self.vary.items() if self.error_bars == "sampled" else ():
            if key not in CONTACT_DATA and not (isinstance(each, Listed) and len(each.values) == 1):
                words = "is no contact data, of which alone scenes may differ with error_bars = 'sampled'"
                remedy = f"({', '.join(CONTACT_DATA)}): give it one value, or leave error_bars out"
                yield f"vary.{key}", f"{words} {remedy}"
        for key, each in self.vary.items():
            if self.is_drawn:
                each.check_drawn(f"vary.{key}")
            else:
                each.levels(f"vary.{key}")
        if self.is_drawn and self.number is None:
            yield "number", f"required key is missing: scenes that design = {self.design!r} draws"
        if not self.is_drawn and self.number is not None:
            yield "number", f"design = {self.design!r} draws none: its scenes are those of [vary]; remove it"
        if self.design in POWERS and self.number is not None and self.number & (self.number - 1):
            lower = 1 << (self.number.bit_length() - 1)
            yield "number", f"{self.number} is no power of two, as Sobol's points need; {lower} is, or {2 * lower}"
        if self.design == "zip":
            lengths = {key: len(each.levels(key)) for key, each in self.vary.items()}
            first, length = next(iter(lengths.items()))
            for key, other in lengths.items():
                if other != length:
                    words = f"{other} values beside {length} of {first}: design = 'zip' takes one of each"
                    yield f"vary.{key}", f"{words}; give as many"
        if (count := self.number_of_scenes) > self.limit:
            yield "limit", f"{count} scenes are more than limit = {self.limit}: vary less, or raise the limit"


def _flat(vary: Mapping[str, Any], before: str = "") -> Iterator[tuple[str, Any]]:
    """Yield values by dotted key; a table with a key of a variation is one, others hold further keys."""
    for key, value in vary.items():
        if isinstance(value, Mapping) and not OF_VARIATIONS & value.keys() and before.count(".") < DEEPEST:
            yield from _flat(value, f"{before}{key}.")
        else:
            yield f"{before}{key}", value


def load_study(path: Path | str) -> Study:
    """Read a study file (TOML, up to 1 MB). Its scene is looked for from its own folder.

    Raises `SceneError` with everything that is wrong, as `load_scene`; of the scenes themselves `cases_of` tells.
    """
    return load_table(path, Study)
