"""What is looked at once the last round of a run is done: gas masses, stress in both bodies, their life, curves."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from impact.after.stresses import ReedStress
from impact.progress import Progress, Tell
from impact.quantities import percent
from seatfem.machine.stopwatch import Stopwatch
from seatfem.pictures.apart import Picture
from seatfem.study.impacts.gas import gas_notes
from seatfem.study.impacts.life import Lasting, life_notes
from seatfem.study.planning.plan import Plan
from seatfem.study.runs.baseline import Baseline
from seatfem.study.runs.gas_bars import gas_bars
from seatfem.study.runs.left_in import contact_margin_bar
from seatfem.study.runs.life_curves import MarginCurve, curve_keys, curve_pictures, life_curves, write_curves
from seatfem.study.runs.lives import Stressed, lives, run_keys
from seatfem.study.runs.margin_map import margin_pictures
from seatfem.study.runs.reed_stress import PlateReedStress
from seatfem.study.runs.round import Round
from seatfem.study.runs.seat_stress import SeatStress, stress_keys, stress_pictures
from seatfem.study.runs.stress_spots import Spots, spot_keys, spot_pictures, write_spots
from seatfem.study.runs.stress_wave import after_touch, wave_pictures
from seatfem.study.runs.stresses import stress_notes, stresses
from seatfem.study.runs.summary import front_of, reed_stress_keys
from seatfem.study.scene import Scene
from seatfem.study.scene.measures import LifeMargin


@dataclass(frozen=True)
class Afterwards:
    """Attributes:
    keys: for summary.json.
    stress: in the seat, where it is asked for.
    spots: of the largest stress in both bodies.
    stressed: what the life of both bodies is found from, where it is asked for.
    life: of the bodies.
    curves: of margins.
    files: that were written.
    """

    keys: Mapping[str, object] = field(default_factory=dict)
    stress: SeatStress | None = None
    spots: Spots = field(default_factory=Spots)
    stressed: Stressed | None = None
    life: Lasting = field(default_factory=Lasting)
    curves: tuple[MarginCurve, ...] = ()
    files: tuple[Path, ...] = ()

    def pictures(self, done: Round) -> list[Picture]:
        """Of all of it."""
        return [
            *stress_pictures(self.stress, done.plan.scene.title or "Stress in the seat", after_touch(done)),
            *spot_pictures(done, self.spots),
            *wave_pictures(done, self.stress),
            *margin_pictures(done, self.stressed),
            *curve_pictures(self.curves),
        ]

    def notes(self, plan: Plan) -> tuple[str, ...]:
        """Return what a reader must be told of the run of this plan."""
        scene = plan.scene
        return (
            *self.margin_missed(scene),
            *stress_notes(plan, self.stress),
            *gas_notes(scene),
            *life_notes(scene, self.life),
        )

    def margin_missed(self, scene: Scene) -> tuple[str, ...]:
        """Return a sentence where the margin over the design life was asked for and its error bar misses the target."""
        margin, bar = (self.keys.get(f"{prefix}{LifeMargin.key}") for prefix in ("", "error_bar_"))
        target = scene.accuracy.target
        if LifeMargin.name not in scene.accuracy.measures or not isinstance(margin, float):
            return ()
        relative = bar / margin if isinstance(bar, float) and margin else math.inf
        if relative <= target:
            return ()
        known = f"an uncertainty of {percent(relative)}" if math.isfinite(relative) else "no known uncertainty"
        return (
            f"{LifeMargin.words} ({LifeMargin.key}) has {known}, above accuracy.target = {percent(target)}: it has "
            "that of the stress where it is least",
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
    """Of the last round.

    Args:
        histories: whether those of stress are written.
        keep: is handed all keys so far after each stage, to be on file before the next.
    """
    scene, keys = done.plan.scene, dict[str, object]()
    if scene.gas is not None:
        with watch("gas bars"):
            keys |= gas_bars(done)
        keep(keys)
    stress, of_reed = None, done.plate
    if scene.stress is not None or scene.life is not None:
        with watch("reed stress" if scene.stress is None else "seat stress"):
            stress, of_reed = stresses(done, progress)
        keys |= stress_keys(stress) | ({} if done.plate else plate_stress_keys(of_reed))
        keep(keys)
    keys |= reed_front_keys(done, done.stress if of_reed is None else of_reed.found)
    plate = None if of_reed is None else of_reed.peaks
    with watch("hot spots"):
        spots = Spots.of(done, stress, plate)
        files = write_spots(spots, folder, courses=histories)
    keys |= spot_keys(spots)
    keep(keys)
    if scene.life is None:
        return Afterwards(keys, stress, spots, files=files)
    with watch("life"):
        stressed = Stressed.of(done, stress, plate, of_reed)
        here = lives(done, stressed, done.touches, done.stress, progress)
        there = lives(done, stressed, baseline.touches, baseline.stress, progress, with_seat=False)
    keys |= run_keys(done, stressed, here, there)
    if here.below is not None and here.below[0].tensor_margin is not None:
        bar = contact_margin_bar(done, here.below[0].tensor_margin)
        keys |= {"error_bar_life_contact_margin": bar if math.isfinite(bar) else None}
    keep(keys)
    with watch("life curves"):
        price = done.spent.get("contact", 0.0) + watch.stages["life"] / 2
        curves = life_curves(done, stressed, price=price, tell=tell)
        written = write_curves(curves, folder)
    keys |= curve_keys(curves)
    keep(keys)
    return Afterwards(keys, stress, spots, stressed, here, curves, (*files, *written))


def reed_front_keys(done: Round, found: ReedStress | None) -> dict[str, object]:
    """The largest stress after the first touch over rho c_0 v of the reed, which a front in a slender beam's free end
    bears 0.8445 of; nothing where it bears no stress that is known, ``None`` without a closing speed."""
    if found is None or found.after_contact is None:
        return {}
    face = done.plan.scene.reed.face
    front = front_of(done.result, face.young, face.density)
    return {"peak_reed_stress_over_rho_c0_v": None if math.isnan(front) else found.after_contact.value / front}


def plate_stress_keys(stress: PlateReedStress | None) -> dict[str, object]:
    """For summary.json: the keys that a beam's stress has, and the error bar."""
    if stress is None:
        return {}
    bar = None if math.isnan(stress.bar) else stress.bar
    landing = stress.found.after_landing
    of_landing = {} if landing is None else {"landing_peak_reed_stress_Pa": landing.value}
    bars = {f"error_bar_{key}": bar for key in ("peak_reed_stress_after_contact_Pa", *of_landing)}
    return {**reed_stress_keys(stress.found), **of_landing, **bars}
