"""A body known by a measured frequency response."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar, Final, Literal

import numpy as np
from pydantic import Field

from impact.progress import Progress
from seatfem.fields import ExistingFile, Tolerance, default
from seatfem.machine.stopwatch import Stopwatch
from seatfem.structures.estimates.surrogate import Face, Surrogate, unknown
from seatfem.structures.inspection.opened import FileState, opened, state_of
from seatfem.structures.kinds.modes import Direction
from seatfem.structures.kinds.motion import Moving
from seatfem.structures.kinds.record_columns import ResponseColumns, ResponseUnits, stated_in
from seatfem.structures.kinds.structure import Finding
from seatfem.structures.method import Method
from seatfem.structures.solved import Solved

if TYPE_CHECKING:
    from impact.measured.frf import FrequencyResponse
    from impact.measured.pole_fit import PoleFit

Kind = Literal["receptance", "mobility", "accelerance"]
UNIVERSAL: Final = (".uff", ".unv")


class FrequencyResponseFile(Moving):
    """A measured frequency response of the contact: poles are fitted to it."""

    group: ClassVar[str] = "imported"
    sample: ClassVar[str] = """
file = "response.csv"
"""

    kind: Literal["frf"]
    file: ExistingFile = Field(description="CSV file with quantities and units in its header, or a universal file (58)")
    node: int | None = Field(None, strict=True, description="of a universal file: number of the contact's node")
    direction: Direction = Field("+z", description="of a universal file: outward normal of the contact")
    tolerance: Tolerance = default("1 %", "misfit of the poles beyond the noise of the record")
    free: bool | None = Field(None, description="whether the body is free to move; found from the record if absent")
    quantity: Kind | None = Field(None, description="measured quantity, where neither heads nor units state it")
    columns: ResponseColumns | None = Field(None, description="heads of the columns, where they do not say their role")
    units: ResponseUnits | None = Field(None, description="units of the columns, where the header does not say them")
    averages: int | None = Field(
        None,
        ge=1,
        strict=True,
        description="number of averaged hammer blows; with the column of coherence it gives the noise",
    )

    def problems(self) -> Iterator[Finding]:
        yield from opened(self.measured, {"file": self.file})

    def measured(self) -> FrequencyResponse:
        """Return the measured response of the contact, read once in a process.

        Raises:
            FrequencyResponseError: what `read_frf` raises; a universal file without a node.
            UffError, OSError: as the readers.
        """
        return _read(self._record)

    @property
    def _record(self) -> _Record:
        columns, units = (tuple(stated_in(roles).items()) for roles in (self.columns, self.units))
        state = state_of(self.file)
        return _Record(self.file, self.node, self.direction, self.averages, self.quantity, columns, units, state)

    def surrogate(self, duration: float, face: Face) -> Surrogate:
        return unknown("poles are fitted to the response by the run", face)

    def solve(
        self, method: Method, duration: float, watch: Stopwatch, progress: Progress, *, mesh_error: bool = True
    ) -> Solved:
        with watch("pole fit"):
            return Solved(self.fit().greens, about={"seat_model": f"poles fitted to {self.file.name}"})

    def fit(self) -> PoleFit:
        return _fit(self._record, self.tolerance, self.free)


@dataclass(frozen=True)
class _Record:
    """The files that a record is read from, and the state of its file."""

    file: Path
    node: int | None
    direction: Direction
    averages: int | None
    quantity: Kind | None
    columns: tuple[tuple[str, str], ...]
    units: tuple[tuple[str, str], ...]
    state: FileState


@lru_cache(maxsize=2)
def _read(record: _Record) -> FrequencyResponse:
    from impact.measured.frf import FrequencyResponseError, read_frf  # of such bodies only
    from seatfem.structures.formats.uff import read_frf_uff

    if record.file.suffix.lower() not in UNIVERSAL:
        columns, units = dict(record.columns), dict(record.units)
        quantity, averages = record.quantity, record.averages
        return read_frf(record.file, columns=columns, units=units, quantity=quantity, averages=averages)
    if record.node is None:
        raise FrequencyResponseError(f"{record.file}: a universal file needs seat.node, the contact's node number")
    return read_frf_uff(record.file, ports={"contact": (record.node, record.direction)})


@lru_cache(maxsize=2)
def _fit(record: _Record, tolerance: float, free: bool | None) -> PoleFit:
    from impact.measured.frf import FrequencyResponseError  # of such bodies only
    from impact.measured.pole_fit import fit_response

    response, file = _read(record), record.file
    try:
        return fit_response(response, tolerance=tolerance, free=free)
    except FrequencyResponseError as problem:
        raise FrequencyResponseError(f"{file}: {problem}") from problem
    except np.linalg.LinAlgError as problem:
        raise FrequencyResponseError(
            f"{file}: no poles can be fitted ({problem}): some values are beyond all measure; check the units"
        ) from problem
