"""The `Method` by which one body is computed, apart from what it is; the body computed, and the same as a spring."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Final, Literal

import numpy as np

from impact.greens.base import Array, ErrorEstimate, GreensFunction
from impact.greens.modal import ModalGreens, Residual
from impact.notices import Progress, SeatfemError, silent
from impact.quantities import check_numbers
from seatfem.machine.resources import Stopwatch
from seatfem.structures import lip as lips
from seatfem.structures import model as models
from seatfem.structures.errors import ModelError
from seatfem.structures.mesh import meshing, plane_meshes
from seatfem.structures.reduction import factorization
from seatfem.structures.reduction import modes as reduced_modes
from seatfem.structures.rings import Division, join_all_parts

Level = Literal["rod", "axisymmetric", "harmonics", "sector", "3d"]
"""Models of a body by finite elements, or by a rod in their place."""
AnyLevel = Literal["closed form", "spring", "rod", "axisymmetric", "harmonics", "sector", "3d"]
"""All models of a body: `Level`, closed forms, and the static compliance of finite elements alone."""

LEFT: Final = 1e-3  # share of a motion that counts as forgotten
LOWEST: Final = 0.1  # lowest frequency of interest, over the band; every reduction finds slower motions first
AUTO: Final = "auto"
"""Name in place of a reduction's: the cheapest that is suitable."""
CHEAPEST_FIRST: Final[tuple[Level, ...]] = ("rod", "axisymmetric", "harmonics", "sector", "3d")
DISCRETE: Final[tuple[Level, ...]] = ("axisymmetric", "harmonics", "sector", "3d")
BEYOND: Final = 3.0  # highest frequency of the pairs of a lip's harmonics that are kept, over the band
ARC_ERROR: Final = 0.002  # largest error of an arc's compliance by harmonics that are extrapolated
MOST_MODES: Final = 3000  # most modes of a body in space that is struck in arcs: minutes
QUARTERS: Final = 4  # sectors of a body of revolution, a bar, a block: wide enough to be meshed well
COARSENING: Final = 1.6  # element size of the mesh that gives the mesh error, over the run's
PER_WAVELENGTH: Final[Mapping[Level, float]] = {"rod": 1, "axisymmetric": 6, "harmonics": 6, "sector": 4, "3d": 3}
"""Second-order elements per shear wavelength at the band edge, where the scene gives no size."""
NAMES: Final[Mapping[Level, str]] = {
    "rod": "rod, closed form",
    "axisymmetric": "finite elements, axisymmetric",
    "harmonics": "finite elements, Fourier harmonics in the angle",
    "sector": "finite elements, one of several equal sectors",
    "3d": "finite elements, 3-D",
}


Solver = Literal["double", "single", "two grids"]
"""Vectors of a basis are solved for by a factor in double or in single precision, or by conjugate gradients."""
SINGLE_FROM: Final = 20_000  # unknowns, from which on factors in single precision save more than they cost to judge
ITERATED_FROM: Final = 100_000  # unknowns a port of a cube, from which on conjugate gradients are faster than a factor
_LOOSE: Final = 1e-3  # tolerance of g, from which on vectors of rounded solutions are as many as those of exact ones
_OF_TOLERANCE: Final = 0.01  # that a vector may be off: what g misses by it is of second order


def allowed_error(size: float, tolerance: float) -> float:
    """Return by how much the solutions behind the vectors of a reduction may be off, relatively; 0: not at all.

    Whatever the vectors, K and M are projected on them in double precision, so that the pairs are Ritz pairs, and what
    they miss is seen by the growth of the space. ``tolerance``: of g.
    """
    return _OF_TOLERANCE * tolerance if size >= SINGLE_FROM and tolerance >= _LOOSE else 0.0


def compactness(elements: float, surface: float, *, cells: int = 6, faces: int = 12) -> float:
    """Return how compact a body of ``elements`` with ``surface`` faces outside is: 1 for a cube, less for plates, bars.

    The fill of a factor falls with it. ``cells``, ``faces``: elements, and faces on the surface, of a cell of a cube.
    """
    return min(1.0, float(faces * (elements / cells) ** (2 / 3)) / surface)


def cheapest_solver(size: float, ports: float, compact: float, tolerance: float) -> Solver:
    """Return what solves in the least time for the vectors of a solid with ``size`` unknowns and ``ports``.

    ``compact``: its `compactness`; ``tolerance``: of g.
    """
    if not allowed_error(size, tolerance):
        return "double"
    return "two grids" if compact * size >= ITERATED_FROM * ports else "single"


@dataclass(frozen=True)
class Aims:
    """Band, duration and tolerance of a reduction, and its limits.

    Attributes:
        bandwidth: highest frequency that must be right [Hz].
        duration: how long g is needed [s].
        tolerance: largest relative error of g after a Hann pulse of width 1/bandwidth.
        max_vectors: most Krylov vectors; ``None``: the reduction's own limit.
        backend: of sparse factorizations.

    Raises:
        ModelError: a number that is not positive and finite.
    """

    bandwidth: float
    duration: float
    tolerance: float
    max_vectors: int | None = None
    backend: factorization.Backend = "auto"

    def __post_init__(self) -> None:
        for name in ("bandwidth", "duration", "tolerance"):
            value = getattr(self, name)
            check_numbers(ModelError, **{name: value})
            if not (value > 0 and math.isfinite(value)):
                raise ModelError(f"{name} = {value} must be positive and finite")
        if self.max_vectors is not None and self.max_vectors < 1:
            raise ModelError(f"max_vectors = {self.max_vectors} must be at least 1")

    @property
    def width(self) -> float:
        """Return the width of the Hann pulse after which g is judged, 1/bandwidth [s]."""
        return 1 / self.bandwidth

    @property
    def band(self) -> float:
        """Return the edge of the band, 2 pi bandwidth [rad/s]."""
        return 2 * math.pi * self.bandwidth


def memory(damping_ratio: float, bandwidth: float) -> float:
    """Return after how long uniform damping has forgotten the tail of the band, ln(1000)/(zeta 2 pi 0.1 bandwidth) [s].

    A thousandth of the motion at its lowest frequency of interest is left then. Without damping: never, ``inf``.
    """
    if damping_ratio <= 0:
        return math.inf
    return -math.log(LEFT) / (damping_ratio * 2 * math.pi * LOWEST * bandwidth)


@dataclass(frozen=True)
class Method:
    """The way in which one body's Green's function is computed.

    Attributes:
        level: how much of the body is modelled.
        bandwidth: of the reduction [Hz]; ``None`` where nothing is reduced.
        tolerance: of the reduction.
        reduction: by name; "auto" chooses.
        max_vectors: most Krylov vectors; ``None``: the reduction's own limit.
        size, contact_size: of the elements, in the bulk and on the struck faces [m]; ``None``: from the bandwidth.
        order: of the elements.
        rings: parts of the struck patch, each a port; ``None``: as a file has them.
        n_modes: of a body known by its own modes, such as a beam; ``None`` where it has none.
        behind: of a striker, where a stopper meets it in parts; ``None``: at its own contact.
        lip: the ring that is struck, in arcs, where it is not struck as a whole; ``None``: at its own contact.
    """

    level: AnyLevel = "closed form"
    bandwidth: float | None = None
    tolerance: float = 0.01
    reduction: str = "auto"
    max_vectors: int | None = None
    size: float | None = None
    contact_size: float | None = None
    order: int = 2
    rings: int | None = 1
    n_modes: int | None = None
    lip: lips.AnyLip | None = None
    behind: lips.AnyLip | None = None

    @property
    def static(self) -> bool:
        """Return whether only the static compliance of the body is used, without waves."""
        return self.level == "spring"

    @property
    def in_arcs(self) -> bool:
        """Return whether a lip is struck in several arcs, or in part."""
        return self.lip is not None and (self.lip.arcs > 1 or self.lip.is_part)

    @property
    def division(self) -> Division:
        """Return the division of the struck patch into ports."""
        return Division(1 if self.lip is None else self.lip.arcs, self.rings or 1)

    def divided(self, division: Division) -> Method:
        """Return the method with the struck patch in other parts."""
        arcs, rings = division.arcs, division.rings
        lip = None if self.lip is None else replace(self.lip, arcs=arcs, rings=rings)  # type: ignore[type-var]
        return replace(self, rings=rings, lip=lip)

    @property
    def exact(self) -> bool:
        """Return whether there is nothing to discretise."""
        return self.level in ("rod", "closed form")


@dataclass(frozen=True)
class Task:
    """The computation of one body's Green's function.

    Attributes:
        method: how it is computed.
        duration: duration of the runs for which it must be known [s].
        watch: stopwatch of its stages.
        progress: receiver of their progress.
        mesh_error: whether a drawn body is also solved on a coarser mesh.
    """

    method: Method
    duration: float
    watch: Stopwatch = field(default_factory=Stopwatch)
    progress: Progress = silent
    mesh_error: bool = True


@dataclass(frozen=True)
class Applicability:
    """The statement whether a level describes a structure.

    Attributes:
        level: of modelling.
        applies: the level can be run at all.
        error: relative error of g that the level itself makes at the band edge; 0 where it leaves nothing out.
        reason: in words.
    """

    level: AnyLevel
    applies: bool
    error: float
    reason: str

    @staticmethod
    def refused(level: AnyLevel, reason: str) -> Applicability:
        """Return the applicability of one that cannot be run."""
        return Applicability(level, False, math.inf, reason)


class LevelError(SeatfemError, ValueError):
    """A level that does not describe the structure; the message names key, reason and a level that does."""


def choose_level(found: tuple[Applicability, ...], error: float, named: str = "auto") -> Applicability:
    """Return the level ``named``, or the cheapest whose own error is at most ``error``.

    Of a spring, whose compliance finite elements give, the cheapest that leaves nothing out.

    Raises:
        LevelError: the named level does not apply.
    """
    if named in ("auto", "spring"):
        limit = error if named == "auto" else 0.0
        return next(level for level in found if level.applies and level.error <= limit)
    chosen = next(level for level in found if level.level == named)
    if not chosen.applies:
        others = ", ".join(level.level for level in found if level.applies)
        raise LevelError(f"seat.model = {named!r} does not apply: {chosen.reason}; choose one of {others}")
    return chosen


@dataclass(frozen=True)
class Solved:
    """A structure's Green's function and, where finite elements made it, the mesh and modes behind it.

    Attributes:
        greens: its Green's function.
        coarser: the same on a mesh coarser by `COARSENING`, in truth by ``refinement``.
        mesh, model, modes: behind it; ``None`` where there are none, or it was computed before.
        coarser_mesh: behind ``coarser``, likewise.
        about: numbers and words for the summary.
        level_error: relative, of the level of modelling itself.
        refinement: ratio of the element sizes of the two meshes.
        in_rings: a model whose patch is in `rings_to_compare` rings, on the coarser mesh where there is one.
        plane: the patch moves as a plane, whatever presses it.
        reused: it was computed before.
    """

    greens: GreensFunction
    coarser: GreensFunction | None = None
    mesh: meshing.SeatMesh | plane_meshes.MeridianMesh | None = None
    model: models.SecondOrderModel | None = None
    modes: reduced_modes.Modes | None = None
    about: Mapping[str, object] = field(default_factory=dict)
    level_error: float = 0.0
    refinement: float = COARSENING
    in_rings: GreensFunction | None = None
    plane: bool = False
    reused: bool = False
    coarser_mesh: meshing.SeatMesh | plane_meshes.MeridianMesh | None = None

    @property
    def functions(self) -> Solved:
        """Return the Green's functions alone: meshes, matrices and modes are large."""
        return replace(self, mesh=None, model=None, modes=None, coarser_mesh=None)


START: Final = "initial_value"
"""Key of a spring's provenance that holds g(0+) of the whole patch [m/(N s)], which a spring cannot have."""


def replace_waves(greens: ModalGreens) -> ModalGreens:
    """Return the function with its static compliance in place of all waves."""
    start = float(join_all_parts(greens).initial_value()[0, 0])
    return replace(spring_of(greens.static_compliance(), start, greens.port_names, greens.origin), error=greens.error)


def with_start(greens: GreensFunction) -> GreensFunction | None:
    """Return a spring as the exponential of the same compliance that has a g(0+); ``None`` of what is no spring."""
    modal = greens.modal
    if modal is None or not isinstance(start := modal.provenance.get(START), float) or start <= 0:
        return None
    rest = Residual.exponential(modal.static_compliance(), np.diag(start / Division.from_greens(modal).shares))
    return replace(modal, residual=rest)


def replace_waves_in_arcs(greens: GreensFunction) -> ModalGreens:
    """Return a body in arcs with its static compliance in place of all waves, which begins as it does."""
    rest = Residual.exponential(greens.static_compliance(), np.diag(np.diag(greens.initial_value())))
    none = np.zeros(0)
    return ModalGreens(none, none, np.zeros((0, len(greens.ports))), rest, greens.ports)


def bed(division: Division, stiffness: float) -> ModalGreens:
    """Return springs of the total ``stiffness`` [N/m] under the parts of a patch, which do not know of each other."""
    return spring_of(np.diag(1 / (stiffness * division.shares)), 0.0, division.names, {"kind": "bed of springs"})


def spring_of(compliance: Array, start: float, names: tuple[str, ...], origin: Mapping[str, object]) -> ModalGreens:
    """Return a compliance (p, p) [m/N] that remembers g(0+) of the whole patch, ``start`` [m/(N s)]."""
    none = np.zeros(0)
    return ModalGreens(
        none,
        none,
        np.zeros((0, len(names))),
        Residual.spring((compliance + compliance.T) / 2),
        names,
        ErrorEstimate(reduction=0.0),
        {**origin, START: start},
    )
