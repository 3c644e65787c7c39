"""Estimates of a body without a mesh: struck patch, element sizes for an error of g, a rod behind the patch, and the
local compliance under a lip in arcs.

error of g = PATCH (contact_size/width)^1.5 + size (WAVE band/c_s + BODY/depth)

with the width of the struck face, the shear wavelength c_s/band at the bandwidth, and the depth of the body behind the
face; elements of order 2. The constants bound errors measured on seats of every kind but the finest plates.

g(t) = rod of the patch's area and impedance, with the body's static compliance + the plate's first mode

so that g(0+) = 1/(rho c_p A) is exact, and the static compliance is estimated. Waves return undiminished from the end
of a rod, unlike in a bulky body: the estimate needs a wider band than the body will.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

import numpy as np

from impact.exact.half_space import disk_compliance, square_compliance
from impact.greens import base, modal
from seatfem.structures import materials, rings
from seatfem.structures.kinds.parts import Support
from seatfem.structures.lip import AnyLip

if TYPE_CHECKING:
    from seatfem.structures.inspection.cad import Shape


OFF_CENTRE: Final = 1.5  # (R + r)/R of a force half way between a clamped plate's centre and its rim
FIRST_WAVE: Final = 4.0  # first resonance of a bulky body: its depth is a quarter of a wavelength
_BENDING_LOAD: Final = 1 / (16 * math.pi)  # centre of a clamped round plate under a central force: w = F R^2/(16 pi D)
_FUNDAMENTAL: Final = 10.22  # of a clamped round plate: w_1 = 10.22/R^2 sqrt(D/(rho t)). Leissa, Vibration of Plates


@dataclass(frozen=True)
class Patch:
    """The struck patch and the body behind it.

    Attributes:
        area: struck area [m^2].
        width: narrowest extent of the struck faces [m].
        depth: depth of the body behind the patch [m].
        compliance: estimated static compliance of the body without bending [m/N].
        density, c_p, c_s: density and wave speeds of the material [kg/m^3, m/s].
        bending: static bending compliance of the plate that the patch lies on; 0 for a bulky body [m/N].
        bending_frequency: angular frequency of that plate's first mode [rad/s]; 0 for a bulky body.
        one_dimensional: whether waves travel along a bar and return undiminished.
    """

    area: float
    width: float
    depth: float
    compliance: float
    density: float
    c_p: float
    c_s: float
    bending: float = 0.0
    bending_frequency: float = 0.0
    one_dimensional: bool = False

    @property
    def impedance(self) -> float:
        """Return the impedance rho c_p A of the patch, force over velocity at the first instant [N s/m]."""
        return self.density * self.c_p * self.area

    @property
    def first_resonance(self) -> float:
        """Return the approximate first resonance of the body, for a plate in bending [Hz]."""
        return self.bending_frequency / (2 * math.pi) or self.c_p / (FIRST_WAVE * self.depth)


def bulky(solid: materials.Material, area: float, width: float, depth: float) -> Patch:
    """Return the patch of a bulky body: the compliance of a half-space under a disk of the same area, or of a column of
    this area and depth if that is stiffer."""
    radius = math.sqrt(area / math.pi)
    local = disk_compliance(young=solid.young, poisson=abs(solid.poisson), radius=radius)  # even in nu
    column = depth / (solid.density * solid.c_p**2 * area)
    return Patch(area, width, depth, min(local, column), solid.density, solid.c_p, solid.c_s)


def column_end(solid: materials.Material, area: float, width: float, length: float) -> Patch:
    """Return the patch at the end of a straight bar."""
    compliance = length / (solid.young * area)
    return Patch(area, width, length, compliance, solid.density, solid.c_p, solid.c_s, one_dimensional=True)


def add_plate_bending(patch: Patch, solid: materials.Material, radius: float, solidity: float) -> Patch:
    """Return the patch on a clamped round plate of this radius [m], of which holes leave a fraction ``solidity``."""
    stiffness = solidity * solid.young * patch.depth**3 / (12 * (1 - solid.poisson**2))
    bending = _BENDING_LOAD * radius**2 / stiffness
    frequency = _FUNDAMENTAL / radius**2 * math.sqrt(stiffness / (solidity * solid.density * patch.depth))
    return replace(patch, bending=bending, bending_frequency=frequency)


def find_patch(shape: Shape, supports: Sequence[Support], solid: materials.Material) -> Patch:
    """Return the patch of a CAD part: bulky, and on a plate in bending if its supports lie beside the struck faces.

    The plate's compliance is that of a clamped round one under a force off its centre,
    w = F (R^2 - r^2)^2/(16 pi D R^2) with the span R - r (Timoshenko and Woinowsky-Krieger, Theory of Plates and
    Shells, 1959, article 64). Springs that hold a body without clamped faces add their compliance.
    """
    depth, mass = shape.depth("contact"), solid.density * shape.volume
    local = bulky(solid, shape.area("contact"), shape.width("contact"), depth)
    held = ["fixed", *(support.on for support in supports if support.holds)]
    bending = frequency = 0.0
    if (span := shape.span("contact", held)) > 0:
        filled = min(1.0, shape.volume / float(shape.extent.prod()))
        plate = add_plate_bending(local, solid, OFF_CENTRE * span, filled)
        radius = float(np.sort(shape.extent)[1]) / 2
        bending = plate.bending
        frequency = plate.bending_frequency * (OFF_CENTRE * span / radius) ** 2
    springs = {support.on: support.stiffness for support in supports if support.stiffness > 0}
    stiffness = sum(each * shape.area(on) for on, each in _select_springs(springs, shape.groups).items())
    if "fixed" not in shape.groups and stiffness > 0:
        bending += 1 / stiffness
        own = math.sqrt(stiffness / mass)
        frequency = own if frequency == 0 else 1 / math.hypot(1 / own, 1 / frequency)
    return replace(local, bending=bending, bending_frequency=frequency)


def _select_springs(springs: dict[str, float], groups: Collection[str]) -> dict[str, float]:
    return {on: each for on, each in springs.items() if on in groups}


PATCH: Final = 0.03
PATCH_ORDER: Final = 1.5  # order of convergence with the elements: 1 at sharp edges, 2 elsewhere
WAVE: Final = 0.03
BODY: Final = 0.02
BENT: Final = 0.12  # in place of `BODY` for a plate that bends on a clamped rim
ACROSS: Final = 0.5  # width of the struck face over the largest element of order 2 on it
FIRST_ORDER: Final = 6.0  # error with elements of order 1 over that with order 2
ERRORS: Final = (0.5, 0.3, 0.2, 0.13, 0.09, 0.06, 0.04, 0.025, 0.016, 0.01, 0.006, 0.004, 0.0025, 0.0016, 0.001)
"""Errors of g for which meshes are made: few values, so that scenes with different contacts can share a cached seat."""


@dataclass(frozen=True)
class Sizes:
    """Element sizes [m]: in the bulk and on the struck face."""

    size: float
    contact_size: float


def sizes_for(patch: Patch, band: float, error: float, order: int = 2) -> Sizes:
    """Return the coarsest sizes with an error of g of at most ``error``, half of it at the patch, half in the bulk."""
    half = error / 2 / _order(order)
    contact = patch.width * min(1 / ACROSS, (half / PATCH) ** (1 / PATCH_ORDER))
    size = min(patch.depth, patch.c_s / band, half / _per_size(patch, band))
    return Sizes(_rounded(max(size, contact)), _rounded(contact))


def mesh_error(patch: Patch, band: float, sizes: Sizes, order: int = 2) -> float:
    """Return the estimated relative error of g by the mesh."""
    local = PATCH * (min(sizes.contact_size, 2 * patch.width) / patch.width) ** PATCH_ORDER
    return float(_order(order) * (local + sizes.size * _per_size(patch, band)))


def per_wavelength(patch: Patch, band: float, sizes: Sizes) -> float:
    """Return the number of elements per shear wavelength at the bandwidth."""
    return patch.c_s / (band * sizes.size)


def _per_size(patch: Patch, band: float) -> float:
    return WAVE * band / patch.c_s + (BENT if patch.bending > 0 else BODY) / patch.depth


def _order(order: int) -> float:
    return FIRST_ORDER if order == 1 else 1.0


def _rounded(size: float) -> float:
    """Return the number rounded down to two digits."""
    unit = 10.0 ** (math.floor(math.log10(size)) - 1)
    return float(f"{math.floor(size / unit * (1 + 1e-9)) * unit:.3g}")


MODES: Final = 40  # modes of the rod
SPREADING: Final = 0.2  # damping ratio in place of the geometric spreading of waves in three dimensions


def rod_behind(patch: Patch, damping: float) -> modal.ModalGreens:
    """Return an estimate of the response of a body behind a patch, with this modal damping ratio: a rod as stiff as the
    body, whose waves go and, unless it is a bar, hardly return."""
    ratio = damping if patch.one_dimensional else max(damping, SPREADING)
    length = patch.compliance * patch.density * patch.c_p**2 * patch.area
    omega = (np.arange(MODES) + 0.5) * math.pi * patch.c_p / length
    shapes = np.full(MODES, math.sqrt(2 / (patch.density * patch.area * length)))
    left_out = patch.compliance - float(np.sum(shapes**2 / omega**2))
    rest = modal.Residual.exponential(left_out, 1 / patch.impedance)
    zeta = np.full(MODES, ratio)
    if patch.bending > 0:
        omega = np.append(omega, patch.bending_frequency)
        shapes = np.append(shapes, patch.bending_frequency * math.sqrt(patch.bending))
        zeta = np.append(zeta, damping)
    return modal.ModalGreens(np.asarray(omega, dtype=np.float64), zeta, shapes[:, None], rest)


CELLS: Final = 4  # cells across each ring; along each arc as many as make those of the narrowest ring about square
MOST_CELLS: Final = 64  # most cells along an arc
OF_A_FAR_PART: Final = 4  # cells along the longer side of a part, for the mean of 1/r to distant parts
APART: Final = 2.0  # least distance of these, over the longer side of a part: the mean of 1/r is right to 2e-3
HALF_APART: Final = 2  # factor on these cells for parts nearer by the same factor


def arc_compliance(lip: AnyLip, young: float, poisson: float) -> base.Array:
    """Return the (ports, ports) mean displacement of parts of a lip on a half-space under a unit load on each [m/N].

    Boussinesq's (1 - nu^2)/(pi E r) between cells, and the mean displacement of a loaded square within each; distant
    parts have few cells. On a circle one arc is computed and rotated. Source: Johnson, Contact Mechanics, 3.2.
    """
    narrowest = lip.area / lip.length * float(rings.ring_shares(lip.rings).min())
    along = int(np.clip(round(CELLS * lip.length / (lip.arcs * narrowest)), 1, MOST_CELLS))
    cells, areas = lip.cells(along, CELLS)
    fine = cells.reshape(lip.arcs * lip.rings, -1, 2)
    longer = max(lip.length / lip.arcs, lip.area / lip.length / lip.rings)
    coarse, middle = (_few_cells(lip, number / longer) for number in (OF_A_FAR_PART, HALF_APART * OF_A_FAR_PART))
    fewer = min(middle, fine, key=lambda places: places.shape[1])
    own = [square_compliance(young=young, poisson=poisson, side=float(np.sqrt(a))) / (along * CELLS) for a in areas]
    compliance = np.empty((len(fine), len(fine)))
    for part in range(lip.rings if lip.is_round else len(fine)):
        first = 0 if lip.is_round else part
        x, y = (np.subtract.outer(coarse[part, :, axis], coarse[first:, :, axis]) for axis in (0, 1))
        away = np.sqrt(x * x + y * y)
        row = np.divide(1, away, out=np.zeros_like(away), where=away > 0).mean(axis=(0, 2))
        least = away.min(axis=(0, 2))
        for other in np.flatnonzero(least < APART * longer):
            places = fine if least[other] < APART * longer / HALF_APART else fewer
            row[other] = _mean_inverse(places[part], places[first + other])
        compliance[part, first:] = row * (1 - poisson**2) / (np.pi * young)
        compliance[part, part] += own[part % lip.rings]
    if lip.is_round:
        for arc in range(1, lip.arcs):
            rows = slice(arc * lip.rings, (arc + 1) * lip.rings)
            compliance[rows] = np.roll(compliance[: lip.rings], arc * lip.rings, axis=1)
        return np.asarray((compliance + compliance.T) / 2)
    return np.asarray(np.triu(compliance) + np.triu(compliance, 1).T)


def _few_cells(lip: AnyLip, per_length: float) -> base.Array:
    """Return the (ports, cells, 2) centres of cells of each part, ``per_length`` along either side [1/m]."""
    sides = lip.length / lip.arcs, lip.area / lip.length / lip.rings
    few = [math.ceil(side * per_length * (1 - 1e-9)) for side in sides]
    return lip.cells(*few)[0].reshape(lip.arcs * lip.rings, -1, 2)


def _mean_inverse(places: base.Array, others: base.Array) -> float:
    """Return the mean of 1/r [1/m] between (n, 2) places and others, in single precision; 1/r is 0 at r = 0."""
    centre = places.mean(axis=0)
    (x, y), (u, v) = ((each - centre).astype(np.float32).T for each in (places, others))
    squares, more = np.subtract.outer(x, u), np.subtract.outer(y, v)
    squares *= squares
    more *= more
    squares += more
    squares[squares == 0] = np.inf
    return float(np.reciprocal(np.sqrt(squares, out=squares), out=squares).mean())


def divide_on_patch(whole: modal.ModalGreens, lip: AnyLip, patch: Patch) -> modal.ModalGreens:
    """Divide as `divide_in_arcs`, with the material of a struck ``patch``."""
    squared = (patch.c_p / patch.c_s) ** 2
    poisson = (squared - 2) / (2 * (squared - 1))
    young = 2 * patch.density * patch.c_s**2 * (1 + poisson)
    return divide_in_arcs(whole, lip, young, poisson, patch.impedance)


def divide_in_arcs(
    whole: modal.ModalGreens, lip: AnyLip, young: float, poisson: float, impedance: float
) -> modal.ModalGreens:
    """Return the Green's function of a body with its lip in parts, from that of the whole patch, g_1(t), and a
    half-space:

        g_ij(t) = g_1(t) + h_ij(t),   h the exponential from 1/Z_i of each part to the half-space's compliance

    less the mean of h over the lip, so that a uniform pressure on all of it causes g_1.

    Args:
        whole: Green's function with one port.
        lip: the lip in parts.
        young, poisson: elastic constants of the half-space [Pa].
        impedance: rho c_p A of the lip [N s/m].
    """
    shares = lip.division.shares
    deviation = np.eye(len(shares)) - np.outer(np.ones(len(shares)), shares)
    local = deviation @ arc_compliance(lip, young, poisson) @ deviation.T
    values, vectors = np.linalg.eigh((local + local.T) / 2)
    local = vectors * np.maximum(values, 0.0) @ vectors.T
    alike = whole.combined(np.ones((1, len(shares))), lip.division.names)
    rest = modal.Residual.exponential(local, np.diag(1 / (shares * impedance)))
    return replace(alike, residual=modal.Residual.together([alike.residual, rest]))
