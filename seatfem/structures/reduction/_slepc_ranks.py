"""Program of each rank of a reduction by PETSc and SLEPc, which holds its rows of K and M and its part of every vector.

    mpiexec -n N python3 _slepc_ranks.py FOLDER

It runs in the interpreter of petsc4py and slepc4py (real numbers, with MUMPS), which has numpy and nothing of this
package. FOLDER, which all ranks see, holds the model as .npy files and takes what is found. Rank 0 reads commands from
its standard input and answers each on its standard output, both as lines of JSON; the program ends with its input.
"""

import ctypes
import glob
import itertools
import json
import os
import queue
import signal
import sys
import threading
import time
import traceback
from collections.abc import Iterator
from typing import Any

import numpy as np

for library in ("petsc", "slepc"):  # where Debian has them, if they are not found otherwise
    sys.path.extend(sorted(glob.glob(f"/usr/lib/{library}dir/*/*-real/lib/python3/dist-packages")))

import slepc4py  # noqa: E402

slepc4py.init([])
from petsc4py import PETSc  # noqa: E402
from slepc4py import SLEPc  # noqa: E402

DEPENDENT = 1e-11  # largest share of a dependent vector's length that orthogonalisation leaves
PATIENCE = 2.0  # time left to all ranks after the end of the input [s]
LINE = 500  # most characters of a command
RANK = PETSc.COMM_WORLD.getRank()
VERSION = "PETSc " + ".".join(str(part) for part in PETSc.Sys.getVersion())
INERTIA = {13: 1}  # control parameters of MUMPS: the last front is not left to ScaLAPACK, which counts no pivots
NULL = {24: 1}  # zero pivots are detected, as SLEPc requires where it counts eigenvalues
ROOM = {14: 60}  # per cent of workspace beyond what the analysis foresees
Answer = dict[str, Any]


class Model:
    """K, M, ports and rigid motions, and the factorization and the basis that were last asked for."""

    def __init__(self, folder: str) -> None:
        self.folder = folder
        self.K, self.M = self.matrix("K"), self.matrix("M")
        self.first, self.last = self.K.getOwnershipRange()
        self.ports, self.rigid = self.vectors("ports"), self.vectors("rigid")
        self.pc: Any = None
        self.factor: Any = None
        self.basis: Any = None

    def path(self, name: str) -> str:
        return os.path.join(self.folder, name + ".npy")

    def matrix(self, name: str) -> Any:
        """Return the rows of a matrix in compressed form that are this rank's."""
        starts, columns, data = (np.load(self.path(name + part), mmap_mode="r") for part in ("_p", "_i", "_x"))
        n, whole = len(starts) - 1, PETSc.Vec().createMPI(len(starts) - 1)
        first, last = whole.getOwnershipRange()
        rows, kept = starts[first : last + 1], slice(int(starts[first]), int(starts[last]))
        csr = (rows - rows[0]).astype(PETSc.IntType), columns[kept].astype(PETSc.IntType), np.array(data[kept])
        matrix = PETSc.Mat().createAIJ(size=((last - first, n), (last - first, n)), csr=csr)
        matrix.setOption(PETSc.Mat.Option.SYMMETRIC, True)
        matrix.setOption(PETSc.Mat.Option.SYMMETRY_ETERNAL, True)
        return matrix

    def vectors(self, name: str) -> list[Any]:
        """Return the columns of a file."""
        columns = np.load(self.path(name), mmap_mode="r")
        vectors = []
        for j in range(columns.shape[1]):
            vectors.append(self.K.createVecRight())
            vectors[-1].setArray(np.array(columns[self.first : self.last, j]))
        return vectors

    def write(self, name: str, vectors: Any, count: int) -> None:
        """Write columns to a file, one of them in the memory of rank 0 at a time."""
        out: Any = None
        scatter: Any = None
        if RANK == 0:
            shape = (self.K.getSize()[0], count)
            out = np.lib.format.open_memmap(self.path(name), "w+", np.float64, shape, fortran_order=True)
        for j, vector in enumerate(vectors):
            if scatter is None:
                scatter, whole = PETSc.Scatter.toZero(vector)
            scatter.scatter(vector, whole, False, PETSc.Scatter.Mode.FORWARD)
            if RANK == 0:
                out[:, j] = whole.getArray()
        if RANK == 0:
            out.flush()

    def solve(self, vectors: list[Any]) -> list[Any]:
        """Return the factorized matrix's inverse times several vectors."""
        size = (self.K.getLocalSize()[0], self.K.getSize()[0])
        right, solution = (PETSc.Mat().createDense(size=(size, len(vectors))) for _ in range(2))
        for matrix in (right, solution):
            matrix.setUp()
        array = right.getDenseArray()
        for j, vector in enumerate(vectors):
            array[:, j] = vector.getArray()
        del array
        for matrix in (right, solution):
            matrix.assemble()
        self.factor.matSolve(right, solution)
        columns = [vector.duplicate() for vector in vectors]
        for j, vector in enumerate(columns):
            vector.setArray(np.array(solution.getDenseArray()[:, j]))
        right.destroy()
        solution.destroy()
        return columns

    def do_factorize(self, square: float) -> Answer:
        """Factorize K + square M = L D L' by MUMPS."""
        if self.pc is not None:
            self.pc.destroy()
        matrix = self.K.copy()
        matrix.axpy(square, self.M, PETSc.Mat.Structure.DIFFERENT_NONZERO_PATTERN)
        matrix.setOption(PETSc.Mat.Option.SYMMETRIC, True)
        self.pc = PETSc.PC().create()
        self.pc.setOperators(matrix)
        self.pc.setType("cholesky")
        self.pc.setFactorSolverType("mumps")
        self.pc.setFactorSetUpSolverType()
        self.factor = self.pc.getFactorMatrix()
        for number, value in {**INERTIA, **ROOM}.items():
            self.factor.setMumpsIcntl(number, value)
        self.pc.setUp()
        if self.factor.getMumpsInfog(1) < 0:
            return {"mumps": [self.factor.getMumpsInfog(1), self.factor.getMumpsInfog(2)]}
        right = self.K.createVecRight()
        right.setArray(np.cos(np.arange(self.first, self.last, dtype=float)))
        residual = matrix * self.solve([right])[0]
        residual.axpy(-1.0, right)
        entries = self.factor.getMumpsInfog(29)  # in millions where it is negative
        return {
            "negative": self.factor.getMumpsInfog(12),
            "residual": residual.norm() / right.norm(),
            "entries": entries if entries >= 0 else -1000000 * entries,
            "megabytes": self.factor.getMumpsInfog(22),  # of all ranks
        }

    def do_solve(self) -> Answer:
        """Solve for the columns of right.npy, into left.npy."""
        solutions = self.solve(self.vectors("right"))
        self.write("left", solutions, len(solutions))
        return {}

    def do_start(self, limit: int) -> Answer:
        """Start a basis with the rigid motions, solve for the next candidates, and return their overlap with the
        ports."""
        self.basis = Basis(self, limit)
        overlap = [[b.dot(x) for x in self.basis.following] for b in self.ports]
        return {"compliance": overlap}

    def do_grow(self, size: int) -> Answer:
        """Grow the basis as the built-in one grows, and write its projections, stiffness.npy and shapes.npy."""
        self.basis.grow(size)
        if RANK == 0:
            k = self.basis.size
            np.save(self.path("stiffness"), self.basis.stiffness[:k, :k])
            np.save(self.path("shapes"), self.basis.shapes[:k])
        PETSc.COMM_WORLD.barrier()
        return {"size": self.basis.size, "complete": not self.basis.following}

    def do_combine(self) -> Answer:
        """Write the basis times the columns of coefficients.npy."""
        factors = np.load(self.path("coefficients"))
        V, vector = self.basis.V, self.K.createVecRight()
        V.setActiveColumns(0, len(factors))
        each = (V.multVec(1.0, 0.0, vector, list(column)) or vector for column in factors.T)
        self.write("vectors", each, factors.shape[1])
        return {}

    def do_orthogonality(self) -> Answer:
        """Return the largest entry of V'MV - 1."""
        V = self.basis.V
        V.setActiveColumns(0, self.basis.size)
        gram = V.dot(V).getDenseArray()
        return {"lost": float(np.abs(gram - np.eye(self.basis.size)).max())}

    def do_eigen(self, low: float, high: float, tolerance: float) -> Answer:
        """Find all eigenvalues from low to high, by spectrum slicing about shifts whose inertia counts."""
        eps = SLEPc.EPS().create()
        eps.setOperators(self.K, self.M)
        eps.setProblemType(SLEPc.EPS.ProblemType.GHEP)
        eps.setWhichEigenpairs(SLEPc.EPS.Which.ALL)
        eps.setInterval(low, high)
        eps.setTolerances(tolerance, 1000)
        st = eps.getST()
        st.setType("sinvert")
        st.getKSP().setType("preonly")
        st.getKSP().getPC().setType("cholesky")
        st.getKSP().getPC().setFactorSolverType("mumps")
        for number, value in {**INERTIA, **ROOM, **NULL}.items():
            PETSc.Options().setValue(f"st_mat_mumps_icntl_{number}", value)
        eps.setFromOptions()
        eps.solve()
        count, vector = eps.getConverged(), self.K.createVecRight()
        if RANK == 0:
            np.save(self.path("values"), np.array([eps.getEigenvalue(j).real for j in range(count)]))
        each = (eps.getEigenvector(j, vector) or vector for j in range(count))
        self.write("vectors", each, count)
        eps.destroy()
        return {"count": count}


class Basis:
    """V with V'MV = 1, V'KV and V' times the ports."""

    def __init__(self, model: Model, limit: int) -> None:
        self.model, self.limit, self.size = model, limit, len(model.rigid)
        self.V = SLEPc.BV().create()
        self.V.setSizesFromVec(model.K.createVecRight(), min(limit, self.size + 32))
        self.V.setFromOptions()
        self.V.setOrthogonalization(refine=SLEPc.BV.OrthogRefineType.ALWAYS)  # twice is enough (Kahan, Parlett)
        self.stiffness, self.shapes = np.zeros((limit, limit)), np.zeros((limit, len(model.ports)))
        for j, vector in enumerate(model.rigid):
            self.V.insertVec(j, vector)
            self.shapes[j] = [vector.dot(b) for b in model.ports]
        self.V.setMatrix(model.M, False)
        self.following = model.solve(model.ports)

    def grow(self, size: int) -> None:
        """Append whole blocks until there are ``size`` vectors, or no independent one is left."""
        model = self.model
        while self.size < min(size, self.limit) and self.following:
            new = [v for v in (self.append(w) for w in self.following if self.size < self.limit) if v is not None]
            self.following = model.solve([model.M * v for v in new]) if new else []

    def append(self, candidate: Any) -> Any | None:
        """Return the candidate made orthonormal to V and appended, unless it lies in the span of V."""
        k, V = self.size, self.V
        if k == V.getSizes()[1]:
            V.resize(min(2 * k, self.limit), True)
        V.insertVec(k, candidate)
        V.setActiveColumns(0, k + 1)
        before = V.normColumn(k)
        norm = V.orthogonalizeColumn(k)[0]
        if not norm > DEPENDENT * before:
            return None
        V.scaleColumn(k, 1.0 / norm)
        vector = candidate.duplicate()
        V.copyVec(k, vector)
        V.setMatrix(None, False)
        V.setActiveColumns(len(self.model.rigid), k + 1)
        column = V.dotVec(self.model.K * vector)
        V.setMatrix(self.model.M, False)
        self.stiffness[len(self.model.rigid) : k + 1, k] = self.stiffness[k, len(self.model.rigid) : k + 1] = column
        self.shapes[k] = [vector.dot(b) for b in self.model.ports]
        self.size = k + 1
        return vector


def lines() -> Iterator[str]:
    """Yield the lines of the standard input as they come, then a command to end; `PATIENCE` seconds after the input the
    process ends, whatever it is doing."""
    incoming: queue.Queue[str] = queue.Queue()

    def listen() -> None:
        for line in sys.stdin:
            incoming.put(line)
        incoming.put('{"do": "end"}')
        time.sleep(PATIENCE)
        os._exit(1)

    threading.Thread(target=listen, daemon=True).start()
    return iter(incoming.get, None)


def heard(line: str) -> Any:
    """Return the command that rank 0 has read, on all ranks."""
    sent = PETSc.Vec().createMPI((LINE if RANK == 0 else 0, LINE))
    if RANK == 0:
        sent.setArray(np.array(list(line.strip().ljust(LINE).encode("ascii")), dtype=float))
    scatter, whole = PETSc.Scatter.toAll(sent)
    scatter.scatter(sent, whole, False, PETSc.Scatter.Mode.FORWARD)
    return json.loads(bytes(whole.getArray().astype(np.uint8)).decode("ascii"))


def main() -> None:
    """Answer commands until there are no more."""
    answers = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)  # libraries print into the log
    model = Model(sys.argv[1])
    commands = lines() if RANK == 0 else itertools.repeat("")
    answer = {"version": VERSION, "ranks": PETSc.COMM_WORLD.getSize()}
    while True:
        if RANK == 0:
            answers.write(json.dumps(answer) + "\n")
            answers.flush()
        command = heard(next(commands))
        if command["do"] == "end":
            return
        answer = getattr(model, "do_" + command.pop("do"))(**command)


if __name__ == "__main__":
    if sys.platform == "linux":  # PR_SET_PDEATHSIG: the kernel ends it with its parent, in compiled code too
        ctypes.CDLL(None).prctl(1, signal.SIGKILL, 0, 0, 0)
    try:
        if np.dtype(PETSc.ScalarType) != np.float64 or not PETSc.Sys.hasExternalPackage("mumps"):
            raise ImportError("build PETSc for real numbers (float64) and with MUMPS")
        if sys.argv[1:]:
            main()
        else:
            sys.stdout.write(VERSION + "\n")
    except BaseException:
        sys.stderr.write(f"rank {RANK}: {traceback.format_exc()}")
        sys.stderr.flush()
        os._exit(1)  # the others, which wait for this one, end with it
