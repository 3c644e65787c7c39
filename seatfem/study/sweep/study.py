"""Study files: a scene, the variation of its keys, the design or [optimise], and the template of a study."""

import math
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Annotated, Any, ClassVar, Final, Literal

from pydantic import AfterValidator, BeforeValidator, Field, PrivateAttr

from seatfem.fields import Contradictions, ExistingFile, Fraction, Table, absent, default, kinds_below, problem_of
from seatfem.readings import BAR
from seatfem.study.scene.keys import schema_of, table_lines
from seatfem.study.scene.problems import SceneError
from seatfem.study.scene.tables import WholeKey, dotted, load_table, located, path_from
from seatfem.study.scene.wings import assessments
from seatfem.study.sweep.limits import Constraint, full_key, read_constraint, read_limit, read_unit
from seatfem.study.sweep.variations import AnyVariation, Variation

LEAST: Final = 5  # fewest evaluations: three for a quadratic model of one key, one to start and one to use it
CONFIRMED: Final = 3  # largest number of points that are run at the scene's own target


def _key(name: str) -> str:
    if not name.isidentifier():
        raise ValueError(f"{name!r} is no key of summary.json; write one, as in 'landing_impulse_Ns'")
    return full_key(name)


def _limit(written: object) -> object:
    if isinstance(written, bool) or not isinstance(written, int | float | str):
        raise ValueError(f"{written!r} is no limit; write a number with its unit, as '350 MPa', or 1.3")
    return written


ResultKey = Annotated[str, AfterValidator(_key)]
Limit = Annotated[float | str, BeforeValidator(_limit)]


class Optimise(Table):
    """The measure to be optimised, its limits and the effort."""

    minimise: ResultKey | None = absent("key of summary.json of which less is better")
    maximise: ResultKey | None = absent("key of summary.json of which more is better")
    subject_to: tuple[Annotated[Any, BeforeValidator(read_constraint)], ...] = default(
        (), "limits, as 'life_margin >= 1.2', besides those of below and above", max_length=20
    )
    most: int = default(40, "scenes of the search, at most", strict=True, ge=LEAST, le=10_000)
    coarse: Fraction = default("20 %", "accuracy.target of the search")

    @property
    def measure(self) -> str:
        """Return the measure that is optimised."""
        return self.minimise or self.maximise or ""

    @property
    def sign(self) -> float:
        """Return 1 to minimise, -1 to maximise."""
        return 1.0 if self.minimise else -1.0

    @property
    def measures(self) -> tuple[str, ...]:
        """Return the optimised measure and those with limits, without repetitions."""
        return tuple(dict.fromkeys((self.measure, *(each.measure for each in self.subject_to))))

    def contradictions(self) -> Contradictions:
        if (self.minimise is None) == (self.maximise is None):
            yield "minimise", "give one of minimise and maximise: a key of summary.json"


Design = Literal["grid", "zip", "latin_hypercube", "sobol", "monte_carlo", "sobol_indices"]
DRAWN: Final = ("latin_hypercube", "sobol", "monte_carlo", "sobol_indices")
"""Designs that draw each value from its distribution."""
POWERS: Final = ("sobol", "sobol_indices")
"""Designs whose number must be a power of two, as Sobol's points are evenly distributed only then."""
CONTACT_DATA: Final = ("contact.gap", "reed.velocity", "reed.release.tip_deflection", "reed.release.deflection")
"""Keys that may differ between scenes integrated in parallel: gap, speed and deflection of the striker."""
MOST_KEYS: Final = 100
OF_VARIATIONS: Final = {
    field.alias or name for kind in kinds_below(Variation) for name, field in kind.model_fields.items()
} - {"number"}  # of which a scene may have tables
MOST_SCENES: Final = 100_000  # largest number of scenes of a study; each takes some 3 ms to check


def _objective(text: str) -> str:
    words = text.split()
    if len(words) not in (1, 2) or (len(words) == 2 and words[0] not in ("min", "max")):
        raise ValueError(f"{text!r}: write a key of summary.json, or 'max ' before one of which more is better")
    return " ".join((*words[:-1], full_key(words[-1])))


Objective = Annotated[str, AfterValidator(_objective)]


class Outputs(Table):
    """The measures that tables and charts of a study show."""

    former: ClassVar[Mapping[str, str]] = MappingProxyType(
        dict.fromkeys(("below", "above", "units"), "is a key of the study itself: move it above [vary]")
    )

    measures: tuple[ResultKey, ...] = default(
        (),
        "keys of summary.json; those that the scene is judged by where absent, of its accuracy.measures",
        max_length=MOST_KEYS,
    )
    pareto: tuple[Objective, Objective] | None = absent(
        "two measures, of which less is better, as 'max life_margin' more; none where absent"
    )

    def traded(self) -> tuple[str, ...]:
        """Return the measures of the Pareto front."""
        return tuple(text.split()[-1] for text in self.pareto or ())

    def asked(self) -> tuple[str, ...]:
        """Return all keys in the table, without repetitions."""
        return tuple(dict.fromkeys((*self.measures, *self.traded())))


class Study(Table):
    """Many scenes: one of them, with other values of some keys."""

    title: str = default("", "for reports and pictures")
    scene: ExistingFile = Field(description="the scene's file; what it does not state is chosen for each scene anew")
    design: Design = default("grid", "how the values are combined")
    number: int | None = absent("scenes that are drawn", strict=True, ge=1, le=MOST_SCENES)
    seed: int = default(1, "of what is drawn", strict=True, ge=0, lt=2**32)
    limit: int = default(10_000, "scenes that are allowed at most", strict=True, ge=1, le=MOST_SCENES)
    vary: Annotated[dict[WholeKey, AnyVariation], dotted(OF_VARIATIONS)] = Field(
        min_length=1, max_length=MOST_KEYS, description="values by dotted key of the scene"
    )
    error_bars: Literal["every", "sampled"] = default(
        "every",
        "every scene has its own, or every tenth and those at the ends of the ranges, whose largest are carried over "
        "to the others",
    )
    below: dict[ResultKey, Limit] = default(
        {}, "largest value allowed by key of summary.json: the table marks the scenes that keep to it", max_length=20,
        example={"landing_peak_reed_stress_Pa": "350 MPa"},
    )  # fmt: skip
    above: dict[ResultKey, Limit] = default(
        {}, "smallest value allowed by key of summary.json", max_length=20, example={"life_margin": 1.3}
    )
    units: dict[ResultKey, str] = default(
        {}, "unit by key of summary.json, of its column in all tables and charts", max_length=MOST_KEYS,
        example={"landing_peak_reed_stress_Pa": "MPa"},
    )  # fmt: skip
    outputs: Outputs = default({}, "what is asked of the table")
    optimise: Optimise | None = absent("of the values in between, which are best; none where absent")

    _file: Path | None = PrivateAttr(None)

    @property
    def heading(self) -> str:
        """Return the title, or the name of the scene's file."""
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
    def stated_limits(self) -> tuple[Constraint, ...]:
        """Return the limits of below and above."""
        sides = ((-1.0, self.below), (1.0, self.above))
        return tuple(Constraint(key, sign, read_limit(key, each)) for sign, of in sides for key, each in of.items())

    @property
    def limits(self) -> tuple[Constraint, ...]:
        """Return all limits: of below and above, and those that only a search has."""
        return self.stated_limits + (self.optimise.subject_to if self.optimise else ())

    def scale(self, key: str) -> tuple[float, str] | None:
        """Return the stated unit of a result, and the number of it in the SI unit; ``None`` where none is stated."""
        name = key.removeprefix(BAR)
        return (1 / read_unit(name, self.units[name]), self.units[name]) if name in self.units else None

    @property
    def asked(self) -> tuple[tuple[str, str], ...]:
        """Return all measures that are asked for, each after the key that names it."""
        keys = {"outputs.measures": self.outputs.measures, "outputs.pareto": self.outputs.traded()}
        keys |= {f"{table}.{key}": (key,) for table in ("below", "above", "units") for key in getattr(self, table)}
        if (goal := self.optimise) is not None:
            best = "optimise.minimise" if goal.minimise else "optimise.maximise"
            keys |= {best: (goal.measure,), "optimise.subject_to": tuple(each.measure for each in goal.subject_to)}
        return tuple((key, name) for key, names in keys.items() for name in names)

    @property
    def asks_for_stress(self) -> bool:
        """Return whether any output, objective or limit is a stress, or by an assessment."""
        return any(
            word in name for _, name in self.asked for word in ("stress", *(each.table for each in assessments()))
        )

    def located(self, error: SceneError) -> SceneError:
        """Return the error with the study's file, if it was read from one, and the lines of the keys."""
        return error if self._file is None else located(error, self._file)

    def contradictions(self) -> Contradictions:
        for table in ("below", "above", "units"):
            for key, written in getattr(self, table).items():
                with problem_of(f"{table}.{key}", ValueError):
                    (read_unit if table == "units" else read_limit)(key, written)
        for key in self.vary:
            if key.split(".")[0] in Study.model_fields.keys() - {"title", "scene"}:
                yield f"vary.{key}", f"is a key of the study, not of the scene: move {key.split('.')[0]} above [vary]"
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
            if not each.is_searchable:
                words = "give several values, [..., ...], or bounds, { from = ..., to = ... }"
                yield f"vary.{key}", f"[optimise] chooses among values of a list, or between bounds; {words}"
            if key.split(".")[0] == "accuracy":
                yield f"vary.{key}", "[optimise] sets the accuracy itself; see optimise.coarse"
        free = sum(not each.places for each in self.vary.values())
        least = 2 * free + 3
        if self.optimise is not None and free and self.optimise.most < least:
            words = f"{self.optimise.most} evaluations are too few for {free} keys: at least {least}"
            yield "optimise.most", words

    def _contradictions_of_design(self) -> Contradictions:
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


def load_study(path: Path | str) -> Study:
    """Read a study file (TOML, up to 1 MB). The path of its scene is relative to its folder.

    Raises `SceneError` with all errors, like `load_scene`; errors of the scenes are reported by `cases_of`.
    """
    study = load_table(path, Study)
    study._file = path_from(path)
    return study


_HEAD: Final = """\
# seatfem init flapper      writes the scene that stands below, unless there is one
# seatfem plan {file}     how many scenes there are, and what they would take
# seatfem sweep {file}    all of them: one table, main effects, bands; goes on where it was stopped
# A key behind a # has this default, or is absent: then the value shows how one is written (docs/studies.md).
"""
_LIMITS: Final = """\
# below = { landing_peak_reed_stress_Pa = "350 MPa" }                    # limits: the table says which scenes hold them
# above = { life_margin = 1.3 }
# units = { landing_peak_reed_stress_Pa = "MPa" }                        # of columns and charts
"""
_VARY: Final = """\
[vary]
# Any keys of the scene, each with a list, a range or a distribution.
reed.thickness = { kind = "normal", mean = "0.3 mm", deviation = "0.005 mm" }
# reed.damping_ratio = [0.01, 0.02]
# contact.gap = { from = "0 mm", to = "0.1 mm" }

[outputs]
measures = ["impulse_Ns", "filtered_peak_force_N"]                       # keys of summary.json
# pareto = ["peak_reed_stress_Pa", "max impulse_Ns"]                     # two of which less, or more, is better

# In place of a design, which must go then: the best of values in lists or between bounds, by seatfem optimise {file}
# [optimise]
# minimise = "peak_reed_stress_Pa"                                       # or maximise
# subject_to = ["impulse_Ns >= 0.1 mN s"]                                # limits, besides below and above
# most = 40                                                              # scenes of the search
# coarse = "20 %"                                                        # accuracy.target of the search
"""


def study_template(*, file: str) -> str:
    """Return the text of a study of flapper.toml, every key with its meaning; ``file``: its name in comments."""
    values = {"scene": "flapper.toml", "design": "latin_hypercube", "number": 32}
    keys = table_lines(Study, values, leave=("vary", "outputs", "optimise", "below", "above", "units"))
    return "\n".join([_HEAD.replace("{file}", file), *keys, _LIMITS, _VARY.replace("{file}", file)])


def study_schema() -> dict[str, Any]:
    """Return the schema of a study file, JSON Schema draft 2020-12; keys of [vary] may be dotted or tables."""
    schema = schema_of(Study, "seatfem study")
    values = schema["properties"]["vary"]["additionalProperties"]
    keys = {"additionalProperties": {"anyOf": [values, {"$ref": "#/$defs/Vary"}]}}
    no_distribution = {"properties": {"kind": {"not": {"type": "string"}}}}
    schema["$defs"]["Vary"] = {"type": "object", **keys, "allOf": [no_distribution]}
    schema["properties"]["vary"] = {"$ref": "#/$defs/Vary"}
    return schema
