"""Post-processing after the last round of a run: spring baseline, stress and fatigue life of the bodies."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np

import impact
from impact.after.histories import ReedStress
from impact.after.result import ImpactResult
from impact.greens.base import GreensFunction
from impact.greens.modal import ModalGreens
from impact.march.problem import ContactProblem
from impact.notices import Progress, Tell
from impact.quantities import finite_or_none, percent
from impact.runs.variations import ROUND_OFF, SAFETY, Budget, Values, Variation, budget_of
from seatfem.machine.resources import Stopwatch
from seatfem.pictures import moving
from seatfem.structures import method, rings
from seatfem.structures.patch import Column
from seatfem.study.impacts import contact, validity
from seatfem.study.impacts import life as place_lives
from seatfem.study.impacts.bodies import problem_of
from seatfem.study.impacts.contact import RunError, record_of, run_contacts
from seatfem.study.impacts.touches import RECORD, RunRecord, Touches, contact_record_of, stress_since, values_of_record
from seatfem.study.ladders.mesh import OF_DRAWS
from seatfem.study.plan import Plan
from seatfem.study.runs import (
    horizon,
    kept,
    lives,
    margin_bars,
    seat_stress,
    stress_spots,
    stress_wave,
    stresses,
    summary,
)
from seatfem.study.runs import pictures as run_pictures
from seatfem.study.runs.body_stress import BodyStress, ClosedFormStress
from seatfem.study.runs.round import Round
from seatfem.study.scene import Accuracy
from seatfem.study.scene.measures import LifeMargin, Stress

if TYPE_CHECKING:
    from seatfem.pictures import rendering
    from seatfem.study.impacts.life import LifeResult
    from seatfem.study.runs import stress_spots
    from seatfem.study.runs.lives import MarginCurve
    from seatfem.study.runs.reed_stress import PlateStress
    from seatfem.study.runs.seat_stress import SeatStress

PICTURE: Final = "margin_map.png"


def margin_pictures(done: Round, bodies: Sequence[BodyStress]) -> list[rendering.Picture]:
    """Return margin_map.png, seat_margin.vtu and reed_margin.vtu of the bodies with a strength and a stress in finite
    elements; none unless the scene has [stress] and [life]."""
    life = done.plan.scene.life
    if life is None or done.plan.scene.stress is None:
        return []
    first = place_lives.block_from(life, done.plan.scene.turn, done.touches)
    demands = {"seat": life.demand("seat"), "reed": life.demand()}
    try:
        asked = [(body, demand) for body in bodies if (demand := demands[body.role]) is not None]
        maps = [each for body, demand in asked if (each := body.margin_map(demand, first)) is not None]
    except Exception as problem:  # all numbers are on file: the missing picture is reported instead
        return [(PICTURE, partial(run_pictures.raising, problem))]
    if not maps:
        return []
    criterion = f" ({life.multiaxial})" if life.multiaxial else f" ({life.criterion}, critical plane)"
    title = f"{done.plan.scene.title or 'Fatigue'}: margin on stress{criterion}\n"
    files: list[rendering.Picture] = [
        (f"{each.title}_margin.vtu", partial(moving.write_surface, each, {"margin": each.colours[0]})) for each in maps
    ]
    return [(PICTURE, partial(moving.plot_margin_map, maps, title=title)), *files]


@dataclass(frozen=True)
class Baseline:
    """The run on a spring of the seat's static stiffness, to compare with the run ``beside``, and what ``simpler``
    models of the seat give, by keys of summary.json. ``left``, ``stiffness_bar``: errors of its measures and of the
    stiffness [N/m] if the seat is a measured record, else ``None``."""

    beside: ImpactResult
    stiffness: float
    touches: Touches
    stress: ReedStress | None
    simpler: Mapping[str, object]
    left: Budget | None = None
    stiffness_bar: float | None = None

    @property
    def result(self) -> ImpactResult:
        """Return the impact on the spring."""
        return self.touches.seat


def baseline_of(done: Round, watch: Stopwatch) -> Baseline:
    """Return the spring baseline of a round, which is the round's own run if its seat is a spring. Raises as
    `static_stiffness`."""
    scene = done.plan.scene
    stiffness = static_stiffness(done.seat.greens, scene.seat.column())
    with watch("spring baseline"):
        division = rings.Division.from_greens(done.seat.greens)
        spring = method.bed(division, stiffness) if division.arcs > 1 else impact.spring(stiffness=stiffness)
        same = _is_spring(done.seat.greens, spring)
        touches = (
            done.touches if same else run_contacts(scene, done.striker, spring, done.result.dt, flights=done.flights)
        )
    stress = None
    if same:
        stress = done.stress
    elif done.stress is not None:
        with watch("reed stress"):
            strike, since = replace(done.strike, touches=touches), stress_since(touches, scene.accuracy.landing)
            if done.plate is None:
                stress = strike.largest_stress(coarsely=not scene.needs_stress, since=since)
            else:
                stress = done.plate.largest_in(strike, since)
    if not same and scene.life is None:
        touches = replace(touches, parts=None)  # long histories of many parts, of which the line keeps the forces
    simpler: Mapping[str, object] = {}
    if done.touches.line is not None or scene.contact.film is not None:
        with watch("simpler models"):
            models = validity.simpler_models(scene, done.striker, done.seat.greens, done.result.dt)
            simpler = validity.simpler_keys(models, scene.run.filter_width)
            del models
    errors, bar = None, None
    if draws := scene.seat.other_fits():
        with watch("spring baseline"):
            others = [static_stiffness(draw) for draw in draws]
            errors = _record_errors(done, touches, stress, stiffness, others)
            bar = SAFETY * OF_DRAWS * max(abs(other - stiffness) for other in others)
    return Baseline(done.result, stiffness, touches, stress, simpler, errors, bar)


def _is_spring(seat: GreensFunction, spring: ModalGreens) -> bool:
    """Return whether a seat's response equals that of ``spring`` to round-off, so that its run is the baseline."""
    greens, rest = seat.modal, spring.residual
    return (
        greens is not None
        and not greens.omega.size
        and not greens.residual.rates.size
        and greens.residual.compliance.shape == rest.compliance.shape
        and np.allclose(greens.residual.compliance, rest.compliance, rtol=ROUND_OFF, atol=0.0)
    )


def _record_errors(
    done: Round, touches: Touches, stress: ReedStress | None, stiffness: float, others: Sequence[float]
) -> Budget:
    """Return the baseline's errors by time step and by noise of the record, the latter from the stiffness of draws."""
    scene, width = done.plan.scene, done.plan.scene.run.filter_width

    def problem(value: float) -> ContactProblem:
        return problem_of(scene, done.striker, impact.Body(impact.spring(stiffness=value)))

    def run(varied: ContactProblem, dt: float) -> Values:
        return values_of_record(record_of(scene, varied, dt, like=touches.landings, look=done.look), touches.landings)

    own = problem(stiffness)
    record = contact_record_of(touches, width, stress, scene.accuracy.landing)
    values = values_of_record(RunRecord(record, touches.landings, touches.stopper_force), touches.landings)
    draws = tuple(Variation(problem(other), OF_DRAWS) for other in others)
    return budget_of(run, own, values, touches.seat.dt, {RECORD: (draws,)}, filter_width=width)


def static_stiffness(greens: GreensFunction, column: Column | None = None) -> float:
    """Return the static stiffness of the struck patch [N/m]; of an endless body, the stiffness of its ``column``.
    Raises `RunError` for a seat that is free to move."""
    compliance = rings.face_compliance(greens)
    if column is not None and np.isinf(compliance) and math.isinf(greens.mass()):
        return column.stiffness
    if not np.isfinite(compliance) or compliance <= 0:
        raise RunError(
            "the seat has no static stiffness (it is free to move, or sampled without a rest), so there is no spring "
            "to compare with; hold the seat somewhere, or state seat.free = false for a record"
        )
    return 1.0 / compliance


@dataclass(frozen=True)
class Afterwards:
    """Attributes:
    keys: entries of summary.json.
    bodies: stress of the bodies.
    stress: stress in the seat, if the scene has [stress].
    spots: hot spots of both bodies.
    life: fatigue life of the bodies, if the scene has [life].
    curves: margins over values of one key.
    files: files that were written."""

    keys: Mapping[str, object] = field(default_factory=dict)
    bodies: tuple[BodyStress, ...] = ()
    stress: SeatStress | None = None
    spots: stress_spots.Spots = field(default_factory=lambda: stress_spots.Spots())
    life: LifeResult | None = None
    curves: tuple[MarginCurve, ...] = ()
    files: tuple[Path, ...] = ()

    def pictures(self, done: Round) -> list[rendering.Picture]:
        """Return the pictures of stress, life and curves."""
        title = done.plan.scene.title
        of_seat: list[rendering.Picture] = []
        waves: list[rendering.Picture] = []
        if self.stress is not None:
            unsure = done.touch, done.touch + done.plan.scene.run.filter_width
            of_seat = seat_stress.stress_pictures(self.stress, title or "Stress in the seat", unsure)
            waves = stress_wave.wave_pictures(done, self.bodies)
        return [
            *of_seat,
            *stress_spots.spot_pictures(self.spots, done.touch, f"{title or 'Stress'}: histories at the hot spots"),
            *waves,
            *margin_pictures(done, self.bodies),
            *lives.curve_pictures(self.curves),
        ]

    def notes(self, plan: Plan) -> tuple[str, ...]:
        """Return notes on stress, drives and life for the reader of the run."""
        scene = plan.scene
        return (
            *self.margin_missed(scene.accuracy),
            *(() if self.stress is None else stresses.stress_notes(plan, self.stress)),
            *(note for each in scene.driven_by for note in each.notes()),
            *(() if self.life is None else place_lives.life_notes(scene.life, self.life)),
        )

    def margin_missed(self, accuracy: Accuracy) -> tuple[str, ...]:
        """Return a sentence where the margin over the design life was asked for and its error bar misses the target."""
        margin, bar = (self.keys.get(f"{prefix}{LifeMargin.key}") for prefix in ("", "error_bar_"))
        target = accuracy.target
        if LifeMargin.name not in accuracy.measures or not isinstance(margin, float):
            return ()
        relative = bar / margin if isinstance(bar, float) and margin else math.inf
        if relative <= target:
            return ()
        known = f"an uncertainty of {percent(relative)}" if math.isfinite(relative) else "no known uncertainty"
        return (
            f"{LifeMargin.words} ({LifeMargin.key}) has {known}, above accuracy.target = {percent(target)}: rounds "
            "refine the largest stress in its place",
        )


def afterwards(
    done: Round,
    baseline: Baseline,
    folder: Path,
    watch: Stopwatch,
    progress: Progress,
    *,
    tell: Tell,
    histories: bool,
    keep: Callable[[Mapping[str, object]], None],
) -> Afterwards:
    """Compute strains, stress, life and curves of the last round.

    Args:
        histories: whether to write stress histories.
        keep: function called with all keys so far after each stage, which writes them to file.
    """
    scene, keys = done.plan.scene, dict[str, object]()
    if horizon.has_horizon(done):
        with watch("horizon"):
            compute = partial(horizon.horizon_keys, done, progress)
            keys |= kept.cached_numbers(done, done.touches, "horizon", compute)
    elif scene.run.ensemble is not None:
        keys |= horizon.NO_ENSEMBLE
    courses: tuple[Path, ...] = ()
    if scene.gauge:
        keys |= contact.gauge_values(done.touches.strains)
        courses = (contact.write_strains(folder, done.touches.strains, done.result.dt),)
        keep(keys)
    stress, plate = None, done.plate
    if scene.stress is not None or scene.life is not None:
        with watch("reed stress" if scene.stress is None else "seat stress"):
            stress, plate = stresses.stresses(done, progress)
        keys |= seat_stress.stress_keys(stress) | ({} if done.plate or plate is None else plate_stress_keys(plate))
        keep(keys)
    keys |= reed_front_keys(done, done.stress if plate is None else plate.largest)
    bar = done.left.relative(Stress.name) if done.left.values.get(Stress.name, 0.0) > 0 else math.nan
    reed = ClosedFormStress(done.strike, bar) if plate is None else plate
    bodies: tuple[BodyStress, ...] = (reed,) if stress is None else (reed, stress)
    with watch("hot spots"):
        named = 0 if scene.stress is None else len(scene.stress.points)
        spots = stress_spots.Spots.from_bodies(bodies, done.result.time, named)
        files = stress_spots.write_spots(spots, folder, courses=histories)
    files = (*courses, *files)
    keys |= stress_spots.spot_keys(spots)
    keep(keys)
    if scene.life is None:
        return Afterwards(keys, bodies, stress, spots, files=files)
    with watch("life"):
        life = lives.lives(done, bodies, done.strike, progress)
        on_spring = replace(done.strike, touches=baseline.touches, stress=baseline.stress)
        life_at_spring = lives.lives(done, [reed], on_spring, progress)
        keys |= lives.run_keys(scene.life, bodies, life, life_at_spring)
        if plate is not None and math.isfinite(bar := margin_bars.margin_bar(done, plate, life, progress)):
            keys |= {f"error_bar_{LifeMargin.key}": bar}
    if life.below is not None and life.below.worst.tensor_at:
        contact_bar = stresses.contact_margin_bar(done, life.below.worst.tensor_margin)
        keys |= {"error_bar_life_contact_margin": finite_or_none(contact_bar)}
    keep(keys)
    with watch("life curves"):
        price = done.spent.get("contact", 0.0) + watch.stages["life"] / 2
        curves = lives.life_curves(done, bodies, price=price, tell=tell)
        written = lives.write_curves(curves, folder)
    keys |= lives.curve_keys(curves)
    keep(keys)
    return Afterwards(keys, bodies, stress, spots, life, curves, (*files, *written))


def reed_front_keys(done: Round, stress: ReedStress | None) -> dict[str, object]:
    """Return the reed's largest stress after the first touch over rho c_0 v (0.8445 for a wave front in a slender
    beam's free end); empty where no stress is known, ``None`` without a closing speed."""
    if stress is None or stress.after_contact is None:
        return {}
    face = done.plan.scene.reed.face
    front = summary.front_of(done.result, face.young, face.density)
    return {"peak_reed_stress_over_rho_c0_v": None if math.isnan(front) else stress.after_contact.value / front}


def plate_stress_keys(stress: PlateStress) -> dict[str, object]:
    """Return for summary.json the stress of a plate, under the keys of a beam's stress, and its error bars."""
    bar, landing = finite_or_none(stress.bar), stress.largest.after_landing
    of_landing = {} if landing is None else {"landing_peak_reed_stress_Pa": landing.value}
    bars = {f"error_bar_{key}": bar for key in ("peak_reed_stress_after_contact_Pa", *of_landing)}
    return {**summary.reed_stress_keys(stress.largest), **of_landing, **bars}
