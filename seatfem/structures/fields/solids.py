"""Stress of solids in three dimensions and of bodies of revolution, harmonic by harmonic or in arcs of a ring.

Stress is evaluated at each point by the element's shape functions and averaged over the elements that meet there. With
elements of order p its error falls at least as h^p where the displacement is smooth.

sigma(r, th, z) = sum_n A_n cos n th + B_n sin n th     rr, tt, zz, rz
                      sum_n A_n sin n th - B_n cos n th     tz, rt

with A_n the amplitudes under the ring forces sum_i s_ni cos(n th_i) F_i, B_n those under sin(n th_i) (`RingPatch`).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from seatfem.structures.elements import assembly, axisymmetric
from seatfem.structures.elements.shape_functions import Discretization, discretize, gradients, values
from seatfem.structures.fields import peaks, recovery
from seatfem.structures.fields.sites import Array, Sites
from seatfem.structures.materials import Solid
from seatfem.structures.model import DofMap, ModelError, SecondOrderModel
from seatfem.structures.reduction.harmonics import RingPatch, mixing_of

COMPONENTS: Final = ("xx", "yy", "zz", "yz", "xz", "xy")
"""Stress components; in a body of revolution amplitudes rr, tt, zz, tz, rz, rt of cos(n th), tz and rt of sin(n th)."""
_TO_AXIS: Final = 1e-4  # fraction of an element by which a point on the axis is moved inwards, to keep 1/r finite
_BLOCK: Final = 1024  # sites whose rows are computed at once
_INDICES: Final = ((0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1))  # tensor indices of `COMPONENTS`


def elements_of(mesh: Any, order: int = 0) -> Discretization:
    """Return the elements of a mesh, numbered as in `assemble` or, for a meridian mesh, `assemble_axisymmetric`."""
    mesh = getattr(mesh, "mesh", mesh)
    if mesh.dim() == 3:
        return discretize(mesh, order)
    section = axisymmetric.Section.from_mesh(mesh, order)
    corners = np.ascontiguousarray(mesh.dofs.element_dofs.T, dtype=np.int32)
    cells = np.ascontiguousarray(section.cells.T, dtype=np.int32)
    places = np.ascontiguousarray(mesh.doflocs.T)
    return Discretization(mesh, section.element, mesh.elem(), section.order, cells, corners, places, False)


@dataclass(frozen=True)
class StressOperator:
    """Operator C (6 P, n): C @ u is the stress `COMPONENTS` at P sites [Pa] of the unknowns u (n,) or (n, k).

    Each product computes the rows anew, `_BLOCK` sites at once: the matrix of 20,000 sites would take a gigabyte.
    """

    made: Discretization
    dofs: DofMap
    sites: Sites
    elasticity: Array
    strain: Callable[[Discretization, Sites], Array]

    def __matmul__(self, unknowns: Array) -> Array:
        out = np.empty((6 * len(self.sites), *unknowns.shape[1:]))
        for first in range(0, len(self.sites), _BLOCK):
            chosen = np.zeros(len(self.sites), dtype=bool)
            chosen[first : first + _BLOCK] = True
            out[6 * first : 6 * (first + _BLOCK)] = self._rows(self.sites.at(chosen)) @ unknowns
        return out

    def _rows(self, sites: Sites) -> sparse.csr_array:
        strain = self.strain(self.made, sites)
        flat = strain.reshape(len(strain), 6, -1)
        stress = self.elasticity[sites.element] @ flat * sites.share[:, None, None]
        rows = 6 * sites.site[:, None, None] + np.arange(6)[:, None]
        cells = self.made.cells[sites.element].astype(np.int64)
        columns = (3 * cells[:, :, None] + np.arange(3)).reshape(len(flat), 1, -1)
        rows, columns = np.broadcast_arrays(rows, columns)
        shape = (6 * len(sites), 3 * self.made.size)
        nodal = sparse.coo_array((stress.ravel(), (rows.ravel(), columns.ravel())), shape).tocsr()
        dofs = self.dofs
        return sparse.csr_array(nodal[:, dofs.free] if dofs.turned is None else nodal @ dofs.turned)


def solid_stress(
    made: Discretization,
    material: Solid | Mapping[str, Any],
    model: SecondOrderModel,
    sites: Sites,
    *,
    harmonic: int = 0,
) -> StressOperator:
    """Return the operator from a model's unknowns to the stress at sites.

    Args:
        made: the elements (`elements_of`).
        material: the material of the model's assembly.
        model: the model, with its `DofMap`.
        sites: points at which stress is evaluated.
        harmonic: circumferential order n of a body of revolution: C u are amplitudes as `COMPONENTS` says.

    Raises:
        ModelError: the model is not of these elements, or a material is nearly incompressible: its elements project
            the volume change, so that the stress does not follow from the displacement alone.
    """
    dofs = model.dofs
    if dofs is None or dofs.points.shape[1] != made.size:
        raise ModelError("the model's unknowns are not those of these elements: use the mesh and order of its assembly")
    solids, region = assembly.solids_by_region(made.mesh, material)
    elasticity = np.array([solid.elasticity for solid in solids])
    if (soft := axisymmetric.nearly_incompressible(elasticity, assembly.PROJECT_ABOVE)).any():
        name = solids[int(np.argmax(soft))].name
        raise ModelError(f"material {name!r}: poisson must be at most {assembly.PROJECT_ABOVE} for stress to be known")
    return StressOperator(made, dofs, sites, elasticity[region], _strain if made.mesh.dim() == 3 else _around(harmonic))


def _slopes(made: Discretization, element: Any, inside: Array) -> Array:
    """Return the (E, L, d) gradients of the L shape functions in space [1/m], at reference coordinates (d, E)."""
    jacobian = np.einsum("evc,eva->eac", gradients(made.geometry, inside), made.places[made.corners[element]])
    return np.asarray(gradients(made.element, inside) @ np.linalg.inv(jacobian))


def _strain(made: Discretization, sites: Sites) -> Array:
    """Return the (E, 6, L, 3) strains of unit nodal displacements, with engineering shear strains."""
    slopes = _slopes(made, sites.element, sites.inside)
    out = np.zeros((len(slopes), 6, slopes.shape[1], 3))
    for row, (a, b) in enumerate(_INDICES):
        out[:, row, :, a] = slopes[..., b]
        out[:, row, :, b] = slopes[..., a]
    return out


def _around(harmonic: int) -> Callable[[Discretization, Sites], Array]:
    """Return the (E, 6, L, 3) strains of unit amplitudes (U, V, W) of a harmonic, as in `elements.axisymmetric`."""

    def strain(made: Discretization, sites: Sites) -> Array:
        on_axis = sites.points[sites.site, 0] <= _TO_AXIS * _TO_AXIS * made.places[:, 0].max()
        centre = np.asarray(made.element.refdom.p, dtype=float).mean(axis=1)[:, None]
        inside = sites.inside + np.where(on_axis, _TO_AXIS, 0.0) * (centre - sites.inside)
        slopes = _slopes(made, sites.element, inside)
        radius = np.einsum("ev,ev->e", values(made.geometry, inside), made.places[made.corners[sites.element], 0])
        by_r, by_z, over = slopes[..., 0], slopes[..., 1], values(made.element, inside) / radius[:, None]
        out = np.zeros((len(slopes), 6, slopes.shape[1], 3))
        axisymmetric.revolved_strains(by_r, by_z, over, harmonic, out.transpose(0, 2, 1, 3))
        return out

    return strain


LEFT: Final = 0.05  # rms pressure, around the ring, of the truncated harmonics over that of all harmonics
UNFELT: Final = 1e-9  # amplitude below which a harmonic counts as unexcited, over that of the largest harmonic
_BY_COS: Final = [0, 1, 2, 4]  # components that vary as cos(n th) under cosine forces
_BY_SIN: Final = [3, 5]  # components that vary as sin(n th) under cosine forces


@dataclass(frozen=True)
class Harmonic:
    """Response of one Fourier harmonic, and how port forces excite it.

    Attributes:
        number: circumferential order n.
        field: stress amplitudes at G places of the half section, under amplitudes of the ring forces.
        mixing: (ports, rings, 2) cosine and sine amplitude on each ring of a unit force on each port.
    """

    number: int
    field: recovery.StressField
    mixing: Array


@dataclass(frozen=True)
class RingField:
    """Stress at G places of a half section, each at A angles; its components rr, tt, zz, tz, rz, rt.

    Attributes:
        section: (G, 2) r and z of the places [m].
        angles: (G, A) angles around the axis [rad].
        harmonics: Fourier harmonics, whose sum is the stress.
    """

    section: Array
    angles: Array
    harmonics: tuple[Harmonic, ...]

    @property
    def points(self) -> Array:
        r, z = (np.broadcast_to(x[:, None], self.angles.shape) for x in self.section.T)
        return np.stack([r * np.cos(self.angles), r * np.sin(self.angles), z], axis=-1).reshape(-1, 3)

    @property
    def radians(self) -> Array:
        return np.concatenate([harmonic.field.radians for harmonic, _ in self._waves])

    @property
    def bounds(self) -> Array:
        bounds = []
        for harmonic, _ in self._waves:
            fields = np.swapaxes(harmonic.field.fields, 1, 2)
            parts = [peaks.norms(np.where(np.isin(np.arange(6), of), fields, 0.0)) for of in (_BY_COS, _BY_SIN)]
            bounds.append(np.maximum(*parts))  # the root of cos^2 |one|^2 + sin^2 |other|^2 is no larger
        return np.concatenate(bounds, axis=1)

    @cached_property
    def _waves(self) -> list[tuple[Harmonic, int]]:
        """Return the W pairs of a harmonic and cos (0) or sin (1) that forces can excite."""
        return [(harmonic, k) for harmonic in self.harmonics for k in (0, 1) if np.any(harmonic.mixing[:, :, k])]

    @cached_property
    def _ends(self) -> peaks.Integers:
        """Return the (W + 1,) offsets of the coordinates of each of `_waves`; the last is the number of coordinates."""
        return np.cumsum([0, *(len(harmonic.field.radians) for harmonic, _ in self._waves)])

    @cached_property
    def _turns(self) -> Array:
        """Return the (2, G, A, W) angular factors of each of `_waves`, for rr, tt, zz, rz and for tz, rt."""
        out = np.empty((2, *self.angles.shape, len(self._waves)))
        for w, (harmonic, by_sin) in enumerate(self._waves):
            phase = harmonic.number * self.angles
            out[..., w] = (np.sin(phase), -np.cos(phase)) if by_sin else (np.cos(phase), np.sin(phase))
        return out

    def at(self, which: NDArray[np.int64] | NDArray[np.bool_]) -> RingField:
        """Return the field at the points ``which``, each as a place with one angle."""
        place, angle = np.divmod(np.arange(self.angles.size)[which], self.angles.shape[1])
        some = tuple(replace(harmonic, field=harmonic.field.at(place)) for harmonic in self.harmonics)
        return RingField(self.section[place], self.angles[place, angle][:, None], some)

    def coordinates(self, force: Array, dt: float, stride: int) -> Iterator[Array]:
        pushes = np.asarray(force, dtype=float).reshape(len(force), -1)
        parts = [wave.field.coordinates(pushes @ wave.mixing[:, :, k], dt, stride) for wave, k in self._waves]
        return (np.concatenate(blocks, axis=1) for blocks in zip(*parts, strict=True))

    def stress(self, which: peaks.Integers, values: Array, kept: peaks.Integers) -> Iterator[Array]:
        borders = np.searchsorted(kept, self._ends)
        excited = np.flatnonzero(np.diff(borders))
        amplitudes = np.empty((len(which), len(excited), 6, values.shape[1]))
        for row, w in enumerate(excited):
            own = slice(borders[w], borders[w + 1])
            (stress,) = self._waves[w][0].field.stress(which, values[own], kept[own] - self._ends[w])
            amplitudes[:, row] = stress[:, 0]
        out = np.empty((self.angles.shape[1], 6, values.shape[1]))
        for place, waves in zip(which, amplitudes, strict=True):
            cos, sin = self._turns[:, place][:, :, excited]
            for of, turn in ((slice(0, 3), cos), (slice(3, 4), sin), (slice(4, 5), cos), (slice(5, 6), sin)):
                size = (of.stop - of.start) * values.shape[1]
                np.matmul(turn, waves[:, of].reshape(-1, size), out=out[:, of].reshape(-1, size))
            yield out[None]


AnyField = recovery.StressField | RingField


def turned(amplitudes: Array, angles: Array, harmonic: int, *, by_sin: bool) -> Array:
    """Return the (..., n, 3 or 6) values at angles (n,) of amplitudes of one harmonic, u_r, u_th, u_z or rr, tt, zz,
    tz, rz, rt, under forces that vary as its cosine, or as its sine (``by_sin``)."""
    odd = [1] if amplitudes.shape[-1] == 3 else _BY_SIN
    phase = harmonic * angles[:, None]
    even_turn, odd_turn = (np.sin(phase), -np.cos(phase)) if by_sin else (np.cos(phase), np.sin(phase))
    return np.asarray(amplitudes * np.where(np.isin(np.arange(amplitudes.shape[-1]), odd), odd_turn, even_turn))


def felt(patches: Mapping[str, RingPatch], force: Array, most: int) -> list[int]:
    """Return the harmonics, at most up to order ``most``, beyond which only `LEFT` of the pressure of the forces (n +
    1, ports) lies; unexcited harmonics are omitted."""
    rings = list(dict.fromkeys(patch.boundary for patch in patches.values()))
    pushes = np.asarray(force, dtype=float).reshape(len(force), -1)
    far = max(4 * most, 4 * len(patches) // len(rings))
    sizes = np.array(
        [
            np.abs(np.tensordot(pushes, mixing_of(patches, rings, n), axes=1)).max(axis=0, initial=0.0).max()
            for n in range(far + 1)
        ]
    )
    squares = np.where(np.arange(far + 1) > 0, 2.0, 1.0) * sizes**2  # Parseval's
    beyond = np.cumsum(squares[::-1])[::-1]  # sum over this harmonic and all higher ones
    last = min(most, int(np.flatnonzero(beyond > LEFT**2 * beyond[0]).max(initial=0)))
    return [n for n in range(last + 1) if n == 0 or sizes[n] > UNFELT * sizes.max()]
