"""Points of a scene in the measured trade, every model of its seat from coarse to fine, and the run of one point.

The points are not the full product of all choices, but
- the diagonal: mesh and band refined together by `RATIO`, for every level of modelling that applies;
- around one centre, each key of `seatfem.study.ladders.table` varied by itself, and reduction and convolution engine,
  which change only times;
- the column under the contact as a spring and as a rod, as used without finite elements, if there is no lip.
"""

import json
import math
import os
import time
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any, Final

from impact.march.history import Engine
from seatfem.jobs import processes
from seatfem.jobs.folders import private_folder
from seatfem.machine.code import VARIABLE
from seatfem.machine.resources import Stopwatch, peak_memory
from seatfem.structures.cache import build
from seatfem.structures.kinds.drawn import Drawn
from seatfem.structures.method import PER_WAVELENGTH, AnyLevel, Method
from seatfem.structures.reduction.greens import reducers
from seatfem.structures.rings import MOST_RINGS, Division
from seatfem.study.impacts import contact, landings, validity
from seatfem.study.impacts.bodies import solve_body, stopper_of, striker_of
from seatfem.study.impacts.touches import measured, stress_since
from seatfem.study.impacts.validity import BEAM, simpler_bodies
from seatfem.study.ladders import march, mesh, patch, table
from seatfem.study.ladders.ladder import RATIO
from seatfem.study.ladders.rules import BAND_PER_FILTER
from seatfem.study.method import (
    BAND,
    CONTACT_SIZE,
    FIELDS,
    MODEL,
    MODES,
    ORDER,
    PORTS,
    REDUCTION,
    REED_BAND,
    RINGS,
    SIZE,
    STEP,
    TOLERANCE,
    RunMethod,
    has_key,
    is_given,
    stated_method,
    written,
)
from seatfem.study.plan import Plan
from seatfem.study.scene import Scene, load_scene
from seatfem.study.sweep.runner import FAILURES, Outcome

Settings = Mapping[str, object]
"""Values by dotted key, written as in a scene file ("1 mm"); ``None`` takes the key out of the file."""

ALL_OPEN: Final[Settings] = dict.fromkeys(key for key in FIELDS if not key.startswith("reed.") or key == MODES)
"""Keys that a trade takes out of the scene: those that are left to the planner."""


def stated_choices(plan: Plan) -> Settings:
    """Return all values of a plan's method, which determine its accuracy and cost, as settings of a scene."""
    values = {key: plan.method.value(key) for key in FIELDS if has_key(plan.scene, key)}
    return {key: written(key, value) for key, value in values.items() if value is not None}


PROCESSOR: Final = "processor_s"
COSTS: Final = (PROCESSOR, "memory_bytes", "start_s")
"""Keys of the costs: processor time of all threads, mesher included, or the limit if stopped [s]; peak memory of the
process [B]; time from the start of the process to the beginning of the computation [s]."""
ABOUT: Final = (landings.STATUS, "seat_model", "seat_dof", "seat_poles", "reduction", "time_step_s", "engine")
REPEATED_BELOW: Final = 4.0  # processor time [s] below which a point is run twice: the first time loads and compiles


@dataclass(frozen=True)
class Point:
    """A scene at one fidelity.

    Attributes:
        name: name, unique among the points of a trade.
        family: the model of the seat: "spring", "rod", "axisymmetric", "harmonics", "sector", "3d", "as given".
        varied: the parameter that differs from the central point: "diagonal" (mesh and band together), "mesh", ...
        settings: values that replace those of the scene file.
        engine: history engine of the march.
        in_place: name of the simpler model used in place of a contact along a lip: `ONE_PORT`, `BEAM`.
        after: name of a coarser point that must have ended for this one to be tried.
        least_steps: least number of steps in the width of the filter, where the scene leaves the step open.
        predicted: predicted time [s], 0 if unknown; a point predicted to take far too long is not tried.
    """

    name: str
    family: str
    varied: str
    settings: Settings = field(default_factory=dict)
    engine: Engine = "auto"
    in_place: str = ""
    after: str = ""
    least_steps: int = 1
    predicted: float = 0.0


def carry_out(path: Path, point: Point, start: float = math.nan) -> Outcome:
    """Compute seat, contact and measures of a point without error bars, files or pictures; a failure is an `Outcome`.

    The summary has the measures [SI] by name, `ABOUT` and `COSTS`. ``start``: time that the program took to load [s].
    """
    loaded = {"start_s": start}
    try:
        scene = load_scene(path, point.settings)
        contact.check_step(scene)
        wall, processor, summary = _timed(scene, point)
        if processor < REPEATED_BELOW:
            wall, processor, summary = _timed(scene, point)
    except FAILURES as error:
        return Outcome.of_failure(error, summary=loaded)
    costs = {PROCESSOR: processor, "memory_bytes": peak_memory(), **loaded}
    return Outcome("done", "", wall, {**summary, **costs})


def _timed(scene: Scene, point: Point) -> tuple[float, float, dict[str, Any]]:
    """Compute the point once; return wall time and processor time [s], and the summary."""
    wall, processor, watch = time.perf_counter(), _processor_time(), Stopwatch()
    method = stated_method(scene)
    if point.in_place:
        method = method.along(scene.geometry, 1)
    duration = scene.run.duration
    seat = build(scene.seat, method.seat, duration, watch=watch, mesh_error=False)
    solved = solve_body("reed", scene.reed, method.reed, duration, mesh_error=False)
    striker = striker_of(scene, method.reed.n_modes, None if solved is None else solved.greens)
    if point.in_place:
        striker = dict(validity.simpler_bodies(scene, striker, Division()))[point.in_place]
    longest = scene.run.filter_width / point.least_steps
    stopper = stopper_of(scene)
    greens = (striker.greens, seat.greens) if stopper is None else (striker.greens, seat.greens, stopper.greens)
    step = method.time_step or min(longest, contact.fallback_step(scene.run, scene.gas, *greens))
    contact.check_length(scene, step, method.seat.division.count)
    with watch("contact"):
        touches = contact.run_contacts(scene, striker, seat.greens, step, engine=point.engine)
    result = touches.seat
    since = stress_since(touches, scene.accuracy.landing)
    stress = contact.stress_in_run(scene.geometry, striker, touches, since=since)
    never = dict.fromkeys(scene.accuracy.judged, 0.0)
    values = {**never, **measured(touches, scene.run.filter_width, stress, scene.accuracy.landing)}
    about = (
        landings.LANDED if touches.landings is None else touches.landings.status,
        seat.about.get("seat_model", ""),
        seat.about.get("seat_dof", 0),
        seat.greens.marched_poles(step, duration / step) or 0,
        seat.greens.provenance.get("method", ""),
        step,
        result.engine,
    )
    stages = {f"stage_{name}_s": round(spent, 4) for name, spent in watch.stages.items()}
    summary = {**values, **dict(zip(ABOUT, about, strict=True)), **stages}
    return time.perf_counter() - wall, _processor_time() - processor, summary


def _processor_time() -> float:
    """Return the processor time of all threads of this process and of those it started (the mesher) [s]."""
    try:
        import resource  # absent on Windows
    except ImportError:
        return time.process_time()
    used = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(u.ru_utime + u.ru_stime for u in used)


def reply(text: str) -> str:
    """Return the outcome of one job, within its processor time and in a folder without caches."""
    job: dict[str, Any] = json.loads(text)
    processes.limit_process(seconds=math.ceil(job["limit"]))
    point = Point(**job["point"], settings=job["changed"])
    with private_folder("point") as folder:
        os.environ[VARIABLE] = str(folder)
        return json.dumps(asdict(carry_out(Path(job["path"]), point, time.time() - job["begun"])))


BY_HAND: Final = "by hand"  # value of `Point.varied` for points without finite elements
DEPTH: Final = 3  # number of points of the diagonal below the centre
ELEMENTS: Final = {True: 1, False: 2}  # elements over the column's height and over the patch's width; true: in 3-D
SOLID: Final = ("sector", "3d")  # levels with three-dimensional meshes
ENGINES: Final[tuple[Engine, ...]] = ("poles", "fft", "direct")
ENGINE_STEPS: Final = 100_000  # most time steps to compare engines: the cost of the direct sum grows with the square
REFERENCE_MODES: Final = 128
REFERENCE_PORTS: Final = 128
_QUICK: Final = (
    *("order 1", "reed modes 10", "2 steps per filter", "32 steps per filter"),
    *("one port", "beam", *(f"{ports} ports" for ports in patch.PORTS_IN_A_TRADE)),
)


def has_a_beam(scene: Scene) -> bool:
    """Return whether the scene's plate has a beam as simpler model."""
    method = stated_method(scene).replaced({REED_BAND: mesh.OF_A_BEAM}).along(scene.geometry, 1)
    reed = solve_body("reed", scene.reed, method.reed, scene.run.duration)
    striker = striker_of(scene, greens=None if reed is None else reed.greens)
    return BEAM in dict(simpler_bodies(scene, striker, Division()))


def centre_of(scene: Scene) -> RunMethod:
    """Return the method around which keys are varied: as the file states, with open keys by the band of the filter,
    its waves and the contact face."""
    seat, method = scene.seat, replace(stated_method(scene), time_step=None)
    if not seat.traits.is_reduced:
        return replace(method, seat=replace(method.seat, bandwidth=None, size=None, contact_size=None, lip=None))
    band = method.seat.bandwidth if is_given(scene, BAND) else None
    band = band or BAND_PER_FILTER / scene.run.filter_width
    method = replace(method, seat=replace(method.seat, bandwidth=band))
    if (drawn := seat.drawn) is None:
        return replace(method, seat=replace(method.seat, size=None, contact_size=None, lip=None))
    level = next(a.level for a in drawn.levels() if a.applies and a.error == 0.0)
    size, contact_size = _sizes(drawn, method.seat, level, band)
    chosen = replace(method.seat, level=level, size=size, contact_size=contact_size, order=2)
    return replace(method, seat=chosen)


def _sizes(seat: Drawn, stated: Method, level: AnyLevel, bandwidth: float) -> tuple[float, float]:
    """Return element sizes in bulk and contact, by `ELEMENTS` per height and width and by the slowest wave."""
    wave, column = seat.slowest / (PER_WAVELENGTH[seat.discrete(level)] * bandwidth), seat.column()
    across = ELEMENTS[level in SOLID]
    size = stated.size or (wave if column is None else min(wave, column.height / across))
    contact = stated.contact_size or (0.4 * size if column is None else min(size, column.width / across))
    return size, min(contact, size)


def settings_of(method: RunMethod, changes: Mapping[str, object] | None = None) -> Settings:
    """Return a method as settings, some replaced by ``changes``, without the keys that it leaves open."""
    seat, drawn, along = method.seat, method.seat.size is not None, method.ports is not None
    values: dict[str, object] = {
        MODEL: seat.level if drawn else None,
        SIZE: seat.size,
        CONTACT_SIZE: seat.contact_size,
        ORDER: seat.order if drawn else None,
        BAND: seat.bandwidth,
        TOLERANCE: seat.tolerance if seat.bandwidth else None,
        MODES: method.reed.n_modes,
        PORTS: method.ports,
        REED_BAND: method.reed.bandwidth if along else None,
        **(changes or {}),
    }
    return {key: written(key, value) for key, value in values.items() if value is not None}


@dataclass(frozen=True)
class Rungs:
    """The points of a scene; ``rings``: number of rings of the contact face in the plans."""

    scene: Scene
    rings: int = 1

    @cached_property
    def centre(self) -> RunMethod:
        """Return the method around which keys are varied."""
        return centre_of(self.scene)

    @property
    def drawn(self) -> bool:
        """Return whether the seat is meshed, so that its mesh can be refined."""
        return self.centre.seat.size is not None

    @property
    def is_solid(self) -> bool:
        """Return whether its meshes are three-dimensional."""
        return self.centre.seat.level in SOLID

    @property
    def family(self) -> str:
        """Return the level of the centre, or "as given" for a seat without a mesh by gmsh."""
        return str(self.centre.seat.level) if self.drawn else "as given"

    def points(self, *, quick: bool = False) -> tuple[Point, ...]:
        """Return all points that apply to the scene, each family from coarse to fine; ``quick``: about a third."""
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
        if seat.closed_form() is not None:  # the rod is such a column
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
        """Yield points with mesh and band refined together, for each level, the level of the centre last."""
        if not self.drawn:
            yield Point("as given", "as given", "diagonal", settings_of(self.centre))
            return
        for k in (-1, 0):
            yield replace(self._rung("spring", k), name=_name("spring, statics", k))
        for model in self.scene.seat.levels():
            if model.applies and model.error > 0:  # a closed form: nothing to refine
                yield Point(model.level, model.level, "diagonal", settings_of(self.centre, {MODEL: model.level}))
            elif model.applies and model.level != self.family and self.centre.ports is None:  # a lip needs the centre's
                yield from self._chain(model.level, -depth, -1)
        yield from self._chain(self.family, -depth, 0)

    def _chain(self, family: str, first: int, last: int) -> Iterator[Point]:
        """Yield the points of one level, each tried only if the coarser one ended."""
        before = ""
        for k in range(first, last + 1):
            rung = replace(self._rung(family, k), after=before)
            before = rung.name
            yield rung

    def _rung(self, family: str, fineness: float) -> Point:
        settings = settings_of(self._refined(fineness), {MODEL: family})
        return Point(_name(family, fineness), family, "diagonal", settings)

    def _refined(self, fineness: float, *, band: bool = True) -> RunMethod:
        """Return the centre with its mesh (and ``band``) finer by `RATIO` to the power ``fineness``."""
        seat, factor = self.centre.seat, RATIO**fineness
        values: dict[str, object] = {SIZE: seat.size, CONTACT_SIZE: seat.contact_size}
        finer = {key: value / factor for key, value in values.items() if isinstance(value, float)}
        if band and seat.bandwidth is not None:
            finer[BAND] = seat.bandwidth * factor
        return self.centre.replaced(finer)

    def finer(self, fineness: int) -> Point:
        """Return the point of the diagonal ``fineness`` refinements beyond the centre."""
        return replace(self._rung(self.family, fineness), after=_name(self.family, fineness - 1))

    def _around(self) -> Iterator[Point]:
        """Yield points with one key varied from the centre, then reductions and convolution engines."""
        centre = self.centre.replaced({RINGS: self.rings})
        for ladder in table.ladders():
            for near in ladder.beside(self.scene.run, self.scene.reed, centre):
                if near.in_place != BEAM or has_a_beam(self.scene):
                    settings = settings_of(self.centre, near.values)
                    yield Point(near.name, self.family, near.varied, settings, in_place=near.in_place)
        if centre.seat.bandwidth is not None and (centre.ports or 1) == 1:  # arcs need modes
            yield from self._reductions()
        yield from self._engines()

    def _reductions(self) -> Iterator[Point]:
        """Yield all reductions that apply."""
        seat = self.scene.seat
        if self.centre.seat.level == "harmonics":
            return
        as_matrix = seat.loss == 0 and seat.elastic is not None and seat.elastic.loss_at(1.0) > 0
        for name, each in reducers().items():
            if each.modal_damping or as_matrix:
                settings = settings_of(self.centre, {REDUCTION: name})
                yield Point(f"reduction {name}", self.family, "reduction", settings)

    def _engines(self) -> Iterator[Point]:
        """Yield the convolution engines, at a time step that is affordable for all."""
        run, seat = self.scene.run, self.scene.seat
        number = max(2, min(64, math.floor(ENGINE_STEPS * run.filter_width / run.duration)))
        settings = settings_of(self.centre, {STEP: run.filter_width / number})
        for engine in ENGINES:
            if engine != "poles" or seat.drawn is not None or seat.column() is None:  # no poles in closed form
                yield Point(f"history {engine}", self.family, "history", settings, engine)

    def reference(self, fineness: float, *, coarser: bool = False) -> Point:
        """Return a point finer than all others in every key; ``coarser``: one step coarser in every key.

        ``fineness``: number of refinements of the mesh beyond the centre.
        """
        centre, back, plate = self.centre, 1 if coarser else 0, self.scene.reed.thin_plate
        finer: dict[str, object] = {}
        if centre.seat.bandwidth is not None:
            finer[BAND] = centre.seat.bandwidth * RATIO ** (max(2.0, fineness) - back)
            finer[TOLERANCE] = min(mesh.LOOSER_AND_STRICTER) / 3 * RATIO ** (2 * back)
        if centre.reed.n_modes is not None:
            finer[MODES] = round(REFERENCE_MODES / RATIO**back)
        if centre.ports is not None and centre.reed.bandwidth is not None and plate is not None:
            finer[PORTS] = round(REFERENCE_PORTS / 2**back)
            finer[REED_BAND] = min(centre.reed.bandwidth * RATIO ** (2 - back), plate.widest_band)
        if self.rings > 1:
            finer[RINGS] = min(MOST_RINGS, 2 * self.rings) if not coarser else self.rings
        settings = {**settings_of(self._refined(fineness - back, band=False), finer), STEP: None}
        steps = round(4 * max(march.PER_FILTER) / RATIO**back)
        name = "reference, one notch back" if coarser else "reference"
        return Point(f"{name} ({fineness:g})", self.family, "reference", settings, least_steps=steps)


def _name(family: str, fineness: float) -> str:
    return f"{family}, size / {RATIO**fineness:.2f}" if fineness else f"{family}, centre"
