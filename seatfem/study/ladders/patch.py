"""Ladders of the contact faces: rings, arcs of a lip, one contact point in their place, and the parts of a stopper."""

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import impact
from impact.greens import base, modal
from impact.march.problem import ContactProblem
from impact.runs.variations import UNKNOWN, Terms, Variation, with_body
from seatfem.structures.errors import ModelError
from seatfem.structures.kinds import Structure
from seatfem.structures.kinds.structure import is_curved
from seatfem.structures.lip import AnyLip
from seatfem.structures.method import bed
from seatfem.structures.patch import divide_on_patch
from seatfem.structures.rings import (
    ACROSS,
    FEWEST_ARCS,
    MOST_CHOSEN,
    MOST_PORTS,
    MOST_RINGS,
    OF_ONE,
    OF_TWICE,
    REFERENCE_RINGS,
    Division,
    arc_rings_to_compare,
    divided_less,
    division_to_compare,
    face_compliance,
    find_fewer_arcs,
    join_all_parts,
    left_by,
    parts_joined,
    with_fewer_rings,
)
from seatfem.study.impacts.bodies import problem_of, solve_body, striker_of
from seatfem.study.ladders.ladder import Beginning, ComputedRun, Ladder
from seatfem.study.ladders.mesh import fit_contact_size
from seatfem.study.method import CONTACT_SIZE, PORTS, RINGS, STOPPER_ARCS, STOPPER_RINGS, RunMethod
from seatfem.study.plan import Plan
from seatfem.study.scene import Scene, local
from seatfem.study.scene.lips import ContactGeometry
from seatfem.study.scene.measures import any_needs
from seatfem.study.scene.problems import SceneError


@dataclass(frozen=True)
class Rings(Ladder):
    """The rings of the patch, or the parts across the arcs of a lip."""

    effort: float = 0.7
    rule: str = "one, to begin with"
    remedy: str = "divide the contact face by {key} = 4, or more"

    def begin(self, known: Beginning, method: RunMethod) -> RunMethod:
        """Return the method with the struck face of a reduced seat as one ring; a lip keeps what is stated."""
        is_open = known.is_reduced and method.seat.lip is None and RINGS not in method.given
        return method.replaced({RINGS: 1}) if is_open else method

    def refine(self, plan: Plan, factor: float) -> RunMethod:
        """Return the method of a plan with more rings or, along a lip, more parts across; none under a film, or where
        an assessment needs the whole contact."""
        scene, method = plan.scene, plan.method
        if RINGS in method.given or not (value := method.seat.rings):
            return method
        if not method.seat.in_arcs:
            finer = super().refine(plan, factor)
            return method if finer == method else finer.with_values(scene.geometry, {})
        rings = next((number for number in ACROSS if number > value), value)
        if rings == value or scene.contact.film is not None or not scene.seat.traits.has_rings:
            return method
        if any(each.needs_whole_contact for each in scene.assessments):
            return method
        return _divide_lip(scene.geometry, method, method.seat.lip.arcs if method.seat.lip else 1, rings)

    def finer(self, value: int, factor: float) -> int:
        """Return twice as many rings, at least those that one or two are compared with."""
        return min(max(2 * value, REFERENCE_RINGS), MOST_RINGS)

    def neighbours(self, run: ComputedRun) -> Terms:
        """Return the run with other rings: many in place of one or two, on the coarser mesh; one in place of more.

        Fewer rings make the face too soft, as the striker's face is stiff. A rod or spring has no rings; their effect
        is unknown for a response from a file. Along a lip see `compare_rings_across`.
        """
        if local.holds_patches(run.scene.geometry):
            return ()
        seat, division, divided = run.seat, run.division, run.seat.in_rings
        if division.arcs > 1:
            return compare_rings_across(run)
        if (rings := division.rings) > 2:
            return ((run.with_greens("seat", with_fewer_rings(seat.greens, 1), left_by(rings)),),)
        if divided is None:
            return () if seat.plane else UNKNOWN
        varied, same = (run.with_greens("seat", g).problem for g in (divided, with_fewer_rings(divided, rings)))
        return ((Variation(varied, 1 + left_by(Division.from_greens(divided).rings), same),),)


def _divide_lip(geometry: ContactGeometry, method: RunMethod, arcs: int, rings: int) -> RunMethod:
    """Return the method with the lip in these parts, as far as they are no more than the program chooses itself."""
    if arcs * rings > MOST_CHOSEN:
        return method
    return meshed_for_arcs(geometry.seat, method.along(geometry, arcs, rings))


def meshed_for_arcs(seat: Structure, method: RunMethod) -> RunMethod:
    """Return the method with an element in each arc of a lip that is meshed in space, unless the size is stated."""
    size = method.seat.contact_size
    if size is None or CONTACT_SIZE in method.given:
        return method
    return method.replaced({CONTACT_SIZE: fit_contact_size(seat, method.seat, size)})


def compare_rings_across(run: ComputedRun) -> Terms:
    """Return the run with more rings across the lip's arcs on both bodies, each with its own gap.

    The seat is that of the whole lip with a half-space under its parts, and half as many arcs are enough, as the effect
    of rings hardly depends on them. A film, which is known across the whole lip, is left out of both runs.
    """
    scene, problem, division = run.scene, run.problem, run.division
    rings, weight = arc_rings_to_compare(division.rings)
    if scene.contact.film is not None:
        scene = scene.model_copy(update={"contact": scene.contact.model_copy(update={"film": None})})
    arcs, most = scene.geometry.arcs_behind_rings(division), max(rings, division.rings)
    lip = scene.geometry.lip(arcs, most)
    many = _put_on_half_space(run.scene.seat, run.seat.greens, lip)
    if many is None:
        return UNKNOWN
    finest = Division(arcs, most)
    plate = _greens_along(run, lip)

    def struck(division: Division) -> ContactProblem:
        striker = problem.striker if plate is None else striker_of(scene, greens=parts_joined(plate, finest, division))
        return problem_of(scene, striker, impact.Body(divided_less(many, division)), run.bodies.get("stopper"))

    return ((Variation(struck(Division(arcs, rings)), weight, struck(Division(arcs, division.rings))),),)


@dataclass(frozen=True)
class Arcs(Ladder):
    """The arcs of a lip; the neighbour has twice as many on both bodies, or half as many at the limit."""

    effort: float = 0.7
    rule: str = "one contact where that may stand for segments, else the fewest whose convergence can be estimated"
    remedy: str = "divide the lip by more {key}"

    def begin(self, known: Beginning, method: RunMethod) -> RunMethod:
        """Return the method with one contact where that may stand for a lip, else with the fewest arcs."""
        if PORTS in method.given or (method.ports or 1) == 1 or known.patch is None:
            return method
        scene = known.scene
        if is_one_enough(scene):
            return method.along(scene.geometry, 1, scene.contact.rings)
        return divide_in_fewest_arcs(scene.geometry, scene.accuracy.measures, method)

    def refine(self, plan: Plan, factor: float) -> RunMethod:
        """Return the method of a plan with twice as many arcs."""
        method = plan.method
        if PORTS in method.given or (method.ports or 1) == 1:
            return method
        return _divide_lip(plan.scene.geometry, method, 2 * (method.ports or 1), method.seat.rings or 1)

    def neighbours(self, run: ComputedRun) -> Terms:
        """Return the run with other arcs, each with its own gap, on a coarser mesh of the seat."""
        division, finer = run.division, run.seat.in_rings
        if division.arcs == 1:
            return ()
        other, weight = _find_parts_to_compare(division)
        if finer is None or not _holds(finer, other):
            return UNKNOWN
        varied = _met_along(run, divided_less(finer, other), run.scene.geometry.lip(other.arcs, other.rings))
        return ((Variation(varied, weight, run.with_greens("seat", divided_less(finer, division)).problem),),)


def divide_in_fewest_arcs(geometry: ContactGeometry, measures: Sequence[str], method: RunMethod) -> RunMethod:
    """Return the method with the fewest arcs of a lip whose convergence can be estimated; where a force per length is
    among the ``measures``, with arcs no longer than the part over which it is averaged; the same without a lip."""
    along_line = math.ceil(2 * math.pi / geometry.contact.line_arc) if any_needs(measures, "line") else 1
    fewest = max(FEWEST_ARCS, along_line)
    lip = geometry.lip(fewest)
    return method if lip is None else method.along(geometry, lip.whole(fewest))


def is_one_enough(scene: Scene) -> bool:
    """Return whether one contact may stand for those along a lip: of a plate that lands flat, where nothing along it
    and no stress is asked for."""
    if any_needs(scene.accuracy.measures, "line") or scene.stress is not None or scene.assessments:
        return False
    return not scene.contact.uneven_key and not is_curved(scene.reed) and scene.geometry.lip(1) is not None


@dataclass(frozen=True)
class OnePort(Ladder):
    """One contact of a plate in place of the segments of a lip: the first value of an open number, or stated."""

    effort: float = 0.7
    remedy: str = f"divide the lip by {PORTS}"

    def refine(self, plan: Plan, factor: float) -> RunMethod:
        """Return the method of a plan with the lip in segments, and an element in each."""
        scene, method = plan.scene, plan.method
        if PORTS in method.given or method.ports != 1:
            return method
        finer = divide_in_fewest_arcs(scene.geometry, scene.accuracy.measures, method)
        return method if finer == method else meshed_for_arcs(scene.seat, finer)

    def applies(self, run: ComputedRun) -> bool:
        """Return whether a plate meets a lip with one contact."""
        return run.division.arcs == 1 and run.scene.geometry.segments() is not None

    def neighbours(self, run: ComputedRun) -> Terms:
        """Return the run with the lip in segments, weighted by `OF_ONE`, against one contact point on the same
        half-space, and against the run itself, as one change may be small by accident."""
        lip = run.scene.geometry.segments()
        many = _put_on_half_space(run.scene.seat, run.seat.greens, lip)
        if many is None:
            return UNKNOWN
        one = run.with_greens("seat", join_all_parts(many)).problem
        varied = _met_along(run, many, lip)
        return ((Variation(varied, OF_ONE, one), Variation(varied, OF_ONE)),)


def _put_on_half_space(struck: Structure, greens: base.GreensFunction, lip: AnyLip | None) -> modal.ModalGreens | None:
    """Return the response of seat or stopper with a half-space under the parts of a lip; ``None`` if either is
    unknown."""
    patch, estimate = struck.patch(), struck.estimate()
    if lip is None or patch is None or estimate is None:
        return None
    whole = join_all_parts(greens).modal or estimate.modal
    return None if whole is None else divide_on_patch(whole, lip, patch)


def _met_along(run: ComputedRun, seat: base.GreensFunction, lip: AnyLip | None) -> ContactProblem:
    """Return the run on another seat, which a plate meets with the parts of its lip."""
    greens = _greens_along(run, lip)
    striker = run.problem.striker if greens is None else striker_of(run.scene, greens=greens)
    return problem_of(run.scene, striker, impact.Body(seat), run.bodies.get("stopper"))


def _greens_along(run: ComputedRun, lip: AnyLip | None) -> base.GreensFunction | None:
    """Return the Green's function of the striker with the parts of a lip of the seat; ``None`` of a rigid face."""
    if (met := run.scene.geometry.place_on_reed(lip)) is None:
        return None
    reed = replace(run.method.reed, lip=met)
    solved = solve_body("reed", run.scene.reed, reed, run.scene.run.duration, mesh_error=False)
    return None if solved is None else solved.greens


@dataclass(frozen=True)
class StopperParts(Ladder):
    """The parts in which a stopper is met: twice as many arcs, more rings across them, and both in place of one."""

    def refine(self, plan: Plan, factor: float) -> RunMethod:
        """Return the method of a plan with more arcs and rings of the stopper, as far as the file leaves them open; the
        same if they would be more than the program chooses itself, or the file states one arc."""
        geometry, method = plan.scene.geometry, plan.method
        division, has_arcs = method.stopper, STOPPER_ARCS in method.given
        if division is None or (has_arcs and division.arcs == 1):
            return method
        if (finer := finer_stopper(geometry, division)) is None:
            return method
        arcs = division.arcs if has_arcs else finer.arcs
        finer = Division(arcs, division.rings if STOPPER_RINGS in method.given else finer.rings)
        return method if finer == division or finer.count > MOST_CHOSEN else method.stopped(geometry, finer)

    def applies(self, run: ComputedRun) -> bool:
        """Return whether the stopper was computed, or is met in parts."""
        if run.scene.stopper is None or "stopper" not in run.bodies:
            return False
        return "stopper" in run.solved or run.scene.stopper.parts != Division()

    def neighbours(self, run: ComputedRun) -> Terms:
        """Return the run with other parts of the stopper, on both bodies; unknown where the body is not known in
        these.

        Arcs and rings both move the place that a leaning plate meets first, so that each is compared by itself; a face
        that is met as a whole is compared with both, and with the stopper's own face where the plate states another.
        """
        assert run.scene.stopper is not None
        division = run.scene.stopper.parts
        if not all(beside := _vary_stopper_parts(run, division)):
            return beside
        if division.arcs > 1:
            return beside if run.scene.geometry.has_two_places else (*beside, *_stopper_rings(run, division))
        together = (*itertools.chain(*beside), *_stopper_in_arcs(run, division), *_vary_stopper_face(run))
        return (together,) if together else ()


def _vary_stopper_parts(run: ComputedRun, division: Division) -> Terms:
    """Return the run with the parts of the stopper that `_find_parts_to_compare` states, of a model that has them; none
    where its face is a plane, unknown where there is no such model."""
    body, solved = run.bodies["stopper"], run.solved.get("stopper")
    other, weight = _find_parts_to_compare(division)
    assert run.scene.stopper is not None
    if solved is None or run.scene.stopper.profile is not None:  # springs, or a body that moves as a whole
        same, greens = run.problem, _divide_closed_form(body, other)
    else:
        models = [each for each in (solved.in_rings, solved.greens) if each is not None]
        model = next((each for each in models if _holds(each, division) and _holds(each, other)), None)
        if model is None:
            return () if solved.plane else UNKNOWN
        same = with_body(run.problem, body, replace(body, greens=divided_less(model, division)))
        greens = divided_less(model, other)
    return ((Variation(_stopped_by(run, other, greens), weight, same),),)


def _stopper_rings(run: ComputedRun, division: Division) -> Terms:
    """Return the run with other rings across the stopper's arcs, of which half are enough, as behind
    `compare_rings_across`; none for a body whose face is not known."""
    rings, weight = arc_rings_to_compare(division.rings)
    arcs = division.arcs
    while arcs % 2 == 0 and arcs // 2 >= FEWEST_ARCS:
        arcs //= 2
    own, other = (_stopped_in(run, Division(arcs, each)) for each in (division.rings, rings))
    return () if own is None or other is None else ((Variation(other, weight, own),),)


def _stopper_in_arcs(run: ComputedRun, division: Division) -> Sequence[Variation]:
    """Return the run in which a plate meets all of the stopper's face in segments and parts across, weighted by
    `OF_ONE`; none where that face is no ring, disc or strip, or the plate does not cover it."""
    parts = finer_stopper(run.scene.geometry, division)
    try:
        divided = None if parts is None else _stopped_in(run, parts)
    except (ModelError, SceneError):
        return ()
    return () if divided is None else (Variation(divided, OF_ONE),)


def finer_stopper(geometry: ContactGeometry, division: Division) -> Division | None:
    """Return the parts of a stopper that are finer than a ``division``: twice as many arcs and more rings, or the first
    of both; ``None`` where its face cannot be divided, or no further."""
    stopper = geometry.stopper
    if stopper is None:
        return None
    if stopper.profile is not None and geometry.has_two_places:  # a beam is met along its length only
        return Division(2 * division.arcs) if 2 * division.arcs <= MOST_PORTS else None
    if division.arcs > 1:
        rings = max(division.rings, arc_rings_to_compare(division.rings)[0])
        return Division(2 * division.arcs, rings) if 2 * division.arcs * rings <= MOST_PORTS else None
    try:
        face = geometry.reed.meets(geometry.struck(body=stopper.body))
    except ModelError:
        return None
    return None if face is None else Division(face.whole(FEWEST_ARCS), max(ACROSS[1], division.rings))


def _stopped_in(run: ComputedRun, division: Division) -> ContactProblem | None:
    """Return the run with its stopper in these parts, a half-space under its face; ``None`` if that is not known."""
    body, solved, stopper = run.bodies["stopper"], run.solved.get("stopper"), run.scene.stopper
    assert stopper is not None
    if solved is None or stopper.profile is not None:
        return _stopped_by(run, division, _divide_closed_form(body, division))
    if solved.plane:
        return _stopped_by(run, division, join_all_parts(body.greens))
    lip = run.scene.geometry.struck(division.arcs, division.rings, stopper.body)
    greens = _put_on_half_space(stopper.body, body.greens, lip)
    return None if greens is None else _stopped_by(run, division, greens)


def _divide_closed_form(body: impact.Body, division: Division) -> base.GreensFunction:
    """Return a stopper that is not solved in other parts: springs side by side, or a body that moves as a whole."""
    return bed(division, 1 / face_compliance(body.greens)) if len(body.greens.ports) > 1 else body.greens


def _stopped_by(run: ComputedRun, division: Division, greens: base.GreensFunction) -> ContactProblem:
    """Return the run with a stopper of this Green's function, met in these parts."""
    scene, body, striker = run.scene, run.bodies["stopper"], run.problem.striker
    assert scene.stopper is not None
    scene = scene.model_copy(update={"stopper": scene.stopper.divided(division)})
    if scene.geometry.has_two_places:  # a beam has a port at each place
        striker = striker_of(scene, run.method.reed.n_modes)
    elif (lip := scene.geometry.place_behind_reed()) is not None:
        striker = _met_behind(run, lip)
    return problem_of(scene, striker, run.problem.target, replace(body, greens=greens))


def _vary_stopper_face(run: ComputedRun) -> Sequence[Variation]:
    """Return the run in which a plate whose table states its contact meets the stopper with the stopper's face."""
    scene = run.scene
    if not scene.reed.states_contact or scene.geometry.stopper_lip() is not None:
        return ()
    try:
        behind = replace(scene.geometry, reed=scene.reed.covering()).place_behind_reed()
    except SceneError:  # a broad face, for which the contact is stated
        return ()
    if behind is None:
        return ()
    striker = _met_behind(run, behind)
    return (Variation(problem_of(scene, striker, run.problem.target, run.bodies.get("stopper"))),)


def _met_behind(run: ComputedRun, behind: AnyLip) -> impact.Body:
    """Return the plate that meets its stopper ``behind``, a face in parts."""
    how = replace(run.method.reed, behind=behind)
    reed = solve_body("reed", run.scene.reed, how, run.scene.run.duration, mesh_error=False)
    return striker_of(run.scene, greens=None if reed is None else reed.greens)


def _find_parts_to_compare(division: Division) -> tuple[Division, float]:
    """Return the parts that others are compared with, and the share of what they change that is left: twice as many
    arcs, half as many where no more can be; several rings in place of one or two, one in place of more."""
    other = division_to_compare(division)
    if division.arcs == 1:
        return (Division(), left_by(division.rings)) if division.rings > 2 else (other, 1 + left_by(other.rings))
    return (find_fewer_arcs(division), OF_TWICE - 1) if other == division else (other, OF_TWICE)


def _holds(greens: base.GreensFunction, division: Division) -> bool:
    """Return whether the parts of a patch make those of a coarser division."""
    known = Division.from_greens(greens)
    return known.arcs % division.arcs == 0 and known.rings % division.rings == 0
