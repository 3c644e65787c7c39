"""Speed of this computer: rates measured by `seatfem doctor --calibrate`, or those of a common one."""

from __future__ import annotations

import json
import math
import os
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Self

from impact.files.atomic import whole_file
from seatfem.machine.code import cache_folder

SCHEMA = 1  # of the file; raise it when a rate comes to mean something else
FILE = "machine.json"


class MachineError(ValueError):
    """A calibration that cannot be used; the message names file, key and remedy."""


@dataclass(frozen=True)
class Machine:
    """Seconds for one unit of each kind of work.

    Attributes:
        start: of the program, from the command to the first stage.
        compiled: code fetched from the cache when it is first called.
        meshing_start: of a gmsh process.
        element: a tetrahedron of order 2, made, read and checked.
        entry: an entry of a stiffness matrix, assembled.
        factor_start: of any factorization.
        factor: of a factorization, over unknowns^1.47.
        solve: with a factor, over unknowns^(4/3).
        product: an entry of the stiffness matrix, in all products that a Krylov vector takes.
        inner: an unknown in the inner product of two Krylov vectors, twice.
        check: of the error, for each Krylov vector.
        pole: a pole at one time step, marched and replayed.
        step: a time step beside its poles, with its measures.
        stress: a time step and mode of the reed, in the search for the largest stress.
        value: a number written to a compressed file.
        sheet: a picture of curves.
        view: a picture of a body, rendered.
        face: a triangle of it.
        origin: where the rates are from, in words.
    """

    start: float = 2.0
    compiled: float = 0.12
    meshing_start: float = 0.17
    element: float = 8.0e-5
    entry: float = 6.5e-8
    factor_start: float = 0.01
    factor: float = 9.0e-8
    solve: float = 7.7e-9
    product: float = 1.13e-8
    inner: float = 1.2e-9
    check: float = 6.0e-4
    pole: float = 1.7e-9
    step: float = 2.2e-7
    stress: float = 2.5e-9
    value: float = 5.9e-8
    sheet: float = 0.22
    view: float = 0.12
    face: float = 1.2e-5
    origin: str = "default rates; seatfem doctor --calibrate measures this computer's"

    def __post_init__(self) -> None:
        for name, value in self.rates().items():
            if not (math.isfinite(value) and value > 0):
                raise MachineError(f"{name} = {value}: a rate must be positive and finite")

    def rates(self) -> dict[str, float]:
        """Return the seconds of each rate by name."""
        return {key: value for key, value in asdict(self).items() if key != "origin"}

    @classmethod
    def known(cls) -> Self:
        """Return the rates measured on this computer, or the default ones.

        Raises:
            MachineError: the file is there and damaged.
        """
        path = calibration_file()
        return cls.load(path) if path.is_file() else cls()

    @classmethod
    def load(cls, path: Path) -> Self:
        """Read what `save` wrote.

        Raises:
            MachineError: damaged, or of another schema.
        """
        remedy = f"measure again with seatfem doctor --calibrate, or delete {path}"
        try:
            data = json.loads(path.read_text(encoding="utf-8"))
            schema, rates = data["schema"], {key: float(value) for key, value in data["rates"].items()}
        except (
            OSError,
            ValueError,
            LookupError,
            TypeError,
            AttributeError,
            ArithmeticError,
            RecursionError,
        ) as problem:
            raise MachineError(f"{path}: no calibration can be read from it ({problem}); {remedy}") from problem
        wanted = {field.name for field in fields(cls)} - {"origin"}
        if schema != SCHEMA or set(rates) != wanted:
            raise MachineError(f"{path}: is of another version of the program; {remedy}")
        try:
            return cls(**rates, origin=f"rates measured on this computer, {path}")
        except MachineError as problem:
            raise MachineError(f"{path}: {problem}; {remedy}") from problem

    def save(self, path: Path) -> None:
        """Write the rates; the file is whole or absent."""
        data = {"schema": SCHEMA, "rates": self.rates()}
        with whole_file(path) as temporary:
            temporary.write_text(json.dumps(data, indent=1) + "\n", encoding="utf-8")


def calibration_file() -> Path:
    """Return the path of the rates, beside the Green's functions that are kept."""
    return cache_folder() / FILE


def cores() -> int:
    """Return the number of cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
