"""Rates of this computer for every kind of work, available memory, and wall time by stage.

The memory limit of a container is that of a control group, which /proc/meminfo does not contain; that of a batch system
or a shell (``ulimit -v``) is that of the process's address space.
"""

import json
import math
import os
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass, field, fields
from pathlib import Path, PurePosixPath
from typing import Final, Self

import psutil

from impact.files.safe_files import whole_file
from seatfem.machine.code import cache_folder

if sys.platform != "win32":
    import resource


SCHEMA = 1  # version of the file's format; raise it when the meaning of a rate changes
FILE = "machine.json"


class MachineError(ValueError):
    """Error of a calibration file that cannot be used; the message names file, key and remedy."""


@dataclass(frozen=True)
class Machine:
    """Time per unit of each kind of work [s].

    Attributes:
        start: start of the program, from the command to the first stage.
        compiled: loading of compiled code from the cache at its first call.
        meshing_start: start of a gmsh process.
        element: a tetrahedron of order 2, meshed, read and checked.
        entry: an entry of a stiffness matrix, assembled.
        factor_start: fixed time of any factorization.
        factor: a factorization, over unknowns^1.47.
        solve: a solution with a factor, over unknowns^(4/3).
        product: an entry of the stiffness matrix, in all products that a Krylov vector takes.
        inner: an unknown in the inner product of two Krylov vectors, twice.
        check: the error estimate for each Krylov vector.
        pole: a pole in one time step, integrated and evaluated again for the energies.
        step: a time step without its poles, with its measures.
        stress: a time step and mode of the reed, in the search for the largest stress.
        value: a number written to a compressed file.
        sheet: a picture of curves.
        view: a picture of a body, rendered.
        face: a triangle of such a picture.
        origin: source of the rates, in words.
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
        """Return the rates measured on this computer, or the defaults.

        Raises:
            MachineError: the calibration file is damaged.
        """
        path = calibration_file()
        return cls.load(path) if path.is_file() else cls()

    @classmethod
    def load(cls, path: Path) -> Self:
        """Return the rates in a file written by `save`.

        Raises:
            MachineError: the file is damaged, or of another version of the format.
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
        expected = {field.name for field in fields(cls)} - {"origin"}
        if schema != SCHEMA or set(rates) != expected:
            raise MachineError(f"{path}: is of another version of the program; {remedy}")
        try:
            return cls(**rates, origin=f"rates measured on this computer, {path}")
        except MachineError as problem:
            raise MachineError(f"{path}: {problem}; {remedy}") from problem

    def save(self, path: Path) -> None:
        """Write the rates to a file, complete or not at all."""
        data = {"schema": SCHEMA, "rates": self.rates()}
        with whole_file(path) as temporary:
            temporary.write_text(json.dumps(data, indent=1) + "\n", encoding="utf-8")


def calibration_file() -> Path:
    """Return the path of the calibration file, in the folder of stored Green's functions."""
    return cache_folder() / FILE


def cores() -> int:
    """Return the number of cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


ROOT: Final = Path("/")
_LIMITS: Final = {
    "": (("memory.max", "memory.high"), "memory.current", "inactive_file"),  # version 2
    "memory": (("memory.limit_in_bytes",), "memory.usage_in_bytes", "total_inactive_file"),  # version 1
}
"""Files of limits, file of the usage, and the row of memory.stat for cached files, of each controller."""


def available_memory(root: Path = ROOT) -> float:
    """Return the memory available without swapping and within all limits [bytes]; infinite if none is reported.

    ``root``: folder that contains /proc and /sys, in which Linux reports control groups.
    """
    return max(0.0, min(_of_the_machine(), _of_the_address_space(), *_of_control_groups(root)))


def peak_memory() -> float:
    """Return the largest resident memory of this process so far [bytes]; on Linux from /proc, of this program only."""
    try:
        status = Path("/proc/self/status").read_text(encoding="ascii")
        return 1024.0 * int(status.partition("VmHWM:")[2].split()[0])
    except (OSError, IndexError):
        pass
    if sys.platform == "win32":
        return math.nan
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * (1.0 if sys.platform == "darwin" else 1024.0)


def _of_the_machine() -> float:
    try:
        return float(psutil.virtual_memory().available)
    except (OSError, RuntimeError, ValueError, LookupError):  # no /proc, or one that psutil cannot read
        return math.inf


def _of_the_address_space() -> float:
    """Return RLIMIT_AS minus the mapped memory [bytes]; infinite without a limit."""
    if sys.platform == "win32":
        return math.inf
    limit, _ = resource.getrlimit(resource.RLIMIT_AS)
    if limit == resource.RLIM_INFINITY:
        return math.inf
    return float(limit - psutil.Process().memory_info().vms)


def _of_control_groups(root: Path) -> Iterator[float]:
    """Yield the available memory [bytes] of this process's control group and of its parents, whose limits apply, too.

    A container may name its group as the host does, but see it as the top: groups that do not exist are skipped.
    """
    yield math.inf
    with suppress(OSError, ValueError):
        for line in (root / "proc/self/cgroup").read_text(encoding="utf-8").splitlines():
            controllers, _, name = line.partition(":")[2].partition(":")
            if controllers and "memory" not in controllers.split(","):
                continue
            controller = "memory" if controllers else ""
            top = root / "sys/fs/cgroup" / controller
            inner = PurePosixPath("" if ".." in name.split("/") else name.lstrip("/"))
            yield from (_left(top / group, *_LIMITS[controller]) for group in (inner, *inner.parents))


def _left(group: Path, limits: tuple[str, ...], use: str, cached: str) -> float:
    """Return the group's limit minus its usage [bytes]; memory of cached files is available."""
    limit = min((_number(group / name) for name in limits), default=math.inf)
    if math.isinf(limit):
        return math.inf
    used = _number(group / use)
    return limit - max(0.0, used - _row(group / "memory.stat", cached)) if math.isfinite(used) else limit


def _number(file: Path) -> float:
    """Return the bytes that a file states; infinite for "max", or if there is no such file."""
    with suppress(OSError, ValueError):
        return float(file.read_text(encoding="ascii").strip().replace("max", "inf"))
    return math.inf


def _row(file: Path, name: str) -> float:
    with suppress(OSError, ValueError):
        rows = (line.split() for line in file.read_text(encoding="ascii").splitlines())
        return float(next((row[1] for row in rows if len(row) == 2 and row[0] == name), "0"))
    return 0.0


@dataclass(frozen=True)
class Stopwatch:
    """Wall time by stage [s]: ``with watch("mesh"): ...``; times of stages with the same name are added."""

    stages: dict[str, float] = field(default_factory=dict)

    @contextmanager
    def __call__(self, stage: str) -> Iterator[None]:
        start = time.perf_counter()
        try:
            yield
        finally:
            self.stages[stage] = self.stages.get(stage, 0.0) + time.perf_counter() - start
