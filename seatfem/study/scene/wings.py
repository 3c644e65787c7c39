"""Tables that files of `seatfem.wings` add to a scene: loads on the reed by its opening, and assessments of a run."""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, ClassVar, Final

import numpy as np

from impact.bodies import body as bodies
from impact.greens.base import Array
from impact.names import import_all
from seatfem.fields import Contradictions, Table
from seatfem.results import WINGS, ResultSource
from seatfem.structures.kinds import Structure

if TYPE_CHECKING:
    from seatfem.study.scene.models import Scene

NO_STOPS: Final[Array] = np.zeros(0)
"""Times of the contacts of a run without a stopper."""


@dataclass(frozen=True)
class PortLift:
    """The lift of one land of a seat with several.

    Attributes:
        name: of the land.
        lift: (n + 1,) mean opening over it [m].
        rim: length of its rim towards the port [m].
        area: of the port, or its share of a port that it seals with another one [m^2].
        share: of a port, 1/2 where two lands seal it.
    """

    name: str
    lift: Array
    rim: float
    area: float
    share: float = 1.0


class WingTable(Table, ResultSource):
    """A table that a wing adds to scenes: a subclass of `Drive` or `Assessment` with a ``table``."""

    table: ClassVar[str]
    """Its key in a scene; keys of summary.json begin with it."""
    description: ClassVar[str]
    file_tables: ClassVar[Mapping[str, type[Table]]] = MappingProxyType({})
    """Its keys that name TOML files, and the tables in these."""
    land_rows: ClassVar[Mapping[str, str]] = MappingProxyType({})
    """Ends of its keys for land number n of a seat with several, `TABLE_land_n_END`, and their words."""

    @classmethod
    def complete(cls, scene: Mapping[str, Any]) -> Mapping[str, Any]:
        """Return the tables of a scene file with keys that follow from this one."""
        return scene

    @abstractmethod
    def check(self, scene: Scene) -> Contradictions:
        """Yield the keys of this table that contradict others of the ``scene``, with the reasons."""


class Drive(WingTable):
    """A table of a scene that loads the reed by its opening, as a gas does: a subclass. Absent, it does nothing."""

    @property
    @abstractmethod
    def longest_step(self) -> float:
        """Return the longest time step with which it follows the reed [s]."""

    @abstractmethod
    def describe_step(self, step: float) -> str:
        """Return what is wrong with a ``step`` above the longest [s]."""

    @property
    @abstractmethod
    def label(self) -> tuple[str, float, float]:
        """Return the words for it in a drawing of the scene, and the range of x on which it acts [m]."""

    @abstractmethod
    def loads(self, reed: Structure, body: bodies.Body, ports: Sequence[Array] = ()) -> Iterator[bodies.Load]:
        """Yield its loads on the ``body`` of a ``reed``; ``ports``: (n, 2) points all over each of several ports, from
        the centre of the contact [m]."""

    def check_ports(self, count: int) -> Contradictions:
        """Yield the keys that contradict the number of ports of the seat, with the reasons."""
        yield from ()

    @abstractmethod
    def notes(self) -> tuple[str, ...]:
        """Return notes for the reader of a run."""

    @abstractmethod
    def follow(
        self,
        lift: Array,
        dt: float,
        duration: float,
        ports: Sequence[PortLift] = (),
        stops: Array = NO_STOPS,
    ) -> DriveRun:
        """Return its course in a run of this ``duration`` [s], with the (n + 1,) ``lift`` of the reed [m] at steps
        ``dt`` [s]; ``ports``: the lift over each land of a seat with several; ``stops``: when contacts with a stopper
        begin [s]."""


class DriveRun:
    """The course of a `Drive` in a run."""

    @abstractmethod
    def values(self) -> dict[str, float]:
        """Return its results with error bars, by `cycle_name`."""

    @abstractmethod
    def keys(self) -> dict[str, object]:
        """Return its keys of summary.json."""

    @abstractmethod
    def write(self, folder: Path) -> Path:
        """Write its histories into the ``folder`` of the run, and return the file."""

    @abstractmethod
    def picture(self, title: str, stop: float) -> tuple[str, Callable[[Path], None]]:
        """Return the file name of its picture, and the function that draws it; ``stop``: lift at the stopper [m], nan
        without one."""


class Assessment(WingTable):
    """A table of a scene that asks for results of a finished run, as a fatigue life: a subclass."""

    @property
    @abstractmethod
    def needs_reed_stress(self) -> bool:
        """Return whether it needs the stress in the reed."""

    @property
    @abstractmethod
    def needs_whole_contact(self) -> bool:
        """Return whether it needs a contact without parts across a lip."""

    @abstractmethod
    def assess(self, run: Any) -> Assessed:
        """Return its results for a `seatfem.study.runs.afterwards.FinishedRun`."""


@dataclass(frozen=True)
class Assessed:
    """Results of an `Assessment`.

    Attributes:
        keys: entries of summary.json.
        files: files that were written.
        notes: sentences for the reader of the run.
        pictures: function that returns the file names of its pictures, with the functions that draw them.
    """

    keys: Mapping[str, object]
    files: tuple[Path, ...]
    notes: tuple[str, ...]
    pictures: Callable[[], list[tuple[str, Callable[..., object]]]]


def drives() -> tuple[type[Drive], ...]:
    """Return all tables by which wings load the reed."""
    import_all(WINGS)
    return tuple(Drive.__subclasses__())


def assessments() -> tuple[type[Assessment], ...]:
    """Return all tables by which wings assess a finished run."""
    import_all(WINGS)
    return tuple(Assessment.__subclasses__())


def tables_of_wings() -> tuple[type[WingTable], ...]:
    """Return all tables that wings add to scenes."""
    return (*drives(), *assessments())


def tables_in_files() -> Mapping[str, type[Table]]:
    """Return the tables in TOML files that keys of wings name, by dotted key."""
    return {f"{each.table}.{key}": file for each in tables_of_wings() for key, file in each.file_tables.items()}


def longest_step(present: tuple[Drive, ...]) -> float:
    """Return the longest time step with which all of these follow the reed [s]; inf without any."""
    return min((each.longest_step for each in present), default=math.inf)


CYCLE = " cycle "


def cycle_name(key: str, cycle: int) -> str:
    """Return the name, among the values of a run, of the value of a list in summary.json for one cycle."""
    return f"{key}{CYCLE}{cycle}"
