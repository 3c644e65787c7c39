"""The outcome of a run: its numbers with error bars, its landings and its histories, as data, tables and figures."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, fields
from functools import cached_property, partial
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from impact.after.result import ImpactResult
from impact.files.safe_files import check_writable
from impact.names import frame_of
from impact.notices import SeatfemError
from impact.pictures.plots import plot_force, plot_motion, plot_opening
from impact.quantities import as_html, enumeration, html_table
from seatfem.readings import Measured, Summary, all_measured, measured
from seatfem.results import HEADINGS, LANDING, name_of, result_of
from seatfem.structures import natural_modes
from seatfem.study.plan import Plan
from seatfem.study.scene.measures import HARDEST, PREFIXES, Stress, all_measures, key_of
from seatfem.study.scene.problems import did_you_mean
from seatfem.study.scene.tables import path_from

if TYPE_CHECKING:
    import pandas
    from matplotlib.figure import Figure


class NoMeasureError(SeatfemError, KeyError):
    """Error of a name that is no measure of a run; the message gives those that are."""

    def __str__(self) -> str:
        return str(self.args[0])


class NoLandingError(SeatfemError, IndexError):
    """Error of the number of a landing that is not there; the message gives how many there are."""


class PlotError(SeatfemError, ValueError):
    """Error of a history that cannot be plotted; the message gives those that can."""


class Measures(Mapping[str, Measured]):
    """The measures of a run, and all other numbers with error bars, by their keys in summary.json; those first to which
    the accuracy refers.

    The name of a measure of the scene, as "impulse" or "filtered_peak", is a name of it, too: its value for the landing
    that accuracy.landing chooses, the hardest by default, or for the whole run where there is none.
    """

    def __init__(self, summary: Summary) -> None:
        names = {key for each in all_measures().values() for key in (each.key, each.landing_key)}
        shown = [each for each in all_measured(summary) if each.has_bar or each.key in names]
        if summary.get("accuracy_landing") != "run":
            shown.sort(key=lambda each: not each.key.startswith(LANDING))
        self._by_key = {each.key: each for each in shown}
        self._summary = summary

    def __getitem__(self, name: str) -> Measured:
        """Return the measure of a key or name. Raises `NoMeasureError`."""
        asked = self._summary.get("accuracy_landing")
        prefix = next((prefix for choice, prefix in PREFIXES.items() if choice == asked), HARDEST)
        keys = (name, key_of(f"{prefix}{name}"), key_of(f"{name}"))
        if (key := next((key for key in keys if key in self._by_key), None)) is None:
            close = did_you_mean(str(name), (*self._by_key, *all_measures()))
            raise NoMeasureError(f"{name!r} is no measure of this run{close or f'; choose: {enumeration(self)}'}")
        return self._by_key[key]

    def __iter__(self) -> Iterator[str]:
        return iter(self._by_key)

    def __len__(self) -> int:
        return len(self._by_key)

    def __repr__(self) -> str:
        return "\n".join([f"Measures, {len(self)}", *(f"  {key}: {_with_spring(self[key])}" for key in self)])

    def _repr_html_(self) -> str:
        return self.html("Measures")

    def html(self, caption: str) -> str:
        """Return a table with the meaning and the key of each measure."""
        rows = [(self._words(key), key, each, each.spring_text) for key, each in self.items()]
        return html_table(caption, ("measure", "key", "seat", "spring baseline"), rows)

    def _words(self, key: str) -> str:
        return f"{HEADINGS[result_of(key).group].partition('{')[0]}: {name_of(key, self._summary)}"


def _with_spring(number: Measured) -> str:
    return f"{number}, spring baseline {number.spring_text}" if number.spring_text else str(number)


@dataclass(frozen=True)
class LandingRecord:
    """One landing of the reed.

    Attributes:
        body: what it landed on, "seat" or "stopper".
        number: 1, 2, ... among the landings on this body.
        time: time of the first touch [s].
        closing_speed: speed at which the gap closes [m/s].
        peak: largest force averaged over run.filter_width [N].
        impulse: impulse above the quasi-static load [N s].
        duration: time from the first touch to the opening [s].
        stress: largest stress in the reed since the landing [Pa], known of the hardest landing alone.
        static_load: quasi-static load at the peak [N].
        restitution: coefficient of restitution.
        is_hardest: whether it is the hardest on the seat, to which the measures landing_... refer.
    """

    body: str
    number: int
    time: Measured
    closing_speed: Measured
    peak: Measured
    impulse: Measured
    duration: Measured
    stress: Measured
    static_load: Measured
    restitution: Measured
    is_hardest: bool

    def __str__(self) -> str:
        hardest = ", the hardest" if self.is_hardest else ""
        lines = [f"  {name.replace('_', ' ')}: {number}" for name, number in self.numbers().items()]
        return "\n".join([f"Landing {self.number} on the {self.body}{hardest}", *lines])

    __repr__ = __str__
    _repr_html_ = as_html

    def numbers(self) -> dict[str, Measured]:
        """Return its numbers by the names of its fields."""
        values = {each.name: getattr(self, each.name) for each in fields(self)}
        return {name: value for name, value in values.items() if isinstance(value, Measured)}


KEYS: Final[Mapping[str, str]] = {
    "time": "time_s",
    "closing_speed": "closing_speed_m_per_s",
    "peak": "filtered_peak_force_N",
    "impulse": "impulse_Ns",
    "duration": "duration_s",
    "stress": Stress.landing_key.removeprefix(LANDING),
    "static_load": "static_load_N",
    "restitution": "restitution",
}
"""Keys of a landing's record in summary.json, by the fields of `LandingRecord`."""


class Landings(tuple[LandingRecord, ...]):
    """All landings on seat and stopper in the order of time. A number beyond them raises `NoLandingError`."""

    __slots__ = ()

    def __getitem__(self, index: Any) -> Any:
        try:
            return super().__getitem__(index)
        except IndexError:
            words = f"there are {len(self)} landings; take a smaller number, or a longer run.duration"
            raise NoLandingError(f"landings[{index}]: {words}") from None

    def __repr__(self) -> str:
        return "\n".join([f"Landings, {len(self)}", *(str(each).replace("\n  ", "; ") for each in self)])

    def _repr_html_(self) -> str:
        heads = ("body", "number", *(name.replace("_", " ") for name in KEYS))
        rows = [(each.body, each.number, *each.numbers().values()) for each in self]
        return html_table("Landings", heads, rows)

    def to_dataframe(self) -> pandas.DataFrame:
        """Return body, number, values and error bars [SI], a row a landing. Raises `FrameError` without pandas."""
        columns: dict[str, list[object]] = {name: [getattr(each, name) for each in self] for name in ("body", "number")}
        for name, key in KEYS.items():
            numbers = [each.numbers()[name] for each in self]
            columns |= {key: [each.value for each in numbers], f"error_bar_{key}": [each.bar for each in numbers]}
        return frame_of(columns)


def landings_of(summary: Summary) -> Landings:
    """Return the landings of a run; of the hardest one the measures of the summary, with the spring's."""
    records = summary.get("landings")
    return Landings(_landing(record, summary) for record in (records if isinstance(records, list) else ()))


def _landing(record: Summary, summary: Summary) -> LandingRecord:
    body, number = str(record["body"]), int(str(record["number"]))
    is_hardest = body == "seat" and number == summary.get("landing_number")
    values = {name: measured(record, key) for name, key in KEYS.items()}
    if is_hardest:
        values |= {name: measured(summary, LANDING + key) for name, key in KEYS.items()}
    return LandingRecord(body=body, number=number, is_hardest=is_hardest, **values)


@dataclass(frozen=True)
class RunOutcome:
    """Results, files and notes of a run.

    Attributes:
        summary: the content of summary.json.
        messages: warnings and notes, a sentence each.
        files: files that were written and are kept.
        stages: wall time of each stage [s].
        met: whether the target of accuracy was met; ``None`` without a landing to judge.
        modes: natural modes, if they were computed (`write_modes`).
    """

    summary: Summary
    messages: tuple[str, ...]
    files: tuple[Path, ...]
    stages: Mapping[str, float] = field(default_factory=dict)
    met: bool | None = True
    modes: tuple[natural_modes.Mode, ...] = ()

    @cached_property
    def measures(self) -> Measures:
        """Return the measures by their keys in summary.json or their names."""
        return Measures(self.summary)

    @cached_property
    def landings(self) -> Landings:
        """Return all landings on seat and stopper in the order of time."""
        return landings_of(self.summary)

    def __str__(self) -> str:
        lines = (f"{key}: {_with_spring(each)}" for key, each in self.measures.items())
        first = f"{type(self).__name__}, {self._verdict()}, {len(self.files)} files"
        return "\n  ".join([first, *lines, *(f"note: {each}" for each in self.messages)])

    __repr__ = __str__

    def _repr_html_(self) -> str:
        title = str(self.summary.get("title") or type(self).__name__)
        notes = "".join(f"<p>note: {escape(each)}</p>" for each in self.messages)
        return self.measures.html(f"{title}: {self._verdict()}") + notes

    def _verdict(self) -> str:
        target = "target reached" if self.met else "target missed"
        if self.met is None:
            target = f"{self.summary.get('landing_status') or 'nothing to judge'}: no target judged"
        elif judged := str(self.summary.get("accuracy_judged_keys") or self.summary.get("accuracy_measures") or ""):
            target = f"{target} ({judged})"
        return target

    def to_dataframe(self) -> pandas.DataFrame:
        """Return value, error_bar, unit, spring and known of every number [SI], its key as index; ``known`` is False
        where the bar is above half of the value. Raises `FrameError` without pandas."""
        rows = list(all_measured(self.summary))
        columns = {"key": "key", "value": "value", "error_bar": "bar", "unit": "unit", "spring": "spring"}
        frame = {head: [getattr(row, name) for row in rows] for head, name in columns.items()}
        return frame_of(frame | {"known": [row.is_known for row in rows]}, "key")


PLOTS: Final[Mapping[str, Callable[..., Figure]]] = {
    "force": plot_force,
    "gap": partial(plot_opening, history="gap"),
    "lift": partial(plot_opening, history="lift"),
    "motion": plot_motion,
}
"""Functions that draw a history of a run, by its name."""


@dataclass(frozen=True, kw_only=True, repr=False)
class RunResult(RunOutcome):
    """The run of a scene: its outcome, and its histories.

        result = seatfem.run("scene.toml"); result.measures["impulse"].value; result.landings[0].peak; result.plot()

    Attributes:
        histories: histories of the contact on the seat.
        spring: those on a spring with the seat's static stiffness.
        plan: plan of the last round.
    """

    histories: ImpactResult
    spring: ImpactResult
    plan: Plan

    def plot(self, history: str = "force", path: str | os.PathLike[str] | None = None) -> Figure:
        """Draw a history beside that of the spring baseline: the whole run, and the hardest landing.

        Args:
            history: "force", "gap" (between reed and seat), "lift" (of the reed above the seat at rest) or "motion"
                (displacements of both).
            path: file to write, .png, .pdf or .svg; ``None``: none.

        Returns the figure. Raises `PlotError` for another history, `OutputError` where ``path`` cannot be written,
        `PictureError` without matplotlib.
        """
        if (draw := PLOTS.get(history)) is None:
            close = did_you_mean(str(history), PLOTS)
            raise PlotError(f"plot: {history!r} is no history of a run; choose: {', '.join(PLOTS)}{close}")
        if path is not None:
            check_writable(path_from(path))
        records = self.summary.get("landings")
        drawn: dict[str, Any] = {
            "filter_width": float(str(self.summary["filter_width_s"])),
            "landings": records if isinstance(records, list) else (),
        }
        if title := str(self.summary.get("title") or ""):
            drawn["title"] = title
        return draw(self.histories, self.spring, path, **drawn)
