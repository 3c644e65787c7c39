"""Where the theory or the data behind a scene end: large deflections, filters beyond a measured band, stoppers."""

from __future__ import annotations

from typing import Final

from impact.advice import Advice
from impact.after.measures import film_force_peak
from impact.after.result import ImpactResult
from impact.greens.base import GreensFunction
from seatfem.study.scene import Scene
from seatfem.units import write_quantity

THICKEST_GAS: Final = 1e-4
"""Viscosity [Pa s] above which a fluid is a liquid."""


def validity_advice(
    scene: Scene, seat: GreensFunction | None = None, reed: GreensFunction | None = None
) -> tuple[Advice, ...]:
    """What the run answers beyond the limits of its theory or of its data."""
    found = list(scene.reed.limits())
    for role, greens in (("seat", seat), ("reed", reed)):
        band = None if greens is None else _measured_band(greens)
        if band is None or scene.run.filter_width >= 1 / band:
            continue
        found.append(
            Advice(
                "1/run.filter_width over the measured band",
                1 / (scene.run.filter_width * band),
                1.0,
                f"the {role} was measured up to {write_quantity(band, 'frequency', 4)}; what a filter of "
                f"{write_quantity(scene.run.filter_width, 'time', 3)} passes "
                "beyond is a guess, and no bar knows",
                f"use run.filter_width >= {write_quantity(1 / band, 'time', 3)}, or measure further",
            )
        )
    return tuple(found)


def film_notes(scene: Scene, result: ImpactResult) -> tuple[str, ...]:
    """That a gas would give way under the largest force of its film."""
    if (keys := scene.contact.film) is None or keys.viscosity > THICKEST_GAS:
        return ()
    film = keys.of(scene.seat.struck_ring)
    bars = film_force_peak(result) / film.tension * keys.tension_limit / 1e5
    if bars <= 1:
        return ()
    return (
        f"contact.film: its mean pressure reaches {bars:.3g} bar. A gas, as viscosity = {keys.viscosity:g} Pa s says, "
        "would be compressed: the film's force is an upper bound, and the truth lies between this run and the one "
        "without the film (without_film_ in summary.json)",
    )


def stopper_notes(scene: Scene) -> tuple[str, ...]:
    """That no plan looks at a stopper that is computed or read."""
    if scene.stopper is None or not scene.stopper.body.is_solved:
        return ()
    return (
        f"the stopper (kind {scene.stopper.body.kind!r}) is taken as its keys state it: what it is off by is in the "
        "error bars of a run, but neither that nor what it takes is in the predictions of a plan",
    )


def _measured_band(seat: GreensFunction) -> float | None:
    """Highest line of a fit to measured responses [Hz]."""
    fit = seat.provenance.get("fit")
    band = fit.get("band_hz") if isinstance(fit, dict) else None
    return float(band[1]) if isinstance(band, list | tuple) and len(band) == 2 else None
