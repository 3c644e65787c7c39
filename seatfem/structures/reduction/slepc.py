"""The reductions of PETSc and SLEPc over MPI: factors by MUMPS and vectors in the memory of all ranks.

The ranks run `_slepc_ranks.py` in the interpreter of petsc4py; K, M and ports pass to it by files in a private folder,
commands by lines of JSON. The Krylov space, its growth and its error estimate are those of the built-in reduction;
modes come from SLEPc's spectrum slicing, which counts them by inertia so that none is missed.

Sources: P. Amestoy, I. Duff, J.-Y. L'Excellent and J. Koster, SIAM J. Matrix Anal. Appl. 23 (2001) 15 (MUMPS); V.
Hernandez, J. Roman and V. Vidal, ACM Trans. Math. Software 31 (2005) 351 (SLEPc); C. Campos and J. Roman, Numer.
Algorithms 60 (2012) 279 (spectrum slicing).
"""

from __future__ import annotations

import json
import shlex
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np

from impact.notices import Progress
from seatfem.jobs import folders, processes
from seatfem.machine.libraries import SCRIPT, PetscSetting, petsc_setting
from seatfem.structures.model import Array, SecondOrderModel
from seatfem.structures.reduction import eigen_search, krylov
from seatfem.structures.reduction.factorization import Factorization, FactorizationError
from seatfem.units import write_quantity

TAIL: Final = 12  # last lines of the ranks' log quoted in messages
PATIENCE: Final = 5.0  # time for the ranks to exit by themselves before they are killed [s]
START: Final = 120.0  # time for all ranks to read the model [s], plus one second for each 10 MB
EIGEN_TOLERANCE: Final = 1e-11  # relative tolerance of the eigenvalues (lambda - sigma)^-1
COUNTED: Final = 1e-3  # largest relative residual of the first solve at an indefinite shift, as in `eigen_search`
SPARE: Final = 1.2  # free disk space required over the size of the files
MEANINGS: Final = {
    -5: "not enough memory",
    -7: "not enough memory",
    -9: "not enough workspace",
    -10: "singular",
    -13: "not enough memory",
    -17: "a message larger than its buffer",
    -19: "not enough memory",
    -51: "more entries than 32-bit indices count in its ordering",
}
"""Meanings of MUMPS's INFOG(1). Source: MUMPS Users' Guide, "Error and warning diagnostics"."""


class RanksError(FactorizationError):
    """PETSc's ranks cannot be started, or ended without an answer; the message quotes the end of their log."""


@dataclass(frozen=True)
class Ranks:
    """The model in the memory of the ranks."""

    model: SecondOrderModel
    folder: Path
    worker: processes.LineWorker
    log: Path
    setting: PetscSetting

    def ask(self, do: str, /, **values: object) -> dict[str, Any]:
        """Return the answer to one command.

        Raises:
            RanksError: the ranks have ended, or have not answered in time.
        """
        try:
            line = self.worker.ask(json.dumps({"do": do, **values}), self.setting.seconds)
        except TimeoutError as late:
            raise RanksError(f"slepc: {late}; allow more by the environment variable SEATFEM_MPI_SECONDS") from late
        if not line:
            raise _ended(self.worker, self.log)
        return dict(json.loads(line))

    def give(self, name: str, array: Array) -> None:
        """Write the array for the ranks to read, as file ``name``.npy."""
        np.save(self.folder / f"{name}.npy", array)

    def take(self, name: str, shape: tuple[int, ...]) -> Array:
        """Return the array ``name`` written by the ranks. Raises `RanksError` if its shape is not ``shape``."""
        values: Array = np.load(self.folder / f"{name}.npy", mmap_mode="r", allow_pickle=False)
        if values.shape != shape or values.dtype != np.float64:
            raise RanksError(
                f"slepc: the ranks wrote {values.dtype} {values.shape} where {shape} was asked for; run it again"
            )
        return np.array(values)

    def factorize(self, square: float, *, definite: bool = True) -> Factorization:
        """Return the factorization of K + ``square`` M. Raises as `factorization.factorize`."""
        answer, n = self.ask("factorize", square=square), self.model.size
        name = f"K + s^2 M ({n} unknowns): mumps"
        if (failed := answer.get("mumps")) is not None:
            what = MEANINGS.get(failed[0], "failed")
            remedy = (
                ": hold what can move freely"
                if failed[0] == -10
                else ": use more ranks on more machines, or method='lanczos'"
            )
            raise FactorizationError(f"{name}: {what} (INFOG(1:2) = {failed[0]}, {failed[1]}){remedy}")
        if definite and answer["negative"]:
            raise FactorizationError(
                f"{name}: not positive definite: {answer['negative']} negative pivots; hold what can move freely"
            )
        if not answer["residual"] <= (1e-8 if definite else COUNTED):
            raise FactorizationError(
                f"{name}: the first solve leaves a residual of {answer['residual']:.1e}; use backend='auto'"
            )
        return Factorization(n, "mumps", answer["negative"], answer["residual"], self._solve)

    def _solve(self, right: Array) -> Array:
        columns = right.reshape(self.model.size, -1)
        self.give("right", columns)
        self.ask("solve")
        return self.take("left", columns.shape).reshape(right.shape)

    def basis(self, shift: float, limit: int) -> krylov.KrylovBasis:
        """Return a `KrylovBasis` whose vectors stay on the ranks."""
        return _Basis(self, shift, limit)

    def spectrum(self, progress: Progress) -> RanksSpectrum:
        """Return a `RanksSpectrum` of the model, with no eigenpairs yet."""
        return RanksSpectrum(self, progress)


@contextmanager
def on_ranks(model: SecondOrderModel) -> Iterator[Ranks]:
    """Start the ranks with the model in their memory; they are ended when the block is left, also by an exception.

    Raises:
        RanksError: no interpreter with petsc4py and slepc4py, no mpiexec, or too little disk space for the files.
    """
    try:
        setting = petsc_setting()
    except ValueError as problem:
        raise RanksError(f"slepc: {problem}") from problem
    gap, remedy = setting.gap()
    if gap:
        raise RanksError(f"slepc: {gap}; {remedy}")
    with folders.private_folder("slepc") as folder:
        size = _write(model, folder)
        log = folder / "log.txt"
        command = [*setting.launch, setting.python, str(SCRIPT), str(folder)]
        try:
            worker = processes.LineWorker(
                "seatfem.jobs.program",
                *command,
                log=log,
                own_session=True,
                environment=setting.environment,
                ready_within=START + size / 1e7,
            )
        except TimeoutError as late:
            raise RanksError(f"slepc: {shlex.join(command)}: {late}; check it by seatfem doctor") from late
        with worker:
            try:
                yield Ranks(model, folder, worker, log, setting)
            finally:
                worker.finish(PATIENCE)


def _write(model: SecondOrderModel, folder: Path) -> int:
    """Write K, M, ports and rigid motions; return their size in bytes. Raises `RanksError` if the disk is too full."""
    arrays: dict[str, Any] = {"ports": model.port_matrix, "rigid": eigen_search.rigid_shapes(model)}
    for name, matrix in (("K", model.K), ("M", model.M)):
        arrays |= {f"{name}_p": matrix.indptr, f"{name}_i": matrix.indices, f"{name}_x": matrix.data}
    size, room = sum(int(array.nbytes) for array in arrays.values()), shutil.disk_usage(folder).free
    if SPARE * size > room:
        raise RanksError(
            f"slepc: {folder.parent}: K, M and ports take {size / 1e9:.2g} GB, {room / 1e9:.2g} GB are free; set "
            "TMPDIR to a folder with more room, which all ranks see"
        )
    for name, array in arrays.items():
        np.save(folder / f"{name}.npy", array)
    return size


def _ended(worker: processes.LineWorker, log: Path) -> RanksError:
    code = worker.code()
    lines = [line for line in log.read_text(encoding="utf-8", errors="replace").splitlines() if line.strip("- \t")]
    cause = "" if code is None else f" by signal {-code}" if code < 0 else f" with exit code {code}"
    killed = "; 137 or signal 9: the system may have been out of memory" if code in (137, -9) else ""
    return RanksError(
        f"slepc: the ranks ended{cause}{killed}; check them by `seatfem doctor`\n" + "\n".join(lines[-TAIL:])
    )


class _Basis(krylov.KrylovBasis):
    """A `KrylovBasis` whose vectors stay on the ranks."""

    def __init__(self, ranks: Ranks, shift: float, limit: int) -> None:
        self.ranks, self.model, self.shift, self.limit = ranks, ranks.model, shift, limit
        self.factor = ranks.factorize(shift**2)
        compliance = np.array(ranks.ask("start", limit=limit)["compliance"])
        self.reciprocity = float(np.abs(compliance - compliance.T).max() / np.abs(compliance).max())
        self.rigid = self.size = eigen_search.rigid_shapes(self.model).shape[1]
        self._complete = False

    @property
    def complete(self) -> bool:
        return self._complete or self.size == self.model.size

    def grow(self, size: int) -> None:
        answer = self.ranks.ask("grow", size=size)
        self.size, self._complete = answer["size"], answer["complete"]
        self._stiffness = self.ranks.take("stiffness", (self.size, self.size))
        self._ports = self.ranks.take("shapes", (self.size, len(self.model.ports)))

    def combined(self, coefficients: Array) -> Array:
        self.ranks.give("coefficients", coefficients)
        self.ranks.ask("combine")
        return self.ranks.take("vectors", (self.model.size, coefficients.shape[1]))

    def orthogonality_error(self) -> float:
        return float(self.ranks.ask("orthogonality")["lost"])


class RanksSpectrum:
    """The lowest eigenpairs of (K, M), complete by inertia, with the methods of `Spectrum` that `Modal` uses."""

    counted, factorization = True, "mumps"

    def __init__(self, ranks: Ranks, progress: Progress) -> None:
        self.ranks, self.model, self.progress = ranks, ranks.model, progress
        self.values, self.shapes = np.zeros(0), np.zeros((ranks.model.size, 0))
        self.top, self.solves = -np.inf, 0

    def first(self, n: int) -> None:
        """Compute at least the ``n`` lowest eigenpairs."""
        while len(self.values) < min(n, self.model.size):
            self.below(4 * self.top)

    def below(self, value: float, most: int | None = None) -> None:
        """Compute all eigenpairs with eigenvalues below ``value``, as `Spectrum.below`."""
        if value <= self.top:
            return
        self.progress("factorization", 0.0)
        total = self.ranks.factorize(-value, definite=False).negative_pivots
        self.progress("factorization", 1.0)
        assert total is not None
        if most is not None and total > most:
            raise eigen_search.ConvergenceError(
                f"{total} modes lie below {write_quantity(np.sqrt(value) / (2 * np.pi), 'frequency', 3)} (limit "
                f"{most}); lower the bandwidth"
            )
        low = max(self.top, -value)
        if more := total - len(self.values):
            count = self.ranks.ask("eigen", low=low, high=value, tolerance=EIGEN_TOLERANCE)["count"]
            if count != more:
                raise eigen_search.ConvergenceError(
                    f"slepc: {count} eigenvalues are found where inertia counts {more}; use backend='auto'"
                )
            values, shapes = self.ranks.take("values", (count,)), self.ranks.take("vectors", (self.model.size, count))
            order = np.argsort(values)
            self.values = np.concatenate([self.values, values[order]])
            self.shapes = np.concatenate([self.shapes, shapes[:, order]], axis=1)
        self.top = value
        self.progress("modes", 1.0)
