"""The modes of a seat, all of them: whole bodies, and every harmonic of a body of revolution.

A port's load excites few of a body's modes, and a symmetric half or sector holds but those of its symmetry. So what is
asked for its modes is modelled whole: in space, or harmonic by harmonic with torsion, whose pairs count as two.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Final

import numpy as np

from impact.notices import Progress, silent
from seatfem.machine.resources import Stopwatch
from seatfem.structures import finite_elements, memory_need
from seatfem.structures.kinds.drawn import Drawn
from seatfem.structures.kinds.elastic import Elastic
from seatfem.structures.kinds.structure import Structure
from seatfem.structures.mesh import meshing, plane_meshes
from seatfem.structures.method import Level, Method
from seatfem.structures.model import Array, ModelError, SecondOrderModel
from seatfem.structures.reduction import factorization, harmonics
from seatfem.structures.reduction.modes import Modes, solve_modes

DEFAULT_COUNT: Final = 20
_FEWEST_SEEN: Final = 10  # fewest modes that a mesh must resolve
_FINER: Final = 2.5  # factor by which elements are finer than a band's: frequencies of a CAD body err by 0.5 %
_FAST: Final = 1.8  # speed of pressure waves over that of shear waves
_EMPTY: Final = 3  # harmonics in a row without a mode below the limit, after which the search ends
_FEWEST: Final = 5  # fewest harmonics searched: the lowest frequency of each first falls, then rises
_SAMPLED: Final = (16, 32, 64, 128, 256)  # harmonics whose static compliance is computed for an arc
_ALL: Final = 20000  # harmonics of the sum that their static compliance is extrapolated to


@dataclass(frozen=True)
class Mode:
    """One natural mode.

    Attributes:
        frequency_hz: [Hz]; 0 for a rigid motion.
        residual: of the eigenproblem, see `Modes`.
        share: of the port's static compliance that it holds, phi^2/(w^2 S); nan: rigid, or no port.
        shape: its displacements among the unknowns of ``model``.
        diameters: nodal diameters of a body of revolution, ``None`` for others.
        family: "cos" and "sin" of a pair, "torsion", "" else.
    """

    frequency_hz: float
    residual: float
    share: float
    model: SecondOrderModel = field(repr=False)
    shape: Array = field(repr=False)
    diameters: int | None = None
    family: str = ""

    @property
    def repeats(self) -> bool:
        """Return whether it is the second of a pair that differs by the angle alone."""
        return self.family == "sin"


@dataclass(frozen=True)
class NaturalModes:
    """The lowest modes of a seat, whose number is that of the inertia count.

    Attributes:
        modes: the lowest first.
        mesh: what they were computed on; ``None`` for matrices.
        dof: unknowns; of one harmonic.
        searched: in words.
    """

    modes: tuple[Mode, ...]
    mesh: meshing.SeatMesh | plane_meshes.MeridianMesh | None
    dof: int
    searched: str

    @cached_property
    def frequencies_hz(self) -> Array:
        """Return the (m,) frequencies [Hz]."""
        return np.array([mode.frequency_hz for mode in self.modes])


@dataclass(frozen=True)
class Wanted:
    """The number of modes, or the frequency [Hz] up to which; of both, what ends first."""

    count: float = math.inf
    up_to_hz: float = math.inf

    def __post_init__(self) -> None:
        if self.count < 1:
            raise ModelError(f"--count {self.count}: ask for at least one mode")

    @staticmethod
    def from_limits(count: int | None, up_to_hz: float | None) -> Wanted:
        """Return what is wanted, the 20 lowest where nothing is said."""
        if count is None and up_to_hz is None:
            return Wanted(DEFAULT_COUNT)
        return Wanted(math.inf if count is None else count, math.inf if up_to_hz is None else up_to_hz)


def modes_of(body: Structure, wanted: Wanted, watch: Stopwatch, progress: Progress = silent) -> NaturalModes | None:
    """Return a body's modes, complete by inertia, whatever excites them; ``None`` where there is nothing to take them
    from."""
    model, mesh = body.system_of_equations(), None
    if (elastic := body.elastic) is not None:
        drawn = body.drawn
        around = drawn is not None and drawn.traits.revolved and drawn.isotropic and drawn.model != "3d"
        with watch("mesh"):
            mesh = (
                elastic.meshes(Method(), progress)[0]
                if drawn is None
                else _drawn(drawn, "harmonics" if around else "3d", wanted, progress)
            )
        if isinstance(mesh, plane_meshes.MeridianMesh):
            with watch("modes"):
                return _around(elastic, mesh, wanted, progress)
        memory_need.check_elastic(elastic, mesh, "3d", Method(reduction="modes"))
        with watch("assembly"):
            model = finite_elements.matrices(elastic, mesh, "3d", progress)
    if model is None:
        return None
    with watch("modes"):
        solved = solve_modes(model, wanted.count, up_to_hz=wanted.up_to_hz, progress=progress)
        modes = tuple(_listed(model, solved, _elastic_compliance(model, solved)))
        return NaturalModes(modes, mesh, model.size, "the whole body")


def modes_of_volume(volume: float, band: float, slow: float) -> float:
    """Return the number of modes of a solid in a band, by Weyl's law V k^3 (2/c_s^3 + 1/c_p^3)/(6 pi^2), k = 2 pi band.

    Source: M. Dupuis, R. Mazo, L. Onsager, J. Chem. Phys. 33 (1960) 1452.
    """
    return volume * (2 * math.pi * band) ** 3 * (2 * slow**-3 + (_FAST * slow) ** -3) / (6 * math.pi**2)


def _drawn(
    body: Drawn, level: Level, wanted: Wanted, progress: Progress
) -> meshing.SeatMesh | plane_meshes.MeridianMesh:
    """Return elements as fine as the highest frequency looked for asks, where the scene gives no size: by Weyl's law,
    which knows nothing of the lower modes of thin parts and thus asks for no less than they need."""
    of_one = modes_of_volume(body.measures_inside("3d"), 1.0, body.slowest)
    band = (max(wanted.count, _FEWEST_SEEN) / of_one) ** (1 / 3)
    band, stated = _FINER * min(band, wanted.up_to_hz), body.mesh
    method = Method(level, band, size=stated.size, contact_size=stated.contact_size, order=stated.order)
    return finite_elements.draw(body, body.mesh_spec(method), level, method, progress)


def _around(body: Elastic, mesh: plane_meshes.MeridianMesh, wanted: Wanted, progress: Progress) -> NaturalModes:
    """Return the modes harmonic by harmonic, until none has a mode below what is asked for."""

    def build(harmonic: int, torsion: bool = False) -> SecondOrderModel:
        return finite_elements.matrices(body, mesh, "harmonics", harmonic=harmonic, torsion=torsion)

    patch = harmonics.RingPatch(0.0, body.struck_arc or 2 * math.pi)
    all_modes: list[Mode] = []
    compliances: dict[int, float] = {}
    empty, harmonic, dof = 0, 0, 0
    while harmonic < _FEWEST or empty < _EMPTY:
        highest = _bound(all_modes, wanted)
        for torsion in (False, True) if harmonic == 0 else (False,):
            model = build(harmonic, torsion)
            dof = max(dof, model.size)
            most = wanted.count if highest == math.inf else math.inf
            modes = solve_modes(model, most, up_to_hz=highest)
            static = _elastic_compliance(model, modes)
            weight = float(patch.coefficients(harmonic)) ** 2 if body.struck_arc else float(harmonic == 0)
            if model.ports:
                compliances[harmonic] = static
            all_modes += _listed(model, modes, static, harmonic, torsion, weight)
        all_modes = _kept(all_modes, wanted)
        empty = 0 if any(mode.diameters == harmonic for mode in all_modes) else empty + 1
        harmonic += 1
        progress("harmonics", harmonic / (harmonic + 4))
    progress("harmonics", 1.0)
    all_modes = _shared(all_modes, patch, compliances, build, arc=body.struck_arc > 0)
    searched = f"nodal diameters 0 to {harmonic - 1}, torsion among them"
    return NaturalModes(tuple(all_modes), mesh, dof, searched)


def _bound(found: list[Mode], wanted: Wanted) -> float:
    """Return the frequency [Hz] above which nothing is asked for, as far as that is known."""
    if len(found) < wanted.count:
        return wanted.up_to_hz
    return max(found[int(wanted.count) - 1].frequency_hz, 1e-3)


def _kept(found: list[Mode], wanted: Wanted) -> list[Mode]:
    """Return the lowest modes wanted; a pair at the end stays whole."""
    ordered = sorted(found, key=lambda mode: (mode.frequency_hz, mode.diameters or 0, mode.family))
    count = int(min(wanted.count, len(ordered)))
    if 0 < count < len(ordered) and ordered[count].repeats and ordered[count - 1].family == "cos":
        count += 1
    return ordered[:count]


def _listed(
    model: SecondOrderModel,
    modes: Modes,
    static: float,
    harmonic: int | None = None,
    torsion: bool = False,
    weight: float = 1.0,
) -> Iterator[Mode]:
    """Yield the modes of one model; ``static``: the port's compliance, nan without one, ``weight``: the port's share
    in it."""
    phi = modes.shapes.T @ model.port_matrix[:, 0] if model.ports else np.zeros(len(modes.omega))
    for k, (frequency, residual) in enumerate(zip(modes.frequencies_hz, modes.residuals, strict=True)):
        held = math.nan
        if frequency > 0:
            held = 0.0 if torsion else weight * float(phi[k] / modes.omega[k]) ** 2 / static
        family = "torsion" if torsion else "cos" if harmonic else ""
        mode = Mode(float(frequency), float(residual), held, model, modes.shapes[:, k], harmonic, family)
        yield mode
        if harmonic:
            yield replace(mode, share=0.0 * held, family="sin")


def _elastic_compliance(model: SecondOrderModel, modes: Modes) -> float:
    """Return the first port's static compliance but for rigid motions [m/N]; nan without a port."""
    if not model.ports:
        return math.nan
    if not len(modes.omega):
        return _compliance(model, 0.0, np.zeros(0))
    elastic = modes.omega[modes.omega > 0]
    rigid = modes.shapes[:, modes.omega == 0].T @ model.port_matrix[:, 0]
    if not len(rigid):
        return _compliance(model, 0.0, rigid)
    return _compliance(model, (1e-3 * float(elastic.min())) ** 2 if len(elastic) else 1.0, rigid)


def _compliance(model: SecondOrderModel, square: float, rigid: Array) -> float:
    factor = factorization.factorize(model.K + square * model.M if square else model.K, name="K")
    port = model.port_matrix[:, 0]
    whole = float(port @ factor.solve(port))
    return whole - float(np.sum(rigid**2)) / square if square else whole


def _shared(
    found: list[Mode],
    patch: harmonics.RingPatch,
    compliances: dict[int, float],
    build: Callable[[int], SecondOrderModel],
    arc: bool,
) -> list[Mode]:
    """Return the modes with shares of the whole patch's compliance in the place of each harmonic's own."""
    if not arc:
        return found
    for harmonic in _SAMPLED:
        if harmonic not in compliances:
            compliances[harmonic] = _compliance(build(harmonic), 0.0, np.zeros(0))
    known = np.array(sorted(compliances))
    scaled = np.array([compliances[int(n)] * max(n, 1) for n in known])  # tends to a constant
    all_n = np.arange(_ALL)
    each = np.interp(all_n, known, scaled) / np.maximum(all_n, 1)
    total = float(np.sum(patch.coefficients(all_n) ** 2 * each))

    return [
        mode if math.isnan(mode.share) else replace(mode, share=mode.share * compliances[mode.diameters or 0] / total)
        for mode in found
    ]
