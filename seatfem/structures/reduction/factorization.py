"""Sparse symmetric factorization, and solution by conjugate gradients on two grids for large bodies.

The factorization is by PARDISO (Intel MKL through pypardiso) if it can be imported, otherwise by SciPy's SuperLU with a
METIS ordering.

On two grids only a coarse matrix P'AP is factorized. The coarse space is that of linear functions between the corners
of quadratic tetrahedra, a seventh of the unknowns. A step of Jacobi's iteration, a correction by the coarse space and
another Jacobi step are one symmetric preconditioner of conjugate gradients. Source: W. Hackbusch, Multi-Grid Methods
and Applications, Springer (1985), chapters 2 and 11.
"""

import ctypes
import importlib
import os
import weakref
from collections.abc import Callable
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path
from typing import Any, Final, Literal

import numpy as np
import pymetis
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.linalg import splu

from impact.notices import Progress, SeatfemError, silent
from seatfem.structures.model import Array, DofMap, SecondOrderModel, as_csr

Backend = Literal["auto", "pardiso", "superlu"]
MKL_RUNTIME: Final = "PYPARDISO_MKL_RT"  # environment variable of pypardiso with the path of MKL
SINGLE: Final = ", single precision"
"""Suffix to the name of the backend."""
TWO_GRIDS: Final = "conjugate gradients on two grids"
"""Name of the backend that factorizes a coarse matrix only."""
_MOST_STEPS: Final = 12  # most conjugate gradient steps of a first solve; beyond, a factorization is faster
_COARSE: Final = 1e-3  # error allowed to solutions in the coarse space, a part of the preconditioner
_CONVERGES: Final = 0.03  # error of a solve in single precision up to which a step of refinement squares it
_ROUGH: Final = 1e-8  # residual of a first solve above which solves are refined: two steps, four times the time
_SETTINGS: Final = {  # parameters of PARDISO, by the number of iparm
    1: 1,  # use these settings instead of the defaults, which refine every solve
    2: 3,  # nested dissection
    10: 8,  # perturbs pivots below 1e-8
    21: 1,  # Bunch-Kaufman pivots
    24: 1,  # two-level factorization
    37: -90,  # rows of one node together, where nine in ten of their columns agree: the ordering takes a quarter
}
_STEPS: Final = 8  # number of the iparm for steps of refinement
_REMEDY = "; fix a body that can move freely, or look for inside-out elements and a material without stiffness"


class FactorizationError(SeatfemError, ArithmeticError):
    """A matrix that cannot be factorized or a factorization that fails its own check; the message gives the number."""


@dataclass(frozen=True, eq=False)
class Factorization:
    """A factorized symmetric matrix.

    Attributes:
        size: number of unknowns.
        backend: "pardiso" or "superlu", and `SINGLE` of factors in single precision; or `TWO_GRIDS`.
        negative_pivots: number of negative eigenvalues of the matrix (Sylvester).
        residual: ||A x - b|| / ||b|| of its first solve.
        refined: whether each solve is refined once, by a product in double precision.
    """

    size: int
    backend: str
    negative_pivots: int
    residual: float
    _solve: Callable[[Array], Array]
    refined: bool = False

    def solve(self, rhs: Array) -> Array:
        """Return A^-1 rhs for one (n,) or several (n, m) right-hand sides."""
        if rhs.shape[0] != self.size:
            raise FactorizationError(f"right-hand side has {rhs.shape[0]} rows, must have {self.size} as the matrix")
        return self._solve(rhs)


BLOCK: Final = 8  # right-hand sides that are solved at once between two reports


def solve_in_blocks(factor: Factorization, rhs: Array, progress: Progress) -> Array:
    """Return A^-1 rhs for several right-hand sides (n, m), with a report before each `BLOCK` of them."""
    solution = np.empty(rhs.shape, order="F")
    for first in range(0, rhs.shape[1], BLOCK):
        progress("reduction", first / rhs.shape[1])
        solution[:, first : first + BLOCK] = factor.solve(rhs[:, first : first + BLOCK])
    progress("reduction", 1.0)
    return solution


def factorize(
    matrix: sparse.csr_array,
    *,
    definite: bool = True,
    backend: Backend = "auto",
    tolerance: float = 1e-8,
    allowed: float = 0.0,
    name: str = "the matrix",
) -> Factorization:
    """Factorize a symmetric matrix and verify it by a first solve.

    Args:
        matrix: (n, n) symmetric; only its upper triangle is used by PARDISO.
        definite: whether a matrix that is not positive definite is an error; ``False`` for counting eigenvalues.
        backend: "auto" takes PARDISO if it can be imported.
        tolerance: largest relative residual of the first solve.
        allowed: relative error allowed to solutions; PARDISO's factors in single precision, with half the memory, are
            used if they meet it, directly or with a step of refinement; 0: they are not tried.
        name: name of the matrix in messages, e.g. "K + s^2 M".

    Raises:
        FactorizationError: the matrix is not positive definite or singular, or the residual is above the tolerance.
    """
    matrix = as_csr(matrix)
    zero = int(np.sum(matrix.diagonal() == 0))
    if zero:
        raise FactorizationError(
            f"{name}: {zero} diagonal values are zero: take out unknowns without stiffness and mass"
        )
    pardiso = _pardiso_class() if backend in ("auto", "pardiso") else None
    if backend == "pardiso" and pardiso is None:
        raise FactorizationError("PARDISO is not installed here: pip install pypardiso, or backend='superlu'")
    if allowed > 0 and pardiso and definite and (rough := _in_single_precision(matrix, pardiso, allowed)) is not None:
        return rough
    try:
        solve, negative = _pardiso(matrix, definite, pardiso) if pardiso else _superlu(matrix)
        if definite and negative:
            raise FactorizationError(f"not positive definite: {negative} negative pivots{_REMEDY}")
    except FactorizationError as error:
        raise FactorizationError(f"{name} ({matrix.shape[0]} unknowns): {error}") from error
    residual = _residual(matrix, solve)
    if not residual <= tolerance:
        raise FactorizationError(
            f"{name}: {'pardiso' if pardiso else 'superlu'}: the first solve leaves a residual of {residual:.1e} "
            f"(limit {tolerance:.0e}): the matrix is singular or badly scaled{_REMEDY}"
        )
    return Factorization(matrix.shape[0], "pardiso" if pardiso else "superlu", negative, residual, solve)


def static_compliance(model: SecondOrderModel, backend: Backend = "auto", progress: Progress = silent) -> Array:
    """Return the (p, p) static B' K^-1 B [m/N]. Raises `FactorizationError` for a body that can move freely."""
    progress("factorization", 0.0)
    factor = factorize(model.K, backend=backend, name="K")
    progress("factorization", 1.0)
    compliance = model.port_matrix.T @ solve_in_blocks(factor, model.port_matrix, progress)
    return np.asarray((compliance + compliance.T) / 2)


def _in_single_precision(matrix: sparse.csr_array, solver_class: Any, allowed: float) -> Factorization | None:
    """Return a factorization in single precision whose solutions have a relative error of at most ``allowed``,
    estimated by a step of refinement; ``None`` if there is none, as for thin and nearly incompressible bodies."""
    try:
        solve, _ = _pardiso(matrix, True, solver_class, single=True)
    except FactorizationError:
        return None
    size = matrix.shape[0]
    loads = matrix.diagonal()[:, None] * np.stack([np.ones(size), np.cos(np.arange(size, dtype=float))], axis=1)
    first = solve(loads)  # loads scaled by the diagonal, independent of the size of elements
    errors = np.linalg.norm(solve(loads - matrix @ first), axis=0) / np.linalg.norm(first, axis=0)
    error = 2 * float(errors.max())
    if not (error <= allowed or (error < _CONVERGES and error**2 <= allowed)):
        return None

    def solve_twice(rhs: Array) -> Array:
        x = solve(rhs)
        return np.asarray(x + solve(rhs - matrix @ x))

    chosen = solve if error <= allowed else solve_twice
    return Factorization(size, "pardiso" + SINGLE, 0, _residual(matrix, chosen), chosen, refined=error > allowed)


def solve_on_two_grids(matrix: sparse.csr_array, dofs: DofMap | None, allowed: float) -> Factorization | None:
    """Return a solver for a positive definite K + s^2 M with a relative error of about ``allowed`` in its norm.

    It takes a few steps of conjugate gradients in single precision on any mesh of a compact body. ``None`` if a first
    solve takes more than `_MOST_STEPS`, as for thin and nearly incompressible bodies, or if the unknowns are not the
    displacements of quadratic tetrahedra along the axes.
    """
    coarse = None if dofs is None or dofs.turned is not None else _linear_functions(dofs)
    if coarse is None:
        return None
    product = sparse.csr_array(matrix @ coarse)
    try:
        small = factorize(sparse.csr_array(coarse.T @ product), allowed=_COARSE, name="P'(K + s^2 M)P")
    except FactorizationError:
        return None
    diagonal, single = matrix.diagonal(), np.float32
    A, AP, P = (each.astype(single) for each in (matrix, product, coarse))
    restriction = sparse.csr_array(P.T)
    load = diagonal * np.cos(np.arange(len(diagonal)))
    x, largest = load.astype(single), 1.0
    for _ in range(15):  # the power method, from below
        x = (A @ (x / single(largest)) / diagonal).astype(single)
        largest = float(np.linalg.norm(x))
    weights = (1.6 / (1.1 * largest * diagonal)).astype(single)  # damp eigenvalues from a fourth of the largest on

    def preconditioned(residual: NDArray[np.float32]) -> NDArray[np.float32]:
        first = weights * residual
        residual = residual - A @ first
        correction = small.solve(restriction @ residual).astype(single)
        return np.asarray(first + P @ correction + weights * (residual - AP @ correction))

    def conjugate_gradients(rhs: Array) -> tuple[Array, int]:
        scale, steps = float(np.abs(rhs).max()) or 1.0, 0
        residual = (rhs / scale).astype(single)
        way = preconditioned(residual)
        x, first = np.zeros_like(way), (square := float(residual @ way))
        while square > allowed**2 * first and steps <= 2 * _MOST_STEPS:
            image = A @ way
            length = single(square / float(way @ image))
            x += length * way
            residual -= length * image
            following = preconditioned(residual)
            before, square, steps = square, float(residual @ following), steps + 1
            way = following + single(square / before) * way
        return scale * x.astype(float), steps

    def solve(rhs: Array) -> Array:
        columns = [conjugate_gradients(each)[0] for each in rhs.reshape(len(rhs), -1).T]
        return np.stack(columns, axis=1).reshape(rhs.shape) if columns else np.empty_like(rhs)

    solution, steps = conjugate_gradients(load)
    left = float(np.linalg.norm(A @ solution - load) / np.linalg.norm(load))
    return Factorization(len(load), TWO_GRIDS, 0, left, solve) if steps <= _MOST_STEPS else None


def _linear_functions(dofs: DofMap) -> sparse.csr_array | None:
    """Return P, the unknowns of linear functions of the corners; ``None`` for elements other than quadratic
    tetrahedra."""
    mesh: Any = dofs.mesh
    if mesh is None or mesh.elem.refdom.__name__ != "RefTet":
        return None
    corners, edges = int(mesh.nvertices), mesh.edges
    middles = corners + np.arange(edges.shape[1])
    if dofs.points.shape != (3, corners + len(middles)):
        return None
    places = np.concatenate([np.arange(corners), np.repeat(middles, 2)]), np.append(np.arange(corners), edges.T)
    shares = np.concatenate([np.ones(corners), np.full(edges.size, 0.5)])
    whole = sparse.csr_array(sparse.kron(sparse.csr_array((shares, places)), np.eye(3), format="csr"))
    return sparse.csr_array(whole[dofs.free][:, dofs.free[dofs.free < 3 * corners]])


def _residual(matrix: sparse.csr_array, solve: Callable[[Array], Array]) -> float:
    """Return ||A x - b|| / ||b|| for a vector b without symmetry."""
    rhs = np.cos(np.arange(matrix.shape[0], dtype=float))
    return float(np.linalg.norm(matrix @ solve(rhs) - rhs) / np.linalg.norm(rhs))


def _pardiso_class() -> Any:
    """Return pypardiso's solver class, or ``None``; MKL's path is set first, to save a search through all files."""
    if MKL_RUNTIME not in os.environ and (path := _mkl_runtime()):
        os.environ[MKL_RUNTIME] = path
    try:
        return importlib.import_module("pypardiso").PyPardisoSolver
    except (ImportError, OSError):
        return None


def _mkl_runtime() -> str:
    """Return the path of MKL's library in the package mkl; "" if MKL is installed otherwise."""
    try:
        files = metadata.files("mkl") or ()
    except metadata.PackageNotFoundError:
        return ""
    paths = (Path(str(file.locate())).resolve() for file in files if "mkl_rt" in file.name)
    return next((str(path) for path in paths if path.is_file()), "")


def _pardiso(
    matrix: sparse.csr_array, definite: bool, solver_class: Any, *, single: bool = False
) -> tuple[Callable[[Array], Array], int]:
    """Return a solver by PARDISO (Cholesky, or LDL' with its inertia) and the number of negative pivots; ``single``: in
    single precision.

    By default PARDISO refines each solve twice; here only if the first residual is large. Source of the settings: Intel
    oneMKL Developer Reference, "pardiso iparm Parameter".
    """
    upper = sparse.csr_matrix(sparse.triu(matrix, format="csr"))
    upper.sort_indices()
    solver = solver_class(mtype=2 if definite else -2)
    for number, value in (_SETTINGS | {28: int(single)}).items():
        solver.set_iparm(number, value)
    call = _calls(solver, upper, np.float32 if single else np.float64)
    if code := call(12, np.zeros(upper.shape[0]))[1]:
        solver.free_memory(everything=True)
        raise FactorizationError(_pardiso_message(code, definite))

    def solve(rhs: Array) -> Array:
        if rhs.size == 0:  # a complete Krylov space has no candidates; the library would fail
            return np.empty_like(rhs, order="F")
        x, code = call(33, rhs)
        if code:
            raise FactorizationError(f"pardiso: the solve failed with code {code}; try backend='superlu'")
        return x

    if not single and _residual(matrix, solve) > _ROUGH:
        solver.set_iparm(_STEPS, 2)
    weakref.finalize(solve, solver.free_memory, True)
    return solve, 0 if definite else int(solver.get_iparm(23))


def _pardiso_message(code: int, definite: bool) -> str:
    meanings = {
        -2: "not enough memory for the factors: use a coarser mesh or fewer dimensions",
        -4: f"not positive definite or singular{_REMEDY}"
        if definite
        else "a zero pivot: the shift is an eigenvalue, move it by a part in a thousand",
        -8: "the factors have more entries than 32-bit indices count: use a coarser mesh or fewer dimensions",
    }
    said = meanings.get(code, "the factorization failed; try backend='superlu'")
    return f"pardiso: {said} (code {code})"


def _calls(solver: Any, upper: sparse.csr_matrix, kind: type) -> Callable[[int, Array], tuple[Array, int]]:
    """Return a function that calls the library with a phase and right-hand sides, and returns solutions and an error
    code.

    The 1-based index arrays are made once: pypardiso would compare or hash the whole matrix and rebuild them in every
    call, and allows double precision only. Values are scaled to the range of single precision.
    """
    integer, pointer = ctypes.c_int32, ctypes.POINTER(ctypes.c_int32)
    starts, columns = upper.indptr.astype(np.int32) + 1, upper.indices.astype(np.int32) + 1
    scale = 1.0 if kind is np.float64 else float(np.abs(upper.data).max())
    values = np.asarray(upper.data / scale, dtype=kind) if scale != 1.0 else upper.data
    fixed = [ctypes.byref(integer(value)) for value in (1, 1, solver.mtype)]  # maxfct, mnum, mtype
    size = ctypes.byref(integer(upper.shape[0]))
    index = [array.ctypes.data_as(pointer) for array in (starts, columns, solver.perm)]
    handle = solver.pt.ctypes.data_as(ctypes.POINTER(solver._pt_type[0]))
    address = ctypes.c_void_p

    def call(phase: int, rhs: Array) -> tuple[Array, int]:
        largest = 1.0 if kind is np.float64 else float(np.abs(rhs).max()) or 1.0
        b: NDArray[Any] = np.asfortranarray(rhs if largest == 1.0 else rhs / largest, dtype=kind)
        x, failed = np.zeros_like(b, order="F"), integer(0)
        solver._mkl_pardiso(
            handle,
            *fixed,
            ctypes.byref(integer(phase)),
            size,
            values.ctypes.data_as(address),
            *index,
            ctypes.byref(integer(1 if b.ndim == 1 else b.shape[1])),
            solver.iparm.ctypes.data_as(pointer),
            ctypes.byref(integer(0)),  # silent
            b.ctypes.data_as(address),
            x.ctypes.data_as(address),
            ctypes.byref(failed),
        )
        return x if kind is np.float64 else largest / scale * x.astype(float), int(failed.value)

    return call


def _superlu(matrix: sparse.csr_array) -> tuple[Callable[[Array], Array], int]:
    """Return a solver by SuperLU without pivoting, in METIS order, and the number of negative pivots."""
    graph = sparse.csr_array(matrix - sparse.diags_array(matrix.diagonal()))
    graph.eliminate_zeros()
    order, place = (np.asarray(p) for p in pymetis.nested_dissection(xadj=graph.indptr, adjncy=graph.indices))
    permuted = sparse.csc_matrix(matrix[order][:, order])
    try:
        lu = splu(permuted, permc_spec="NATURAL", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
    except RuntimeError as error:
        raise FactorizationError(f"superlu: {error}{_REMEDY}") from error
    if not np.array_equal(lu.perm_r, np.arange(len(order))):
        raise FactorizationError(f"superlu: a pivot on the diagonal is zero{_REMEDY}")

    def solve(rhs: Array) -> Array:
        return np.asarray(lu.solve(np.ascontiguousarray(rhs[order], dtype=float))[place])

    return solve, int(np.sum(lu.U.diagonal() < 0))
