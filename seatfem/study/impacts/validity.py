"""Limits of the theory and of the data of a scene, and simpler models of its contact."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Final

import numpy as np

import impact
from impact import measures, notices, quantities
from impact.after.measures import film_force_peak
from impact.after.result import ImpactResult
from impact.greens.base import GreensFunction
from seatfem.structures.fits import fit_of
from seatfem.structures.kinds import Structure
from seatfem.structures.rings import Division, join_all_parts
from seatfem.study.impacts.contact import run_contacts
from seatfem.study.impacts.touches import Touches
from seatfem.study.scene import ContactGeometry, Scene
from seatfem.study.scene.contact import Stopper
from seatfem.study.scene.drives import ExternalLoad
from seatfem.study.scene.models import SAMPLES
from seatfem.study.scene.problems import rewrite_errors
from seatfem.units import write_quantity

THICKEST_GAS: Final = 1e-4
"""Viscosity [Pa s] above which a fluid is a liquid."""


def validity_advice(
    geometry: ContactGeometry,
    filter_width: float,
    seat: GreensFunction | None = None,
    reed: GreensFunction | None = None,
) -> tuple[notices.Advice, ...]:
    """Return advice if the run exceeds limits of its theory or data; ``filter_width``: averaging time [s]."""
    misfits, bands = list[notices.Advice](), list[notices.Advice]()
    for role, body, greens in (("seat", geometry.seat, seat), ("reed", geometry.reed, reed)):
        if greens is None:
            continue
        band = fit_of(greens).highest
        misfits += body.fit_advice(role, greens)
        if band is None or filter_width >= 1 / band:
            continue
        passed, least = (write_quantity(width, "time", 3) for width in (filter_width, 1 / band))
        bands.append(
            notices.Advice(
                "1/run.filter_width over the measured band",
                1 / (filter_width * band),
                1.0,
                f"the {role} was measured up to {write_quantity(band, 'frequency', 4)}; a filter of {passed} passes "
                "higher frequencies, which are guessed and not part of the uncertainty",
                f"use run.filter_width >= {least}, or measure to higher frequencies",
            )
        )
    return (*geometry.reed.limits(), *misfits, *bands)


def film_notes(geometry: ContactGeometry, result: ImpactResult) -> tuple[str, ...]:
    """Return a note if the gas of the film would be compressed under its largest force."""
    if (keys := geometry.contact.film) is None or keys.viscosity > THICKEST_GAS:
        return ()
    film = keys.build_film(geometry.seat.lip_face.ring)
    bars = film_force_peak(result) / film.tension * keys.tension_limit / 1e5
    if bars <= 1:
        return ()
    return (
        f"contact.film: its mean pressure reaches {bars:.3g} bar. A gas, as viscosity = {keys.viscosity:g} Pa s says, "
        "would be compressed: the film's force is an upper bound, and the truth lies between this run and the one "
        "without the film (without_film_ in summary.json)",
    )


def dishing_notes(reed: Structure, seat: Structure, loads: Sequence[ExternalLoad], duration: float) -> tuple[str, ...]:
    """Return a note that a beam model lacks the dishing of the reed over a round port under a closing pressure.

    The stress that it estimates is 3 p r^2/(4 t^2) with a clamped edge, 3 (3 + nu) p r^2/(8 t^2) with a simply
    supported one: Timoshenko, Theory of Plates and Shells, section 16. ``duration``: of the run [s].
    """
    time = np.linspace(0.0, duration, SAMPLES)
    thickness, material = getattr(reed, "thickness", None), getattr(reed, "material", None)
    if reed.traits.stress != "closed form" or thickness is None or material is None or seat.files():
        return ()
    closing = max((-float(each.pressure.course(time).min()) for each in loads if each.pressure), default=0.0)
    loops = seat.views(coarse=True).contact
    if closing <= 0 or len(loops) < 2:
        return ()
    radius = min(float(np.hypot(*loop.T).max()) for loop in loops)
    unit = closing * (radius / thickness) ** 2
    clamped, turning = (quantities.text(share * unit, "Pa", 2) for share in (3 / 4, 3 * (3 + material.poisson) / 8))
    port, pressure = write_quantity(2 * radius, "length", 3), write_quantity(closing, "pressure", 2)
    return (
        f"stress and margin leave out that the closed reed dishes under {pressure} over a port of {port}: a beam model "
        f"lacks these {clamped} to {turning} (round plate, edge clamped or free to turn)",
    )


def stopper_notes(stopper: Stopper | None) -> tuple[str, ...]:
    """Return a note that no round refines the body of a stopper that is solved or read."""
    if stopper is None or not stopper.body.traits.is_solved:
        return ()
    words = (
        f"the stopper (kind {stopper.body.kind!r}) is computed as its keys state it, but for the parts of its face: a "
        "run's uncertainty includes its error, which no round reduces"
    )
    if stopper.profile is not None:
        words += "; that its face bends along the reed is not modelled, and not part of the uncertainty"
    return (words,)


ONE_PORT: Final = "one_port"
BEAM: Final = "beam"
WITHOUT_FILM: Final = "without_film"


def simpler_models(scene: Scene, striker: impact.Body, seat: GreensFunction, dt: float) -> dict[str, Touches]:
    """Return the run of the scene by simpler models, by name; none without a lip in arcs and without a film.

    `WITHOUT_FILM`: without the film in the gap. The others have one contact, with the mean displacement of the seat's
    lip and the mean gap. `ONE_PORT`: the same plate, with its mean displacement along the lip. `BEAM`: a beam in place
    of the plate, where there is an equivalent one and the scene has no loads and no stopper.
    """
    division, results = Division.from_greens(seat), {}
    if scene.contact.film is not None:
        contact = scene.contact.model_copy(update={"film": None})
        results[WITHOUT_FILM] = run_contacts(scene.model_copy(update={"contact": contact}), striker, seat, dt)
    if division.arcs > 1:
        for name, body in simpler_bodies(scene, striker, division):
            results[name] = run_contacts(scene, body, join_all_parts(seat), dt)
    return results


def simpler_keys(results: Mapping[str, Touches], filter_width: float) -> dict[str, object]:
    """Return NAME_impulse_Ns and NAME_filtered_peak_force_N of each simpler model for summary.json."""
    keys: dict[str, object] = {}
    for name, touches in results.items():
        keys[f"{name}_impulse_Ns"] = measures.impulse(touches.seat)
        keys[f"{name}_filtered_peak_force_N"] = measures.filtered_peak_force(touches.seat, filter_width)
    return keys


def simpler_bodies(scene: Scene, striker: impact.Body, division: Division) -> Iterator[tuple[str, impact.Body]]:
    """Yield simpler bodies in place of a ``striker`` with a divided lip, by name."""
    greens = striker.greens
    if set(division.names) <= set(greens.ports):
        weights = np.zeros((len(greens.ports), 1))
        for name, share in zip(division.names, division.shares, strict=True):
            weights[greens.port_index(name)] = share
        yield ONE_PORT, replace(striker, greens=greens.combined(weights, ("contact",)))
    if scene.load or scene.base or scene.spring or scene.driven_by or scene.stopper is not None:
        return
    with rewrite_errors("reed", scene.reed):
        beams = scene.reed.as_beams(greens)
    yield from ((BEAM, beam) for beam in beams)
