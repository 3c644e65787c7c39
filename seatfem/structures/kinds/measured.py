"""Bodies from files: Green's functions, measured frequency responses, modes, matrices, and columns of CSV files."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Final, Literal, Self, TypeVar

import numpy as np
import scipy
from pydantic import Field, model_validator
from threadpoolctl import threadpool_limits

from impact import notices
from impact.files import csv_table, safe_files
from impact.greens import base, modal
from impact.greens.base import Array
from impact.measured import pole_fit
from impact.measured.frf import FrequencyResponseError, read_frf
from impact.storage import hdf5
from seatfem.fields import ExistingFile, KeyProblem, Tolerance, default
from seatfem.machine.resources import Stopwatch
from seatfem.structures import finite_elements, rings
from seatfem.structures import model as models
from seatfem.structures.formats import matrices
from seatfem.structures.formats.uff import Direction, System, read_frf_uff, read_modes_uff
from seatfem.structures.inspection.cad import FileState, opened, state_of
from seatfem.structures.kinds import elastic, structure
from seatfem.structures.kinds.motion import Moving, ResponseColumns, ResponseUnits, stated_in
from seatfem.structures.method import Method, Solved
from seatfem.units import UnitError, parse_quantity, write_quantity

if TYPE_CHECKING:
    from scipy.spatial import Delaunay

    from impact.measured.frf import FrequencyResponse
    from impact.measured.pole_fit import PoleFit

LARGEST: Final = 50 * safe_files.MB  # largest file


class ColumnsError(ValueError):
    """A table that cannot be used; the message names file, line and remedy."""


def read_columns(path: Path, known: Mapping[str, str], needed: tuple[str, ...]) -> dict[str, Array]:
    """Return the columns of a CSV file, (n,) each, in SI.

    Args:
        path: CSV file; lines that begin with # are skipped.
        known: name -> dimension (`seatfem.units.DIMENSIONS`) of the permitted columns; "" for pure numbers.
        needed: names of the required columns.

    Raises:
        ColumnsError: an unknown or missing column, a missing unit, or a row with other than finite numbers.
    """
    table = csv_table.read_csv(path, ColumnsError, most=LARGEST)
    wanted = ",".join(f"{name} [unit]" if dimension else name for name, dimension in known.items())
    if table is None or not table.rows:
        raise ColumnsError(f"{path}: no table; a header such as {wanted} and rows of numbers are needed")
    scales: dict[str, float] = {}
    for head in table.heads:
        if head.name not in known or head.name in scales or bool(head.unit) != bool(known[head.name]):
            raise ColumnsError(f"{path}:{table.head_line}: column {head.text[:80]!r}; known are {wanted}, once each")
        try:
            unit = csv_table.normal_unit(head.unit)
            scales[head.name] = parse_quantity(f"1 {unit}", known[head.name]) if unit else 1.0
        except UnitError as error:
            raise ColumnsError(f"{path}:{table.head_line}: column {head.text[:80]!r}: {error}") from error
    if missing := [name for name in needed if name not in scales]:
        raise ColumnsError(f"{path}:{table.head_line}: add a column {missing[0]}; the header is {table.header}")
    values = table.numbers()
    return {name: scale * values[:, k] for k, (name, scale) in enumerate(scales.items())}


def check_scattered(path: Path, table: Mapping[str, Array]) -> None:
    """Raise `ColumnsError` where the points x, y of a table lie on one line."""
    if np.linalg.matrix_rank(np.column_stack([table["x"], table["y"], np.ones_like(table["x"])])) < 3:
        raise ColumnsError(f"{path}: its points lie on one line; three that do not are needed")


def between(table: Mapping[str, Array], name: str, points: Array) -> Array:
    """Return the (n,) values of a column at points (n, 2), interpolated linearly in triangles; nan outside."""
    with threadpool_limits(limits=1, user_api="blas"):  # systems of 2 unknowns: 100 times slower with threads
        triangles = _triangulate(np.column_stack([table["x"], table["y"]]).tobytes())
        return np.asarray(scipy.interpolate.LinearNDInterpolator(triangles, table[name])(points))


@lru_cache(maxsize=2)
def _triangulate(points: bytes) -> Delaunay:
    """Return the triangles between points (n, 2)."""
    return scipy.spatial.Delaunay(np.frombuffer(points).reshape(-1, 2))


UNIVERSAL: Final = (".uff", ".unv", ".58", ".uf", ".ufb")
OF_CSV: Final = ("columns", "averages")
OF_UNIVERSAL: Final = ("node", "direction", "system")
"""Keys of a frequency response that only one of two kinds of file takes."""
Made = TypeVar("Made")


def read_once(read: Callable[..., Made], arguments: tuple[Any, ...], *files: Path) -> Made:
    """Return ``read(*arguments)``, cached in the process while the files are unchanged."""
    result: Made = _read(read, arguments, tuple(state_of(file) for file in files))
    return result


@lru_cache(maxsize=8)
def _read(read: Callable[..., Any], arguments: tuple[Any, ...], states: tuple[FileState, ...]) -> Any:
    del states  # part of the cache key
    return read(*arguments)


class GreensFile(Moving):
    """A Green's function computed or measured before."""

    group: ClassVar[str] = "imported"
    traits: ClassVar[structure.Traits] = replace(Moving.traits, has_rings=True)

    sample: ClassVar[str] = """
file = "seat.h5"
"""

    kind: Literal["greens"]
    file: ExistingFile = Field(description="the Green's function file, relative to the scene's folder")

    def problems(self) -> Iterator[structure.Finding]:
        yield from opened(self._read, {"file": self.file})

    def _read(self) -> base.GreensFunction:
        return hdf5.load_greens(self.file)

    def function(self, duration: float) -> base.GreensFunction:
        """Return the function in the file; raises `GreensFunctionError` if it ends before ``duration`` [s]."""
        greens = self._read()
        if greens.valid_for < duration * (1 - 1e-9):
            lasts, known = write_quantity(duration, "time"), write_quantity(greens.valid_for, "time", 6)
            raise base.GreensFunctionError(
                f"seat.file = {self.file.name}: the run lasts {lasts} (run.duration) but g is known up to {known}; "
                "shorten the run to that, or make the file anew for all of it (seatfem greens, with this "
                "run.duration), or from a longer record"
            )
        return greens

    def solve(
        self, method: Method, duration: float, watch: Stopwatch, progress: notices.Progress, *, mesh_error: bool = True
    ) -> Solved:
        greens = self.function(duration)
        combined = greens if method.rings is None else rings.with_fewer_rings(greens, method.rings)
        return Solved(combined, about={"seat_model": f"Green's function from {self.file.name}"})


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
    columns: ResponseColumns | None = Field(None, description="heads of the columns, where they do not say their role")
    units: ResponseUnits | None = Field(
        None, description="units of the columns, or of a universal file, where these do not say them"
    )
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

    @property
    def measured(self) -> structure.Measured | None:
        return self

    def draws(self) -> tuple[base.GreensFunction, ...]:
        return tuple(self.fit().draws)

    def counted(self) -> str:
        frequency = self.response().frequency
        first, last = (write_quantity(float(f), "frequency") for f in (frequency[0], frequency[-1]))
        return f"response at {len(frequency)} frequencies, {first} to {last}"

    def response(self) -> FrequencyResponse:
        """Return the measured response of the contact, cached in the process.

        Raises:
            FrequencyResponseError, UffError, OSError: an error of the readers.
        """
        return read_once(_record, self._reading, self.file)

    @property
    def _reading(self) -> tuple[Any, ...]:
        columns, units = (tuple(stated_in(roles).items()) for roles in (self.columns, self.units))
        return self.file, self.node, self.direction, self.averages, self.quantity, columns, units, self.system

    def solve(
        self, method: Method, duration: float, watch: Stopwatch, progress: notices.Progress, *, mesh_error: bool = True
    ) -> Solved:
        with watch("pole fit"):
            return Solved(self.fit().greens, about={"seat_model": f"poles fitted to {self.file.name}"})

    def fit(self) -> PoleFit:
        return read_once(_fitted, (self._reading, self.tolerance, self.free), self.file)


class UniversalModes(Moving):
    """Measured or computed modes in a universal file (dataset 55)."""

    group: ClassVar[str] = "imported"
    sample: ClassVar[str] = """
file = "modes.unv"
node = 1
direction = "+z"
"""

    kind: Literal["modes"]
    file: ExistingFile = Field(description="the universal file")
    node: int = Field(strict=True, description="number of the contact's node")
    direction: Direction = Field(description="outward normal of the contact")
    system: System | None = Field(None, description="units of the file, in place of those that it states")
    modal_mass: float | None = Field(
        None,
        gt=0,
        strict=True,
        description="modal mass of all modes in the file's unit of mass, in place of those in the file: 1 for "
        "mass-normalised shapes",
    )

    def problems(self) -> Iterator[structure.Finding]:
        yield from opened(self.function, {"file": self.file})

    def function(self) -> modal.ModalGreens:
        """Return the modes in the file, cached in the process. Raises `UffError`, `OSError`."""
        return read_once(_modes, (self.file, self.node, self.direction, self.system, self.modal_mass), self.file)

    def solve(
        self, method: Method, duration: float, watch: Stopwatch, progress: notices.Progress, *, mesh_error: bool = True
    ) -> Solved:
        return Solved(self.function(), about={"seat_model": f"modes from {self.file.name}"})


class Matrices(elastic.Reduced):
    """Mass, stiffness and damping matrices of another finite element program (.mtx, .npz, .npy)."""

    group: ClassVar[str] = "imported"
    sample: ClassVar[str] = """
mass = "mass.mtx"
stiffness = "stiffness.mtx"
contact = "contact.csv"
damping_ratio = 0.02
"""

    kind: Literal["matrices"]
    mass: ExistingFile = Field(description="file of the mass matrix")
    stiffness: ExistingFile = Field(description="file of the stiffness matrix")
    damping: ExistingFile | None = Field(None, description="file of the damping matrix")
    contact: ExistingFile = Field(description="CSV file (dof,weight) of the contact face")
    system: Literal["SI", "mm-t-s", "mm-kg-ms", "inch-lbf-s"] = Field("SI", description="units of the files")
    first_dof: Literal[0, 1] = Field(1, description="number of the first unknown in the contact file")
    constrained: Literal["refuse", "drop"] = Field("refuse", description="what to do with held unknowns")

    def problems(self) -> Iterator[structure.Finding]:
        files = {"mass": self.mass, "damping": self.damping, "contact": self.contact, "stiffness": self.stiffness}
        yield from opened(self.system_of_equations, files)

    def system_of_equations(self) -> models.SecondOrderModel:
        """Return the model in the files, cached in the process. Raises `ModelError`, `OSError`."""
        files = (self.mass, self.stiffness, self.damping, self.contact)
        return read_once(_matrices, (*files, self.system, self.first_dof, self.constrained), *filter(None, files))

    def solve(
        self, method: Method, duration: float, watch: Stopwatch, progress: notices.Progress, *, mesh_error: bool = True
    ) -> Solved:
        with watch("reduction"):
            model = self.system_of_equations()
            try:
                reduction = finite_elements.reduced(self, model, method, duration, progress)
            except (models.ModelError, np.linalg.LinAlgError) as problem:
                raise models.ModelError(f"{self.stiffness}, {self.mass}: {problem}") from problem
        about = {"seat_model": f"matrices from {self.stiffness.name}", "seat_dof": model.size}
        return Solved(reduction.greens, model=model, modes=reduction.modes, about=about)


def _record(
    file: Path,
    node: int,
    direction: Direction,
    averages: int | None,
    quantity: Any,
    columns: Any,
    units: Any,
    system: System | None,
) -> FrequencyResponse:
    if file.suffix.lower() not in UNIVERSAL:
        return read_frf(file, columns=dict(columns), units=dict(units), quantity=quantity, averages=averages)
    ports = {"contact": (node, direction)}
    return read_frf_uff(file, ports=ports, system=system, units=dict(units), quantity=quantity)


def _fitted(arguments: tuple[Any, ...], tolerance: float, free: bool | None) -> PoleFit:
    file = arguments[0]
    response = read_once(_record, arguments, file)
    try:
        return pole_fit.fit_response(response, tolerance=tolerance, free=free)
    except FrequencyResponseError as problem:
        raise FrequencyResponseError(f"{file}: {problem}") from problem
    except np.linalg.LinAlgError as problem:
        raise FrequencyResponseError(
            f"{file}: no poles can be fitted ({problem}): some values are beyond all measure; check the units"
        ) from problem


def _modes(file: Path, node: int, direction: Direction, system: Any, modal_mass: float | None) -> modal.ModalGreens:
    return read_modes_uff(file, ports={"contact": (node, direction)}, system=system, modal_mass=modal_mass)


def _matrices(
    mass: Path, stiffness: Path, damping: Path | None, contact: Path, system: Any, first_dof: Any, constrained: Any
) -> models.SecondOrderModel:
    options = {"system": system, "first_dof": first_dof, "constrained": constrained}
    return matrices.read_matrices(mass, stiffness, damping, ports={"contact": contact}, **options)
