"""The ladder of models: a spring, a closed form, or finite elements with waves, each with its modelling error."""

from dataclasses import dataclass, replace
from typing import Final

import impact
from impact.greens.base import GreensFunction
from impact.runs.variations import Terms, Variation
from seatfem.structures.kinds import Structure
from seatfem.structures.method import AUTO, AnyLevel, Method, replace_waves_in_arcs, with_start
from seatfem.structures.patch import ERRORS, Patch, divide_on_patch
from seatfem.structures.rings import face_compliance
from seatfem.study.impacts.bodies import solve_body
from seatfem.study.ladders.ladder import Beginning, ComputedRun, Ladder, Role
from seatfem.study.ladders.mesh import BANDS, TOLERANCES, element_sizes, lowest_band, next_band
from seatfem.study.method import MODEL, RunMethod, has_key
from seatfem.study.plan import Plan
from seatfem.study.safety import FAILURES

SHEAR_SHARE: Final = 0.05  # share of the target from which on the shear of a beam counts
BAND_PER_FILTER: Final = 0.5  # bandwidth of the coarse seat times the filter's width: with half of it bars halve
DOUBT_OF_COARSE: Final = 1.3  # factor by which waves may exceed those of a seat on a coarse mesh
DOUBT: Final = 3.0
"""That factor for a rod with the estimated compliance (with 2, 4 % of bars were too small), and for a seat struck along
a lip, of one struck as a whole (2.6 on a thin plate, tests/study/test_surrogates.py)."""


@dataclass(frozen=True)
class Level(Ladder):
    """The level of a body's model; its neighbour is the next better level, if that is cheap."""

    remedy: str = "take a more complete {key}"

    def neighbours(self, run: ComputedRun) -> Terms:
        """Return the run with g larger by the error that the level states; for the seat also the run on a better level,
        and those with the shear deformation of thick beams."""
        level = run.with_larger_g(self.role, run.solved[self.role].level_error)
        if self.role != "seat":
            return level
        better, seat = _better(run), run.method.seat
        if seat.static and not tells_waves(run.scene.seat, seat):
            better = (*better, *_waves(run))
        terms = (*level, *_shear(run))
        return (*terms, better) if better else terms

    def begin(self, known: Beginning, method: RunMethod) -> RunMethod:
        """Return the method with the static compliance of a seat that is drawn, the simplest model; with waves where
        those that it would be compared with cost as much."""
        seat = known.scene.seat
        if self.role != "seat" or MODEL in method.given or not has_key(known.scene, MODEL):
            return method
        still = method.replaced({MODEL: "spring"})
        return method.replaced({MODEL: level_with_waves(seat, still.seat)}) if tells_waves(seat, still.seat) else still

    def refine(self, plan: Plan, factor: float) -> RunMethod:
        """Return the method of a plan with waves in the seat: its half section, a sector or, along a lip, all of it."""
        method = plan.method
        if self.role != "seat" or MODEL in method.given or not method.seat.static:
            return method
        return method.replaced({MODEL: level_with_waves(plan.scene.seat, method.seat)})


def _shear(run: ComputedRun) -> Terms:
    """Return the runs with the shear deformation of beams, where it counts."""
    scene, least = run.scene, SHEAR_SHARE * run.scene.accuracy.target
    errors: dict[Role, float] = {
        "reed": scene.reed.shear_error(scene.contact.at),
        "seat": scene.seat.shear_error(None),
    }
    counting = (run.with_larger_g(role, error) for role, error in errors.items() if error > least)
    return tuple(term for terms in counting for term in terms)


def _better(run: ComputedRun) -> tuple[Variation, ...]:
    """Return the run on a better level of the seat, if there is a cheap one.

    A static seat loses the momentum that waves return, in one scene 4.3 % of the impulse, and an estimate has neither
    the seat's section nor its harmonics.
    """
    seat, method, better = run.scene.seat, run.method.seat, with_start(run.seat.greens)
    if better is None and (dynamic := method_beside(seat, method)) is not None:
        solved = solve_body("seat", seat, dynamic, run.scene.run.duration, mesh_error=False)
        better = None if solved is None else solved.greens
    if better is None:
        better = seat.beyond(method.level)
    return () if better is None else (run.with_greens("seat", better),)


def _waves(run: ComputedRun) -> tuple[Variation, ...]:
    """Return the run on a seat with waves against the same without them: the seat is solved on a coarse mesh and struck
    as a whole, along a lip with a half-space under its parts, which leaves out what a tilted landing excites besides,
    so that it counts `DOUBT` times; where that is impossible, it is estimated. None where its struck face is not
    known."""
    scene, lip = run.scene, run.method.seat.lip
    patch, estimate = scene.seat.patch(), scene.seat.estimate()
    if patch is None or estimate is None:
        return ()
    method = coarse_method(scene.seat, run.method.seat, patch, scene.run.filter_width)
    try:
        solved = solve_body("seat", scene.seat, method, scene.run.duration, mesh_error=False)
    except FAILURES:
        solved = None
    waves, doubt = (estimate, DOUBT) if solved is None else (solved.greens, DOUBT_OF_COARSE)
    whole = waves.modal
    if run.division.arcs > 1 and lip is not None and whole is not None:
        waves, doubt = divide_on_patch(whole, lip, patch), DOUBT
        static: GreensFunction = replace_waves_in_arcs(waves)
    else:
        static = impact.spring(stiffness=1 / face_compliance(waves))
    one, other = (run.with_greens("seat", greens).problem for greens in (waves, static))
    return (Variation(one, doubt, other),)


def level_with_waves(seat: Structure, how: Method) -> AnyLevel:
    """Return the level of a seat with waves: 3-D, a half section or, where it is not struck along a lip, a sector."""
    level = seat.level(0.0).level
    return "3d" if how.lip is not None and level == "sector" else level


def coarse_method(seat: Structure, stated: Method, patch: Patch, width: float) -> Method:
    """Return the coarsest method of a seat that resolves the waves passed by a filter of ``width`` [s], struck as a
    whole: any reduction gives the same Green's function to within its tolerance."""
    least = min(max(lowest_band(patch), BAND_PER_FILTER / width), BANDS[-1])
    sizes = element_sizes(patch, stated, least, ERRORS[0])
    return replace(
        stated,
        level=seat.level(0.0).level,
        rings=1,
        lip=None,
        reduction=AUTO,
        max_vectors=None,
        bandwidth=next_band(least),
        tolerance=TOLERANCES[1],  # larger ones save no time
        size=sizes.size,
        contact_size=sizes.contact_size,
    )


def tells_waves(seat: Structure, method: Method) -> bool:
    """Return whether the budget of a static seat includes a run with waves: for a body of revolution in arcs, whose
    waves are cheap, as modes of half sections of a few hundred unknowns each."""
    return method.static and method.in_arcs and seat.elements_of(method) == "harmonics"


def method_beside(seat: Structure, method: Method) -> Method | None:
    """Return the method of a static seat's waves for the error budget: on the same mesh, with a band up to its first
    resonances; ``None`` if the seat is not static, or its waves are expensive."""
    if not tells_waves(seat, method) or (patch := seat.patch()) is None:
        return None
    assert method.bandwidth is not None
    sizes, band = seat.sizes(method), min(method.bandwidth, lowest_band(patch))
    level = level_with_waves(seat, method)
    return replace(method, level=level, bandwidth=band, size=sizes.size, contact_size=sizes.contact_size)
