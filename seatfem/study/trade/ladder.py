"""The fidelity ladder of a scene: every model that describes its seat, coarse to fine.

Not the full product of all choices, but
- the diagonal: mesh and band refined together by `RATIO`, for every level of modelling that applies;
- around one centre, each choice varied alone: mesh, order, band, tolerance, reduction, reed modes, step, history;
- of a plate on a lip, the arcs of the lip and the band of the plate, one port in place of the arcs, a beam in place of
  the plate;
- the column under the contact as a spring and as a rod: what is used where there are no finite elements, and no lip.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Final

from impact.march.history import Engine
from seatfem.structures.kinds.drawn import Drawn
from seatfem.structures.method import PER_WAVELENGTH, AnyLevel, Method
from seatfem.structures.reduction.greens import reducers
from seatfem.structures.rings import MOST_RINGS, Division
from seatfem.study.impacts.contact import striker_of
from seatfem.study.impacts.validity import BEAM, ONE_PORT, simpler_bodies
from seatfem.study.method import BAND, REED_BAND, is_given, stated_method, written
from seatfem.study.scene import Scene
from seatfem.study.trade.point import Point, Settings

BY_HAND: Final = "by hand"  # what is varied where there are no finite elements
RATIO: Final = 1.6  # between neighbouring rungs
BAND_PER_FILTER: Final = 0.5  # band of the centre times the width of the filter, where the file gives none
DEPTH: Final = 3  # rungs of the diagonal below the centre
ACROSS: Final = {True: 1, False: 2}  # elements over the column's height and the patch's width; true: in 3-D
TOLERANCES: Final = (0.1, 0.003)  # beside the centre's
REED_MODES: Final = (10, 20, 80)
STEPS_PER_FILTER: Final = (2, 8, 32)
SOLID: Final = ("sector", "3d")  # levels with three-dimensional meshes
ENGINES: Final[tuple[Engine, ...]] = ("poles", "fft", "direct")
ENGINE_STEPS: Final = 100_000  # at most, where engines are compared: the direct sum takes their square
REFERENCE_MODES: Final = 128
PORTS: Final = (16, 64)  # of a lip, beside the centre's
REFERENCE_PORTS: Final = 128
OF_A_BEAM: Final = 20e3  # Hz: of the plate in whose place a beam stands, which starts as it does


@dataclass(frozen=True)
class Centre:
    """The fidelity that the ladder is built around, SI.

    ``level``: the cheapest that leaves nothing out; ``None`` for seats that are not drawn. ``ports``: of a lip, and
    ``reed_band``: of the plate that lands on it; ``None`` of others.
    """

    level: AnyLevel | None = None
    size: float | None = None
    contact_size: float | None = None
    bandwidth: float | None = None
    tolerance: float | None = None
    n_modes: int | None = None
    ports: int | None = None
    reed_band: float | None = None

    @property
    def is_solid(self) -> bool:
        """Return whether its meshes are three-dimensional."""
        return self.level in SOLID

    @property
    def family(self) -> str:
        """Return its level; of a seat that is not drawn "as given"."""
        return str(self.level or "as given")

    def settings(self, fineness: float = 0.0, *, band: bool = True) -> Settings:
        """Return the settings as stated keys, mesh (and ``band``) finer by `RATIO` to the power ``fineness``."""
        factor = RATIO**fineness
        values: dict[str, object] = {
            "seat.model": self.level,
            "seat.mesh.size": self.size and self.size / factor,
            "seat.mesh.contact_size": self.contact_size and self.contact_size / factor,
            "seat.mesh.order": 2 if self.size else None,
            "seat.greens.bandwidth": self.bandwidth and self.bandwidth / (1 / factor if band else 1.0),
            "seat.greens.tolerance": self.tolerance,
            "reed.n_modes": self.n_modes,
            "contact.ports": self.ports,
            REED_BAND: self.reed_band,
        }
        return {key: written(key, value) for key, value in values.items() if value is not None}


def centre_of(scene: Scene) -> Centre:
    """Return what the file states; what it leaves open follows the filter's band, its waves and the struck face."""
    seat, method = scene.seat, stated_method(scene)
    slender = scene.reed.slender
    stated, centre = method.seat, Centre(n_modes=None if slender is None else slender.n_modes)
    if not seat.traits.is_reduced:
        return centre
    band = stated.bandwidth if is_given(scene, BAND) else None
    centre = replace(centre, bandwidth=band or BAND_PER_FILTER / scene.run.filter_width, tolerance=stated.tolerance)
    if (drawn := seat.drawn) is None:
        return centre
    level = next(a.level for a in drawn.levels() if a.applies and a.error == 0.0)
    size, contact_size = _sizes(drawn, stated, level, centre.bandwidth or 0.0)
    centre = replace(centre, level=level, size=size, contact_size=contact_size)
    return centre if method.ports is None else replace(centre, ports=method.ports, reed_band=method.reed.bandwidth)


def _sizes(seat: Drawn, stated: Method, level: AnyLevel, bandwidth: float) -> tuple[float, float]:
    """Return element sizes in bulk and contact: `ACROSS` the column's height and the patch, and the slowest wave."""
    wave, column = seat.slowest / (PER_WAVELENGTH[seat.discrete(level)] * bandwidth), seat.column()
    across = ACROSS[level in SOLID]
    size = stated.size or (wave if column is None else min(wave, column.height / across))
    contact = stated.contact_size or (0.4 * size if column is None else min(size, column.width / across))
    return size, min(contact, size)


_QUICK: Final = (
    *("order 1", "reed modes 10", "2 steps per filter", "32 steps per filter"),
    *("one port", "beam", *(f"{ports} ports" for ports in PORTS)),
)


@dataclass(frozen=True)
class Ladder:
    """The rungs of a scene; ``rings``: of the patch, where a plan takes several."""

    scene: Scene
    rings: int = 1

    @cached_property
    def centre(self) -> Centre:
        """Return the fidelity that the ladder is built around."""
        return centre_of(self.scene)

    def rungs(self, *, quick: bool = False) -> tuple[Point, ...]:
        """Return every rung that applies to the scene, each family from coarse to fine; ``quick``: about a third."""
        by_hand = self._by_hand() if self.centre.ports is None else ()
        points = (*by_hand, *self._diagonals(2 if quick else DEPTH), *self._around())
        return tuple(p for p in points if not quick or p.varied in (BY_HAND, "diagonal") or p.name in _QUICK)

    def _by_hand(self) -> Iterator[Point]:
        """Yield the column as a spring and as a rod."""
        seat = self.scene.seat
        if (column := seat.column()) is None:
            return
        spring = {"kind": "spring", "stiffness": f"{column.stiffness!r} N/m"}
        yield Point(
            "spring, column E A/h" if seat.drawn is not None else "spring, E A/L", "spring", BY_HAND, {"seat": spring}
        )
        if seat.closed_form() is not None:  # its column is what the rod is
            return
        rod = {
            "kind": "rod",
            "young": f"{column.young!r} Pa",
            "density": f"{column.density!r} kg/m^3",
            "length": f"{column.height!r} m",
            "area": f"{column.area!r} m^2",
            "damping_ratio": seat.loss,
        }
        yield Point("rod, column", "rod", BY_HAND, {"seat": rod})

    def _diagonals(self, depth: int) -> Iterator[Point]:
        """Yield mesh and band together, for each level; that of the centre last, and up to the centre."""
        centre = self.centre
        if centre.size is None:
            yield Point("as given", "as given", "diagonal", centre.settings())
            return
        for k in (-1, 0):
            yield replace(_rung(replace(centre, level=None), "spring", k), name=_name("spring, statics", k))
        for model in self.scene.seat.levels():
            if model.applies and model.error > 0:  # a closed form: nothing to refine
                yield Point(model.level, model.level, "diagonal", {**centre.settings(), "seat.model": model.level})
            elif (
                model.applies and model.level != centre.level and centre.ports is None
            ):  # no other is struck along a lip
                yield from _chain(replace(centre, level=model.level), -depth, -1)
        yield from _chain(centre, -depth, 0)

    def finer(self, fineness: int) -> Point:
        """Return the diagonal beyond the centre, for as far as it can be afforded."""
        family = self.centre.family
        return replace(_rung(self.centre, family, fineness), after=_name(family, fineness - 1))

    def _around(self) -> Iterator[Point]:
        """Yield each choice varied alone; the rest is the centre's."""
        centre, rings = self.centre, self.rings
        family, base = centre.family, centre.settings()

        def vary(name: str, varied: str, key: str, value: object) -> Point:
            return Point(name, family, varied, {**base, key: written(key, value)})

        if centre.size is not None:
            for k in (-2, -1):
                yield Point(f"mesh / {RATIO**k:.2f}", family, "mesh", centre.settings(k, band=False))
            yield vary("order 1", "order", "seat.mesh.order", 1)
        if centre.bandwidth is not None:
            for k in (-1, 1):
                value = centre.bandwidth * RATIO**k
                yield vary(f"band x {RATIO**k:.2f}", "band", "seat.greens.bandwidth", value)
        if centre.bandwidth is not None and (centre.ports or 1) == 1:  # arcs take modes alone
            for tolerance in TOLERANCES:
                yield vary(f"tolerance {tolerance:g}", "tolerance", "seat.greens.tolerance", tolerance)
            yield from self._reductions(base)
        if rings > 1:
            yield vary(f"{rings} rings", "rings", "contact.rings", rings)
        if centre.ports is not None and centre.reed_band is not None:
            for ports in PORTS:
                if ports != centre.ports:
                    yield vary(f"{ports} ports", "ports", "contact.ports", ports)
            if centre.ports > 1:
                yield Point("one port", family, "one port", base, in_place=ONE_PORT)
            narrow = {**base, REED_BAND: written(REED_BAND, min(OF_A_BEAM, centre.reed_band))}
            if self._has_a_beam():
                yield Point("beam", family, "beam", narrow, in_place=BEAM)
            for k in (-1, 1):
                value = centre.reed_band * RATIO**k
                yield vary(f"reed band x {RATIO**k:.2f}", "reed band", REED_BAND, value)
        if self.scene.reed.slender is not None:
            for number in REED_MODES:
                yield vary(f"reed modes {number}", "reed modes", "reed.n_modes", number)
        yield from self._in_time(base)

    def _has_a_beam(self) -> bool:
        """Return whether a beam is known that could stand in place of the scene's plate."""
        method = stated_method(self.scene).replaced({REED_BAND: OF_A_BEAM}).along(self.scene, 1)
        striker = striker_of(self.scene, method=method.reed)
        return BEAM in dict(simpler_bodies(self.scene, striker, Division()))

    def _reductions(self, base: Settings) -> Iterator[Point]:
        """Yield every reduction that applies; on hexahedra, of diagonal mass, those that need them and the usual."""
        seat, centre, (usual, *_) = self.scene.seat, self.centre, reducers()
        if centre.level == "harmonics":
            return
        as_matrix = seat.loss == 0 and seat.elastic is not None and seat.elastic.loss_at(1.0) > 0
        for name, each in reducers().items():
            settings = {**base, "seat.greens.method": name}
            point = Point(f"reduction {name}", centre.family, "reduction", settings)
            if not each.diagonal_mass and (each.modal_damping or as_matrix):
                yield point
            if (
                centre.is_solid
                and seat.drawn is not None
                and seat.drawn.is_swept
                and (each.diagonal_mass or name == usual)
            ):
                hexes = {**settings, "seat.mesh.shape": "hex"}
                yield replace(point, name=f"hexahedra, {point.name}", settings=hexes)

    def _in_time(self, base: Settings) -> Iterator[Point]:
        """Yield steps, and engines at one step that all of them can afford."""
        run, seat, family = self.scene.run, self.scene.seat, self.centre.family
        width, duration = run.filter_width, run.duration
        for number in STEPS_PER_FILTER:
            step = written("run.time_step", width / number)
            if width / number <= duration / 8:
                yield Point(f"{number} steps per filter", family, "time step", {**base, "run.time_step": step})
        number = max(2, min(64, math.floor(ENGINE_STEPS * width / duration)))
        step = written("run.time_step", width / number)
        for engine in ENGINES:
            if engine != "poles" or seat.drawn is not None or seat.column() is None:  # of a rod by hand there are none
                yield Point(f"history {engine}", family, "history", {**base, "run.time_step": step}, engine)

    def reference(self, fineness: float, *, coarser: bool = False) -> Point:
        """Return a point finer than the whole ladder in every choice; ``coarser``: the same, one notch back in all.

        ``fineness``: of the mesh, above the centre's.
        """
        centre, rings, back = self.centre, self.rings, 1 if coarser else 0
        settings = dict(centre.settings(fineness - back, band=False))
        if centre.bandwidth is not None:
            band = max(2.0, fineness) - back
            settings["seat.greens.bandwidth"] = written("seat.greens.bandwidth", centre.bandwidth * RATIO**band)
            settings["seat.greens.tolerance"] = min(TOLERANCES) / 3 * RATIO ** (2 * back)
        if centre.n_modes is not None:
            settings["reed.n_modes"] = round(REFERENCE_MODES / RATIO**back)
        plate = self.scene.reed.thin_plate
        if centre.ports is not None and centre.reed_band is not None and plate is not None:
            settings["contact.ports"] = round(REFERENCE_PORTS / 2**back)
            settings[REED_BAND] = written(REED_BAND, min(centre.reed_band * RATIO ** (2 - back), plate.widest_band))
        if rings > 1:
            settings["contact.rings"] = min(MOST_RINGS, 2 * rings) if not coarser else rings
        settings["run.time_step"] = None
        steps = round(4 * max(STEPS_PER_FILTER) / RATIO**back)
        name = "reference, one notch back" if coarser else "reference"
        return Point(f"{name} ({fineness:g})", centre.family, "reference", settings, least_steps=steps)


def _chain(centre: Centre, first: int, last: int) -> Iterator[Point]:
    """Yield the rungs of one level; none is tried beyond one that did not end."""
    before = ""
    for k in range(first, last + 1):
        rung = replace(_rung(centre, centre.family, k), after=before)
        before = rung.name
        yield rung


def _rung(centre: Centre, family: str, fineness: int) -> Point:
    settings = {**centre.settings(fineness), "seat.model": family}
    return Point(_name(family, fineness), family, "diagonal", settings)


def _name(family: str, fineness: int) -> str:
    return f"{family}, size / {RATIO**fineness:.2f}" if fineness else f"{family}, centre"
