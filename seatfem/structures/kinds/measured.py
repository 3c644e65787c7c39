"""Bodies by a measured frequency response, to which poles are fitted."""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any, ClassVar, Final, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from impact import notices
from impact.greens import base
from impact.measured import frf, pole_fit
from impact.pictures import fit_plots
from seatfem.fields import ExistingFile, KeyProblem, Tolerance, default
from seatfem.structures.fits import fit_of
from seatfem.structures.formats import uff_responses
from seatfem.structures.formats.uff import Direction, System
from seatfem.structures.inspection.cad import opened, read_once
from seatfem.structures.kinds import structure
from seatfem.structures.kinds.motion import Moving, ResponseColumns, ResponseUnits
from seatfem.structures.method import Solved, Task
from seatfem.units import write_quantity

UNIVERSAL: Final = (".uff", ".unv", ".58", ".uf", ".ufb")
OF_CSV: Final = ("columns", "averages")
OF_UNIVERSAL: Final = ("node", "direction", "system")
"""Keys of a frequency response that only one of two kinds of file takes."""


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
    quantity: Literal["receptance", "mobility", "accelerance"] | None = Field(
        None, description="measured quantity, where neither heads nor units state it"
    )
    columns: ResponseColumns = default({}, "heads of the columns, where they do not say their role")
    units: ResponseUnits = default({}, "units of the columns, or of a universal file, where these do not say them")
    system: System | None = Field(None, description="units of a universal file, in place of those that it states")
    averages: int | None = Field(
        None,
        ge=1,
        strict=True,
        description="number of averaged hammer blows; with the column of coherence it gives the noise",
    )

    @model_validator(mode="after")
    def _keys_of_the_file(self) -> Self:
        is_universal = self.file.suffix.lower() in UNIVERSAL
        others, words = (OF_CSV, "CSV files") if is_universal else (OF_UNIVERSAL, "universal files")
        for key in others:
            if key in self.model_fields_set and getattr(self, key) is not None:
                raise KeyProblem(key, f"is for {words}, {self.file.name} is none; remove the key")
        if is_universal and self.node is None:
            raise KeyProblem("node", f"{self.file.name} is a universal file; state the number of the contact's node")
        return self

    def problems(self) -> Iterator[structure.Finding]:
        yield from opened(self.response, {"file": self.file})

    def file_notes(self) -> tuple[str, ...]:
        read_as = self.response().origin.get("read_as")
        return () if read_as is None else (f"read as {read_as}",)

    def counted(self) -> str:
        frequency = self.response().frequency
        first, last = (write_quantity(float(end), "frequency") for end in (frequency[0], frequency[-1]))
        return f"response at {len(frequency)} frequencies, {first} to {last}"

    def other_fits(self) -> tuple[base.GreensFunction, ...]:
        return tuple(self.fit().draws)

    def fit_advice(self, role: str, greens: base.GreensFunction) -> Iterator[notices.Advice]:
        """Yield advice if the misfit of the record exceeds its noise, with the frequency ranges."""
        fit = fit_of(greens)
        remedy = f"leave these lines out, state {role}.free = true for a free body, or measure a wider band"
        reason = "it is not the response of a linear, passive body with all its modes within the band"
        words = pole_fit.describe_ranges(list(fit.ranges))
        if fit.unexplained > fit.allowed:
            what = f"part of the {role}'s record that its poles miss beyond the noise"
            where = f", most of it {words}" if words else ""
            yield notices.Advice(what, fit.unexplained, fit.allowed, f"{reason}{where}", remedy)
        elif fit.ranges:
            what = f"largest misfit of the {role}'s poles over the noise of the record"
            limit = math.sqrt(pole_fit.BLOCK_LIMIT)
            yield notices.Advice(what, fit.worst, limit, f"{reason} {words}", remedy)

    def fit_pictures(self, greens: base.GreensFunction, width: float) -> list[structure.Picture]:
        response, fit, fitted = self.response(), self.fit(), greens.modal or greens.pole_sum
        if fitted is None:
            return []
        drawn: list[structure.Picture] = [
            ("fit.png", lambda path: fit_plots.plot_fit(response, fitted, path, width=width))
        ]
        if len(fit.tried) > 1:
            drawn.append(("stabilisation.png", partial(fit_plots.plot_stabilisation, response, fit.tried)))
        return drawn

    def response(self) -> frf.FrequencyResponse:
        """Return the measured response of the contact, cached in the process.

        Raises:
            FrequencyResponseError, UffError, OSError: an error of the readers.
        """
        return read_once(_record, self._reading)

    @property
    def _reading(self) -> tuple[Any, ...]:
        columns, units = (tuple(roles.stated().items()) for roles in (self.columns, self.units))
        return self.file, self.node, self.direction, self.averages, self.quantity, columns, units, self.system

    def solve(self, task: Task) -> Solved:
        with task.watch("pole fit"):
            return Solved(self.fit().greens, about={"seat_model": f"poles fitted to {self.file.name}"})

    def fit(self) -> pole_fit.PoleFit:
        return read_once(_fitted, (self._reading, self.tolerance, self.free), self.file)


def _record(
    file: Path,
    node: int,
    direction: Direction,
    averages: int | None,
    quantity: Any,
    columns: Any,
    units: Any,
    system: System | None,
) -> frf.FrequencyResponse:
    if file.suffix.lower() not in UNIVERSAL:
        columns, units, quantity = dict(columns), dict(units), quantity or ""
        return frf.read_frf(file, columns=columns, units=units, quantity=quantity, averages=averages or 0)
    ports = {"contact": (node, direction)}
    return uff_responses.read_frf_uff(file, ports=ports, system=system, units=dict(units), quantity=quantity)


def _fitted(arguments: tuple[Any, ...], tolerance: float, free: bool | None) -> pole_fit.PoleFit:
    file = arguments[0]
    response = read_once(_record, arguments)
    try:
        return pole_fit.fit_response(response, tolerance=tolerance, free=free)
    except frf.FrequencyResponseError as problem:
        raise frf.FrequencyResponseError(f"{file}: {problem}") from problem
    except np.linalg.LinAlgError as problem:
        raise frf.FrequencyResponseError(
            f"{file}: no poles can be fitted ({problem}): some values are beyond all measure; check the units"
        ) from problem
