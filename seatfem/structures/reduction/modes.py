"""Natural modes, proved complete by a count of eigenvalues; those of symmetric plates as even or odd modes."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

import numpy as np
import scipy.linalg
from scipy import sparse

from impact import notices, quantities
from impact.names import frame_of
from seatfem.structures.model import Array, ModelError, SecondOrderModel, check_model
from seatfem.structures.reduction import eigen_search
from seatfem.structures.reduction.eigen_search import ConvergenceError, Counted
from seatfem.structures.reduction.factorization import Backend
from seatfem.structures.reduction.spectrum import Spectrum

if TYPE_CHECKING:
    import pandas

__all__ = ["ConvergenceError", "Modes", "dense_modes", "eigen_residuals", "modes_of", "solve_modes"]

_SURE = 1e-6  # eigenvalue over s^2 above which it is not zero, whatever the largest of K/M
DENSE = 600  # unknowns up to which LAPACK is fastest and computes all modes
_LARGEST_RESIDUAL = 1e-5  # largest residual, apart from round-off of K
_ROUND_OFF = (
    300.0  # allowed round-off over `null_limit`: rigid modes of rings of h/a = 0.005 have 110, and are accurate
)


@dataclass(frozen=True)
class Modes:
    """Undamped natural modes, K y = w^2 M y, lowest first.

    Attributes:
        frequencies_hz: (m,) natural frequencies [Hz]; exactly 0 for rigid-body modes.
        shapes: (n, m) mass-normalised shapes y [1/sqrt(kg)].
        residuals: (m,) ||K y - w^2 M y|| / ((w^2 + s^2) ||M y||), s of the order of the lowest or of the shift used.
        complete: whether a count of eigenvalues (Sylvester's law of inertia) proved that none is missing.
        backend: name of the eigensolver.
        solves: number of right-hand sides that were solved.
    """

    frequencies_hz: Array
    shapes: Array
    residuals: Array
    complete: bool
    backend: str
    solves: int = 0

    __repr__ = quantities.brief

    def __str__(self) -> str:
        f = self.frequencies_hz
        span = f"{f.min():.5g} ... {f.max():.5g} Hz" if f.size else "none"
        count = "complete" if self.complete else "not counted"
        worst = float(self.residuals.max(initial=0.0))
        return f"Modes, {f.size}, {span}, {count}, residuals up to {worst:.1e} ({self.backend})"

    def to_dataframe(self) -> pandas.DataFrame:
        """Return frequency and residual, a row a mode; raises `impact.names.FrameError` without pandas."""
        return frame_of({"frequency_hz": self.frequencies_hz, "residual": self.residuals})

    @property
    def omega(self) -> Array:
        """Return the (m,) angular frequencies [rad/s]."""
        return 2 * np.pi * self.frequencies_hz


def solve_modes(
    model: SecondOrderModel,
    n: float = np.inf,
    *,
    up_to_hz: float = np.inf,
    shift_hz: float = 0.0,
    limit: float = np.inf,
    known: tuple[Counted, Array, Array] | None = None,
    backend: Backend = "auto",
    progress: notices.Progress = notices.silent,
) -> Modes:
    """Return the ``n`` lowest undamped modes, or all up to a frequency; free bodies include their rigid modes at
    exactly 0 Hz.

    Block Lanczos on (K - sigma M)^-1 M with sigma inside the requested part of the spectrum; the negative pivots of
    K - sigma M, there and behind the last mode, count the eigenvalues, so that none is missing, repeated ones included.
    Starts are seeded, so runs are reproducible. Source: Grimes, Lewis & Simon, SIAM J. Matrix Anal. Appl. 15 (1994).

    Args:
        n: number of modes; all of them if the model has fewer; with neither limit, 20.
        up_to_hz: highest frequency [Hz]; if both limits are given, the lower one counts.
        shift_hz: frequency of the order of the lowest elastic one; 0: from the size of the model.
        limit: most modes up to ``up_to_hz``.
        known: count, values w^2 and shapes of all modes below a frequency, which are not computed again.
        progress: called with ("modes", fraction) and ("factorization", fraction).

    Raises:
        ModelError: an impossible n or frequency, an indefinite K. ConvergenceError: the error of Lanczos is too large.
        CountError: no factorization counts eigenvalues, or its count contradicts those found.
        CrowdedError: there are more than ``limit`` modes.
    """
    check_model(model)
    quantities.check_numbers(ModelError, n=n, up_to_hz=up_to_hz, shift_hz=shift_hz)
    if not n >= 1:
        raise ModelError(f"n = {n} modes asked for: give at least 1")
    if not up_to_hz > 0:
        raise ModelError(f"up_to_hz = {up_to_hz} must be positive")
    if not 0 <= shift_hz < np.inf:
        raise ModelError(f"shift_hz = {shift_hz} must be positive and finite")
    most = 20 if n == up_to_hz == np.inf else n
    highest = (2 * np.pi * up_to_hz) ** 2
    scale = 2 * np.pi * shift_hz or eigen_search.default_shift(model)
    flat = eigen_search.null_limit(model) > _SURE * scale**2  # elements: round-off of K hides the lowest from LAPACK
    if model.size <= 2 + (most if most < np.inf else 0) or (model.size <= DENSE and not flat):
        return _lowest(dense_modes(model, scale), most, highest)
    spectrum = Spectrum(model, backend=backend, lowest=(2 * np.pi * shift_hz) ** 2, known=known, progress=progress)
    if most < np.inf:
        spectrum.first(int(most))
    if up_to_hz < np.inf and (most == np.inf or spectrum.top < highest):
        spectrum.below(highest, limit)
    return _lowest(modes_of(spectrum, scale), most, highest)


def modes_of(spectrum: Spectrum, scale: float) -> Modes:
    """Return the modes of a spectrum, with rigid modes at exactly 0 Hz and residuals checked; ``scale``: s in `Modes`.

    Raises:
        ModelError: K is indefinite. ConvergenceError: a residual is too large.
    """
    backend = f"block Lanczos, {spectrum.factorization}"
    modes = _modes(spectrum.model, spectrum.values, spectrum.shapes, scale, backend)
    allowed = _LARGEST_RESIDUAL + _ROUND_OFF * eigen_search.null_limit(spectrum.model) / (modes.omega**2 + scale**2)
    if np.any(modes.residuals > allowed):
        worst = int(np.argmax(modes.residuals / allowed))
        raise ConvergenceError(
            f"mode {worst + 1} at {modes.frequencies_hz[worst]:.6g} Hz leaves a residual of "
            f"{modes.residuals[worst]:.1e} (limit {allowed[worst]:.1e}): badly scaled matrices, check their units"
        )
    return replace(modes, solves=spectrum.solves)


def dense_modes(model: SecondOrderModel, scale: float) -> Modes:
    """Return all modes of a small model, by LAPACK."""
    values, shapes = scipy.linalg.eigh(model.K.toarray(), model.M.toarray())
    return _modes(model, np.asarray(values), np.asarray(shapes), scale, "lapack")


def _lowest(modes: Modes, most: float, highest: float) -> Modes:
    """Return at most the first ``most`` modes, and none above ``highest`` [1/s^2]."""
    count = int(np.sum(modes.omega**2 <= highest * (1 + 1e-9)))
    kept = slice(0, int(min(most, count)))
    return replace(
        modes,
        frequencies_hz=modes.frequencies_hz[kept],
        shapes=modes.shapes[:, kept],
        residuals=modes.residuals[kept],
    )


def _modes(model: SecondOrderModel, values: Array, shapes: Array, shift: float, backend: str) -> Modes:
    limit = eigen_search.null_limit(model)
    if len(values) and values[0] < -limit:
        raise ModelError(f"K is indefinite, check its constraints: eigenvalue {values[0]:.2e} 1/s^2 relative to M")
    zero = values < limit
    rigid = eigen_search.rigid_shapes(model) if zero.any() else shapes[:, :0]
    if known := min(rigid.shape[1], len(values)):  # exact shapes replace the computed ones, with the same null space
        shapes = np.concatenate([rigid[:, :known], shapes[:, known:]], axis=1)
        zero = np.arange(len(values)) < known
    elif zero.any() and limit > _SURE * shift**2:
        zero = values < _SURE * shift**2
        if backend == "lapack":
            raise ConvergenceError(
                f"round-off of K, {limit:.1e} 1/s^2, hides the lowest eigenvalues: some elements are far flatter than "
                "the others; mesh the body more evenly"
            )
    square = np.where(zero, 0.0, np.maximum(values, 0.0))
    return Modes(np.sqrt(square) / (2 * np.pi), shapes, eigen_residuals(model, square, shapes, shift), True, backend)


def eigen_residuals(model: SecondOrderModel, square: Array, shapes: Array, shift: float) -> Array:
    """Return (m,) ||K y - w^2 M y|| / ((w^2 + s^2) ||M y||) with w^2 = ``square``."""
    mass = model.M @ shapes
    residuals = np.linalg.norm(model.K @ shapes - mass * square, axis=0)
    return np.asarray(residuals / ((square + shift**2) * np.linalg.norm(mass, axis=0)))


NEAR: Final = 1e-3
"""Largest relative change of w^2 by the last step of `modes_near`; its own error is of the order of the square."""
STEPS: Final = 3  # most steps of it, each with as many solves as there are modes; a search from nothing takes 3 to 9
MARGIN: Final = 1.3  # w^2 up to which approximate modes take part, over the highest that is asked for


def modes_near(model: SecondOrderModel, near: Array, up_to_hz: float, backend: Backend) -> tuple[Array, Array] | None:
    """Return w (m,) [rad/s] and M-orthonormal shapes (n, m) of all modes up to a frequency, from vectors near to them.

    Ritz pairs y in the span of the vectors are improved in that of y and (K - sigma M)^-1 M y, sigma at the highest
    frequency, until w^2 no longer changes. ``None`` if their number is not that of the eigenvalues by inertia, or if
    they still change: the vectors are not near enough.

    ``near``: (n, r) vectors, such as modes of a similar model.
    """
    top = eigen_search.counting_shift(model, (2 * np.pi * up_to_hz) ** 2, backend)
    if not top.count:
        return np.zeros(0), np.zeros((model.size, 0))
    before, shapes = _ritz_in(model, near, MARGIN * top.value)
    for _ in range(STEPS):
        if len(before) < top.count:
            return None
        image = top.factor.solve(model.M @ shapes)
        values, shapes = _ritz_in(model, np.concatenate([shapes, image], axis=1), MARGIN * top.value)
        number = int(np.sum(values < top.value))
        if number > top.count:
            return None
        compared = min(len(values), len(before), top.count)
        if number == compared == top.count:
            moved = np.abs(before[:compared] - values[:compared]) / np.abs(values[:compared])
            if np.max(moved) < NEAR:
                return np.sqrt(np.maximum(values[:number], 0.0)), shapes[:, :number]
        before = values
    return None


def _ritz_in(model: SecondOrderModel, vectors: Array, highest: float) -> tuple[Array, Array]:
    """Return the Ritz values below ``highest`` [1/s^2] in the span of the vectors (n, r), and M-orthonormal vectors."""
    mass = vectors.T @ (model.M @ vectors)
    scale = np.sqrt(np.diag(mass))
    squares, turns = np.linalg.eigh(mass / np.outer(scale, scale))
    independent = squares > 1e-10
    basis = (vectors / scale) @ (turns[:, independent] / np.sqrt(squares[independent]))
    values, parts = np.linalg.eigh(basis.T @ (model.K @ basis))
    low = values < highest
    return values[low], basis @ parts[:, low]


SIGNS: Final = (1.0, 1.0, -1.0)  # signs of w, a_x and a_y = dw/dy in the mirror image of an even motion


def modes_by_parity(
    model: SecondOrderModel,
    points: Array,
    *,
    up_to_hz: float,
    known: tuple[float, Modes] | None = None,
    progress: notices.Progress = notices.silent,
) -> Modes:
    """Return all modes of a plate up to a frequency; on a mesh that is symmetric about y = 0, each is even or odd.

    Even and odd motions are unknowns of their own, u = T q with T'T = 1, of half the size and with half the modes each:
    K and M couple none of them. On any other mesh all motions are of one kind.

    Args:
        model: model of a plate, with three unknowns a node.
        points: (n, 2) coordinates of its nodes.
        up_to_hz: highest frequency [Hz].
        known: frequency [Hz] and all modes of this model up to it, which are not computed again.

    Raises as `solve_modes`.
    """
    parts, every = [], 0.0 if known is None else known[0]
    for T in _parities(model, points):
        dofs = model.dofs
        if dofs is not None and dofs.rigid is not None:
            dofs = replace(dofs, rigid=np.asarray(T.T @ dofs.rigid))
        half = SecondOrderModel(T.T @ model.M @ T, None, T.T @ model.K @ T, {}, dofs, known=model.damping)
        before = None
        if known is not None:
            own = T.T @ known[1].shapes
            mine = np.sum(own * (half.M @ own), axis=0) > 1 / 2
            before = Counted((2 * np.pi * every) ** 2, int(mine.sum())), known[1].omega[mine] ** 2, own[:, mine]
        modes = solve_modes(half, up_to_hz=up_to_hz, known=before, progress=progress)
        parts.append(replace(modes, shapes=np.asarray(T @ modes.shapes)))
    together = {
        name: np.concatenate([getattr(each, name) for each in parts], axis=-1)
        for name in ("frequencies_hz", "shapes", "residuals")
    }
    order = np.argsort(together["frequencies_hz"], kind="stable")
    ordered = {name: each[..., order] for name, each in together.items()}
    return Modes(**ordered, complete=True, backend=parts[0].backend, solves=sum(each.solves for each in parts))


def _parities(model: SecondOrderModel, points: Array) -> list[sparse.csr_array]:
    """Return T (n, m) of even and of odd motions about y = 0; the identity alone on a mesh without this symmetry."""
    image = points * (1, -1)
    order, image_order = (np.lexsort(each.T) for each in (points, image))
    dofs, everything = model.dofs, [sparse.eye_array(model.size, format="csr")]
    if dofs is None or not np.array_equal(points[order], image[image_order]):
        return everything
    node = np.empty_like(order)
    node[order] = image_order
    place = np.full(3 * len(points), -1)
    place[dofs.free] = np.arange(model.size)
    mirrored = place[3 * node[dofs.free // 3] + dofs.free % 3]
    if np.any(mirrored < 0):  # one side is held, and the other is not
        return everything
    own, signs = np.arange(model.size), np.array(SIGNS)[dofs.free % 3]
    parts = []
    for sign in (1.0, -1.0):
        firsts = np.flatnonzero((own < mirrored) | ((own == mirrored) & (signs == sign)))
        alone = mirrored[firsts] == firsts
        columns = np.arange(len(firsts))
        first = np.where(alone, 1.0, np.sqrt(0.5))
        second = np.where(alone, 0.0, sign * signs[firsts] * np.sqrt(0.5))
        values, rows = np.concatenate([first, second]), np.concatenate([firsts, mirrored[firsts]])
        part = sparse.coo_array((values, (rows, np.tile(columns, 2))), shape=(model.size, len(firsts))).tocsr()
        parts.append(part)
    return [part for part in parts if part.shape[1]]
