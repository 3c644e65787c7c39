"""Post-processing after the last round of a run: spring baseline, stress of the bodies, and assessments by wings."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

import impact
from impact.after.histories import UNKNOWN_STRESS, ReedStress
from impact.after.result import ImpactResult
from impact.greens.base import GreensFunction
from impact.greens.modal import ModalGreens, Residual
from impact.march.problem import ContactProblem
from impact.notices import Progress, Tell
from impact.quantities import finite_or_none, percent
from impact.runs.variations import ROUND_OFF, SAFETY, Budget, Values, Variation, budget_of
from seatfem.machine.resources import Stopwatch
from seatfem.structures import method, rings
from seatfem.study.impacts import contact, validity
from seatfem.study.impacts.bodies import problem_of
from seatfem.study.impacts.contact import RunError, record_of, run_contacts
from seatfem.study.impacts.forces import Strike
from seatfem.study.impacts.touches import RECORD, RunRecord, Touches, contact_record_of, stress_since, values_of_record
from seatfem.study.ladders.mesh import OF_DRAWS
from seatfem.study.plan import Plan
from seatfem.study.runs import horizon, kept, seat_stress, stress_spots, stress_wave, stresses, summary
from seatfem.study.runs.body_stress import BodyStress, ClosedFormStress
from seatfem.study.runs.round import Round
from seatfem.study.scene import Accuracy
from seatfem.study.scene.measures import Measure, Stress, all_measures
from seatfem.study.scene.wings import Assessed

if TYPE_CHECKING:
    from seatfem.pictures import rendering
    from seatfem.study.runs.reed_stress import PlateStress
    from seatfem.study.runs.seat_stress import SeatStress


@dataclass(frozen=True)
class Baseline:
    """The run on a spring of the seat's static stiffness, to compare with the run ``beside``, and what ``simpler``
    models of the seat give, by keys of summary.json. ``budget``, ``stiffness_bar``: errors of its measures and of the
    stiffness [N/m] if the seat is a measured record, else none and nan."""

    beside: ImpactResult
    stiffness: float
    touches: Touches
    stress: ReedStress
    simpler: Mapping[str, object]
    budget: Budget = field(default_factory=lambda: Budget({}))
    stiffness_bar: float = math.nan

    @property
    def result(self) -> ImpactResult:
        """Return the impact on the spring."""
        return self.touches.seat


def baseline_of(done: Round, watch: Stopwatch) -> Baseline:
    """Return the spring baseline of a round, which is the round's own run if its seat is a spring. Raises as
    `static_stiffness`."""
    scene = done.plan.scene
    stiffness = static_stiffness(done.seat.greens, scene.seat.endless_stiffness)
    with watch("spring baseline"):
        spring = spring_for(done.seat.greens, stiffness)
        same = is_spring(done.seat.greens, spring)
        touches = (
            done.touches if same else run_contacts(scene, done.striker, spring, done.result.dt, flights=done.flights)
        )
    stress = UNKNOWN_STRESS
    if same:
        stress = done.stress
    elif done.stress.is_known:
        with watch("reed stress"):
            strike, since = replace(done.strike, touches=touches), stress_since(touches, scene.accuracy.landing)
            if done.plate is None:
                stress = strike.largest_stress(coarsely=not scene.needs_stress, since=since)
            else:
                stress = done.plate.largest_in(strike, since)
    if not same and not scene.assessments:
        touches = replace(touches, parts=None)  # long histories of many parts, of which the line keeps the forces
    simpler: Mapping[str, object] = {}
    if done.touches.line is not None or scene.contact.film is not None:
        with watch("simpler models"):
            models = validity.simpler_models(scene, done.striker, done.seat.greens, done.result.dt)
            simpler = validity.simpler_keys(models, scene.run.filter_width)
            del models
    errors, bar = Budget({}), math.nan
    if draws := scene.seat.other_fits():
        with watch("spring baseline"):
            others = [static_stiffness(draw) for draw in draws]
            springs = [spring_for(*each) for each in zip(draws, others, strict=True)]
            errors = _record_errors(done, touches, stress, spring, springs)
            bar = SAFETY * OF_DRAWS * max(abs(other - stiffness) for other in others)
    return Baseline(done.result, stiffness, touches, stress, simpler, errors, bar)


def spring_for(seat: GreensFunction, stiffness: float) -> ModalGreens:
    """Return the baseline of a seat: a spring of this ``stiffness`` [N/m], or one for each part of its lip; of a free
    seat, without stiffness, the same body without vibrations: its rigid motion, and the compliance of its modes."""
    if stiffness == 0:
        modal = ModalGreens.from_hz([0.0], 0.0, [[seat.mass() ** -0.5]]) if seat.modal is None else seat.modal
        moves = modal.omega == 0
        vibrates = modal.shapes[~moves] / modal.omega[~moves, None]
        compliance = Residual.spring(vibrates.T @ vibrates + modal.residual.static())
        return replace(
            modal, omega=modal.omega[moves], zeta=modal.zeta[moves], shapes=modal.shapes[moves], residual=compliance
        )
    division = rings.Division.from_greens(seat)
    return method.bed(division, stiffness) if division.arcs > 1 else impact.spring(stiffness=stiffness)


def is_spring(seat: GreensFunction, spring: ModalGreens) -> bool:
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
    done: Round, touches: Touches, stress: ReedStress, spring: ModalGreens, others: Sequence[ModalGreens]
) -> Budget:
    """Return the baseline's errors by time step and by noise of the record, the latter from the baselines of draws."""
    scene, width = done.plan.scene, done.plan.scene.run.filter_width

    def problem(value: ModalGreens) -> ContactProblem:
        return problem_of(scene, done.striker, impact.Body(value))

    def run(varied: ContactProblem, dt: float) -> Values:
        return values_of_record(record_of(scene, varied, dt, like=touches.landings, look=done.look), touches.landings)

    own = problem(spring)
    record = contact_record_of(touches, width, stress, scene.accuracy.landing)
    values = values_of_record(RunRecord(record, touches.landings, touches.stopper_force), touches.landings)
    draws = tuple(Variation(problem(other), OF_DRAWS) for other in others)
    return budget_of(run, own, values, touches.seat.dt, {RECORD: (draws,)}, filter_width=width)


def static_stiffness(greens: GreensFunction, endless: float = 0.0) -> float:
    """Return the static stiffness of the struck patch [N/m]; of an endless body, its ``endless`` one, if not 0; 0 of a
    body that is free to move. Raises `RunError` for samples without a rest."""
    compliance = rings.face_compliance(greens)
    if endless and np.isinf(compliance) and math.isinf(greens.mass()):
        return endless
    if np.isinf(compliance) and 0 < greens.mass() < math.inf:
        return 0.0
    if not np.isfinite(compliance) or compliance <= 0:
        raise RunError(
            "the seat has no static stiffness (it is sampled without a rest), so there is no spring to compare with; "
            "hold the seat somewhere, or state seat.free for a record"
        )
    return 1.0 / compliance


@dataclass(frozen=True)
class Afterwards:
    """Attributes:
    keys: entries of summary.json.
    bodies: stress of the bodies.
    stress: stress in the seat, if the scene has [stress].
    spots: hot spots of both bodies.
    assessed: results of the scene's assessments.
    files: files that were written."""

    keys: Mapping[str, object] = field(default_factory=dict)
    bodies: tuple[BodyStress, ...] = ()
    stress: SeatStress | None = None
    spots: stress_spots.Spots = field(default_factory=lambda: stress_spots.Spots())
    assessed: tuple[Assessed, ...] = ()
    files: tuple[Path, ...] = ()

    def pictures(self, done: Round) -> list[rendering.Picture]:
        """Return the pictures of stress and assessments."""
        title = done.plan.scene.title
        of_seat: list[rendering.Picture] = []
        waves: list[rendering.Picture] = []
        if self.stress is not None:
            of_seat = stress_wave.peak_pictures(self.stress, title or "Stress in the seat")
            waves = stress_wave.wave_pictures(done, self.bodies)
        return [
            *of_seat,
            *stress_spots.spot_pictures(self.spots, done.touch, f"{title or 'Stress'}: histories at the hot spots"),
            *waves,
            *(picture for each in self.assessed for picture in each.pictures()),
        ]

    def notes(self, plan: Plan) -> tuple[str, ...]:
        """Return notes on stress, drives and assessments for the reader of the run."""
        scene = plan.scene
        return (
            *self.bars_missed(scene.accuracy),
            *(() if self.stress is None else stresses.stress_notes(plan, self.stress)),
            *(note for each in scene.driven_by for note in each.notes()),
            *(note for each in self.assessed for note in each.notes),
        )

    def bars_missed(self, accuracy: Accuracy) -> tuple[str, ...]:
        """Return a sentence for each measure that rounds judge by another and whose own error bar misses the target."""
        measures = (each for name, each in all_measures().items() if name in accuracy.measures and each.judged_by)
        return tuple(filter(None, (self._bar_missed(each, accuracy.target) for each in measures)))

    def _bar_missed(self, measure: Measure, target: float) -> str:
        value, bar = (self.keys.get(f"{prefix}{measure.key}") for prefix in ("", "error_bar_"))
        if not isinstance(value, float):
            return ""
        relative = bar / value if isinstance(bar, float) and value else math.inf
        if relative <= target:
            return ""
        known = f"an uncertainty of {percent(relative)}" if math.isfinite(relative) else "no known uncertainty"
        return (
            f"{measure.words} ({measure.key}) has {known}, above accuracy.target = {percent(target)}: rounds refine "
            "the largest stress in its place"
        )


@dataclass(frozen=True)
class FinishedRun:
    """The last round of a run, as assessments use it.

    Attributes:
        done: the round.
        bodies: stress of the bodies, the reed's first.
        on_spring: the run of the spring baseline.
        folder: where files are written.
        watch, progress, tell: receive the times of stages, their progress, and lines for the reader.
        keep: function that writes further keys to summary.json.
    """

    done: Round
    bodies: tuple[BodyStress, ...]
    on_spring: Strike
    folder: Path
    watch: Stopwatch
    progress: Progress
    tell: Tell
    keep: Callable[[Mapping[str, object]], None]


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
    """Compute strains, stress and the assessments of the last round.

    Args:
        histories: whether to write stress histories.
        keep: function called with all keys so far after each stage, which writes them to file.
    """
    scene, keys = done.plan.scene, dict[str, object]()
    if horizon.has_horizon(done):
        progress("predictable landings", 0.0)
        with watch("horizon"):
            compute = partial(horizon.horizon_keys, done, progress)
            keys |= kept.cached_numbers(done, done.touches, "horizon", compute)
        progress("predictable landings", 1.0)
    elif scene.run.ensemble is not None:
        keys |= horizon.NO_ENSEMBLE
    courses: tuple[Path, ...] = ()
    if scene.gauge:
        keys |= contact.gauge_values(done.touches.strains)
        courses = (contact.write_strains(folder, done.touches.strains, done.result.dt),)
        keep(keys)
    stress, plate = None, done.plate
    if scene.stress is not None or scene.assessments:
        with watch("reed stress" if scene.stress is None else "seat stress"):
            stress, plate = stresses.stresses(done, progress)
        keys |= seat_stress.stress_keys(stress) | ({} if done.plate or plate is None else plate_stress_keys(plate))
        keep(keys)
    keys |= reed_front_keys(done, done.stress if plate is None else plate.largest)
    bar = done.budget.relative(Stress.name) if done.budget.values.get(Stress.name, 0.0) > 0 else math.nan
    reed = ClosedFormStress(done.strike, bar) if plate is None else plate
    bodies: tuple[BodyStress, ...] = (reed,) if stress is None else (reed, stress)
    with watch("hot spots"):
        named = 0 if scene.stress is None else len(scene.stress.points)
        spots = stress_spots.Spots.from_bodies(bodies, done.result.time, named)
        files = stress_spots.write_spots(spots, folder, courses=histories)
    files = (*courses, *files)
    keys |= stress_spots.spot_keys(spots)
    keep(keys)
    on_spring = replace(done.strike, touches=baseline.touches, stress=baseline.stress)
    assessed: list[Assessed] = []

    def keep_more(more: Mapping[str, object]) -> None:
        keep({**keys, **more})

    run = FinishedRun(done, bodies, on_spring, folder, watch, progress, tell, keep_more)
    for each in scene.assessments:
        assessed.append(each.assess(run))
        keys |= assessed[-1].keys
        keep(keys)
    files = (*files, *(file for each in assessed for file in each.files))
    return Afterwards(keys, bodies, stress, spots, tuple(assessed), files)


def reed_front_keys(done: Round, stress: ReedStress) -> dict[str, object]:
    """Return the reed's largest stress after the first touch over rho c_0 v (0.8445 for a wave front in a slender
    beam's free end); empty where no stress is known, ``None`` without a closing speed."""
    if not stress.after_contact.is_known:
        return {}
    front = summary.front_of(done.result, *done.plan.scene.reed.front)
    return {"peak_reed_stress_over_rho_c0_v": None if math.isnan(front) else stress.after_contact.value / front}


def plate_stress_keys(stress: PlateStress) -> dict[str, object]:
    """Return for summary.json the stress of a plate, under the keys of a beam's stress, and its error bars."""
    bar, landing = finite_or_none(stress.bar), stress.largest.after_landing
    of_landing = {} if not landing.is_known else {"landing_peak_reed_stress_Pa": landing.value}
    bars = {f"error_bar_{key}": bar for key in ("peak_reed_stress_after_contact_Pa", *of_landing)}
    return {**summary.reed_stress_keys(stress.largest), **of_landing, **bars}
