"""The ladder of models: a spring, a closed form, or finite elements with waves, each with its modelling error."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Final

import impact
from impact.greens.base import GreensFunction
from impact.quantities import percent
from impact.runs.variations import Terms, Variation, safety, times
from seatfem.structures.estimates import surrogate
from seatfem.structures.estimates.surrogate import on_its_patch
from seatfem.structures.kinds import Structure
from seatfem.structures.method import Method, at_once, with_start
from seatfem.structures.rings import face_compliance
from seatfem.study.impacts.bodies import solve_body
from seatfem.study.ladders.ladder import Beginning, BodyLadder, ComputedRun, Option, Role
from seatfem.study.method import MODEL, RunMethod
from seatfem.study.prerun.bench import locate_contact_window
from seatfem.study.prerun.context import COARSE_TOLERANCE, IMPOSSIBLE, PlanningContext, level_with_waves, lowest_band
from seatfem.study.prerun.context import coarse_method as coarse_seat_method
from seatfem.study.prerun.sensitivity import Changes
from seatfem.study.safety import (
    AIM,
    DOUBT,
    DOUBT_OF_ARCS,
    DOUBT_OF_COARSE,
    FLOOR_OF_SPRING,
    LEVEL_SHARE,
    OVERSTATED,
    SHEAR_SHARE,
)
from seatfem.study.scene import Scene
from seatfem.study.scene.measures import short_words

PER_FILTER, REED_MODES = 320, 80
"""Steps per filter and reed modes of its pre-runs: with 40 each, a thin reed's peak changed ten times as in the run."""
CHEAP: Final = "harmonics"  # level whose waves are cheap: modes of half sections, of a few hundred unknowns each
CHEAPER: Final = "; seat.model = 'spring' would be enough, but would need a finer mesh or shorter steps"


@dataclass(frozen=True)
class Level(BodyLadder):
    """The level of a body's model; its neighbour is the next better level, if that is cheap."""

    def neighbours(self, run: ComputedRun) -> Terms | None:
        """Return the run with g larger by the error that the level states; for the seat also the run on a better level,
        and those with the shear deformation of thick beams."""
        solved = run.solved(self.role)
        assert solved is not None
        level = run.with_larger_g(self.role, solved.level_error)
        if level is None or self.role != "seat":
            return level
        better, seat = _better(run), run.method.seat
        if seat.static and MODEL not in run.method.given and not tells_waves(run.scene.seat, seat):
            better = ((*(variation for term in better for variation in term), *_waves(run)),)
        return (*level, *_shear(run), *better)

    def begin(self, known: Beginning, method: RunMethod) -> RunMethod:
        """Return the method with the static compliance of a seat that is drawn, the simplest model."""
        is_open = self.role == "seat" and known.scene.seat.drawn is not None and MODEL not in method.given
        return method.replaced({MODEL: "spring"}) if is_open else method

    def refine(self, scene: Scene, method: RunMethod, factor: float) -> RunMethod | None:
        """Return the method with waves in the seat: its half section, a sector or, along a lip, all of it."""
        if self.role != "seat" or MODEL in method.given or not method.seat.static or scene.seat.drawn is None:
            return None
        return method.replaced({MODEL: level_with_waves(scene.seat, method.seat).level})

    def extend(self, context: PlanningContext, option: Option) -> Iterable[Option]:
        """Yield the stated level only, or else a spring, an approximate closed form (rod), and waves."""
        scene, stated = context.scene, context.stated.seat
        if self.role != "seat":
            yield option
        elif not context.reduced:
            yield replace(option, why=f"seat.{scene.seat.level(0.0).reason}")
        elif not context.drawn:
            yield replace(option, why=scene.seat.level(0.0).reason)
        else:
            yield from self._levels(context, option, stated.level if MODEL in context.stated.given else None)

    def _levels(self, context: PlanningContext, option: Option, stated: str | None) -> Iterator[Option]:
        waves, why = context.waves, context.waves.reason
        if stated in (None, "spring") and "spring" not in context.without:
            spring = without_waves(context)
            yield option.with_seat({MODEL: spring.errors}, {"level": "spring"}, why=spring.words)
            enough = spring.enough(context.scene.accuracy.target)
            why = f"{why}; {spring.words}{CHEAPER if enough else ''}"
        if stated in (None, "rod") and "rod" not in context.without:
            yield from _rod(context, option)
        if stated not in ("spring", "rod"):
            yield option.with_seat({}, {"level": waves.level}, why=why)


def _shear(run: ComputedRun) -> Terms:
    """Return the runs with the shear deformation of beams, where it counts."""
    reed, seat, least = run.scene.reed.slender, run.scene.seat.slender, SHEAR_SHARE * run.scene.accuracy.target
    errors: dict[Role, float] = {
        "reed": 0.0 if reed is None else reed.shear_error(run.scene.contact.at),
        "seat": 0.0 if seat is None else seat.shear_error(None),
    }
    counting = (run.with_larger_g(role, error) for role, error in errors.items() if error > least)
    return tuple(term for terms in counting for term in terms or ())


def _better(run: ComputedRun) -> Terms:
    """Return the run on a better level of the seat, if there is a cheap one."""
    drawn, method = run.scene.seat.drawn, run.method
    better = with_start(run.seat.greens) or waves_beside(run.scene.seat, run.scene.run.duration, method.seat)
    if better is None and drawn is not None:
        better = drawn.beyond(method.seat.level)
    return () if better is None else ((run.with_greens("seat", better),),)


def _waves(run: ComputedRun) -> tuple[Variation, ...]:
    """Return the run on a seat with waves against the same without them: the seat is solved on a coarse mesh and struck
    as a whole, along a lip with a half-space under its parts; where that is impossible, it is the seat's surrogate."""
    scene, lip = run.scene, run.method.seat.lip
    surrogate = scene.seat.surrogate(scene.run.duration, scene.reed.face)
    if (patch := surrogate.patch) is None:
        return ()
    method = coarse_seat_method(scene.seat, replace(run.method, given=frozenset()), patch, scene.run.filter_width)
    try:
        solved, doubt = solve_body("seat", scene.seat, method, scene.run.duration, mesh_error=False), DOUBT_OF_COARSE
    except IMPOSSIBLE:
        solved, doubt = None, DOUBT if run.division.arcs == 1 else DOUBT_OF_ARCS
    waves = surrogate.greens if solved is None else solved.greens
    whole = waves.modal
    if run.division.arcs > 1 and lip is not None and whole is not None:
        waves = on_its_patch(whole, lip, patch)
        static: GreensFunction = at_once(waves)
    else:
        static = impact.spring(stiffness=1 / face_compliance(waves))
    one, other = (run.with_greens("seat", greens).problem for greens in (waves, static))
    return (Variation(one, doubt, other),)


def tells_waves(seat: Structure, method: Method) -> bool:
    """Return whether the budget of a static seat includes a run with waves: for a body of revolution in arcs."""
    body = seat.drawn
    return method.static and method.in_arcs and body is not None and body.elements_of(method) == CHEAP


def method_beside(seat: Structure, method: Method) -> Method | None:
    """Return the method of a static seat's waves for the error budget: on the same mesh, with a band up to its first
    resonances; ``None`` if the seat is not static, or its waves are expensive."""
    body = seat.drawn
    if not tells_waves(seat, method) or body is None or (patch := body.patch()) is None:
        return None
    assert method.bandwidth is not None
    spec, band = body.mesh_spec(method), min(method.bandwidth, lowest_band(patch))
    level = body.level(0.0).level
    return replace(method, level=level, bandwidth=band, size=spec.size, contact_size=spec.patch_size)


def waves_beside(seat: Structure, duration: float, method: Method) -> GreensFunction | None:
    """Return the static seat with its waves, by `method_beside`, or ``None``.

    A static seat loses the momentum that waves return, in one scene 4.3 % of the impulse, and a surrogate has neither
    the seat's section nor its harmonics.
    """
    dynamic = method_beside(seat, method)
    solved = None if dynamic is None else solve_body("seat", seat, dynamic, duration, mesh_error=False)
    return None if solved is None else solved.greens


def _rod(context: PlanningContext, option: Option) -> Iterator[Option]:
    """Yield a bar as a rod, without lateral inertia and without the compliance of its clamped end."""
    seat = context.scene.seat.drawn
    if seat is None or (form := seat.closed_form()) is None or (better := seat.beyond("rod")) is None:
        return
    inertia, end = context.sensitivity.between(form, better), context.per_g(seat.form_error)
    errors = {name: value + end[name] for name, value in inertia.items()}
    name = max(context.sensitivity.asked, key=lambda measure: errors[measure])
    words = short_words(name)
    why = f"a rod, without lateral inertia and the clamped end, is off by {percent(errors[name])} in {words}"
    yield option.with_seat({MODEL: errors}, {"level": "rod"}, why=why)


@dataclass(frozen=True)
class WithoutWaves:
    """Relative changes of the measures by a spring in place of a seat.

    Attributes:
        changes: relative change of each measure, without safety factor.
        doubt: safety factor on them.
        asked: measures that count.
        measured: whether they were computed on a coarse mesh of the seat.
    """

    changes: Changes
    doubt: float
    asked: tuple[str, ...]
    measured: bool = False

    @property
    def errors(self) -> Mapping[str, float]:
        """Return the changes times their safety factor, at least `FLOOR_OF_SPRING`."""
        return {name: max(change, FLOOR_OF_SPRING) for name, change in times(self.doubt, self.changes).items()}

    def enough(self, target: float) -> bool:
        """Return whether a spring is enough: its error bars are within `AIM` times the target."""
        return all(safety(name) * self.errors[name] <= AIM * target for name in self.asked)

    @property
    def words(self) -> str:
        """Return in words the largest change of the judged measures, and how it was estimated."""
        name = max(self.asked, key=lambda measure: self.changes[measure])
        by = "measured on a coarse mesh of the seat" if self.measured else "estimated"
        words = short_words(name)
        return f"without waves: {percent(self.changes[name])} change of {words} ({by})"


def without_waves(context: PlanningContext) -> WithoutWaves:
    """Return the changes by a static seat in place of its waves: on the coarse seat of the plan, or else on its
    surrogate; for a lip in arcs, if the surrogate does not decide, on a coarse seat in arcs if that is cheap."""
    sensitivity = context.sensitivity
    if context.surrogate.band is not None and context.arcs is None:
        closely = replace(sensitivity, per_filter=PER_FILTER, reed_modes=REED_MODES)
        return WithoutWaves(closely.spring, DOUBT_OF_COARSE, sensitivity.asked, measured=True)
    guess = WithoutWaves(sensitivity.spring, DOUBT if context.arcs is None else DOUBT_OF_ARCS, sensitivity.asked)
    if context.arcs is None or not _leaves_open(context, guess):
        return guess
    seat = context.coarse_seat(coarse_method(context))
    if seat is None:
        return guess
    return WithoutWaves(changes_on(context, seat.greens), DOUBT_OF_COARSE, sensitivity.asked, measured=True)


def coarse_method(context: PlanningContext) -> Method:
    """Return the coarsest method of a seat in arcs that resolves its waves up to the first resonances."""
    coarse = context.elements(context.lowest_band, COARSE_TOLERANCE, surrogate.ERRORS[0])
    return replace(coarse, level=context.waves.level)


def changes_on(context: PlanningContext, seat: GreensFunction) -> Changes:
    """Return the changes by a static seat in place of this ``seat``."""
    bench = context.sensitivity.bench
    window = locate_contact_window(bench.scene, seat, bench.striker, bench.stopper)
    on = replace(bench, seat=seat, window=window)
    return replace(context.sensitivity, bench=on, per_filter=PER_FILTER, reed_modes=REED_MODES).spring


def _leaves_open(context: PlanningContext, guess: WithoutWaves) -> bool:
    """Return whether the estimate is neither small enough to accept a spring, nor so large, even if overstated, as to
    reject it."""
    target = context.scene.accuracy.target
    largest = max(safety(name) * guess.changes[name] for name in guess.asked)
    return guess.doubt * largest > target / LEVEL_SHARE and largest / OVERSTATED <= AIM * target
