"""Simpler models of a contact: without its film, and along a lip one port in place of the arcs, and a beam in place of
the plate."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Final

import numpy as np

import impact
from impact import measures
from impact.greens.base import GreensFunction
from seatfem.structures.kinds.structure import in_role
from seatfem.structures.rings import Division, as_a_whole
from seatfem.study.impacts.contact import run_contacts
from seatfem.study.impacts.touches import Touches
from seatfem.study.scene import Scene

ONE_PORT: Final = "one_port"
BEAM: Final = "beam"
WITHOUT_FILM: Final = "without_film"


def simpler_models(scene: Scene, striker: impact.Body, seat: GreensFunction, dt: float) -> dict[str, Touches]:
    """Return the same impact by simpler models, by name; none where the contact is not along a lip and has no film.

    `WITHOUT_FILM`: the same without the film in the gap. The others are of one contact: both strike the mean of the
    seat's lip, over the mean of the gap along it. `ONE_PORT`: the same plate, by the mean of its motion along the lip.
    `BEAM`: what stands for the plate as a beam, where it knows one; none under the loads and with the stopper of a
    scene.
    """
    division, results = Division.of(seat), {}
    if scene.contact.film is not None:
        contact = scene.contact.model_copy(update={"film": None})
        results[WITHOUT_FILM] = run_contacts(scene.model_copy(update={"contact": contact}), striker, seat, dt)
    if division.arcs > 1:
        for name, body in simpler_bodies(scene, striker, division):
            results[name] = run_contacts(scene, body, as_a_whole(seat), dt)
    return results


def simpler_keys(found: Mapping[str, Touches], filter_width: float) -> dict[str, object]:
    """Return for summary.json, of each model: NAME_impulse_Ns and NAME_filtered_peak_force_N."""
    keys: dict[str, object] = {}
    for name, touches in found.items():
        keys[f"{name}_impulse_Ns"] = measures.impulse(touches.seat)
        keys[f"{name}_filtered_peak_force_N"] = measures.filtered_peak_force(touches.seat, filter_width)
    return keys


def simpler_bodies(scene: Scene, striker: impact.Body, division: Division) -> Iterator[tuple[str, impact.Body]]:
    """Yield by name what strikes in place of ``striker``, whose lip is divided."""
    greens = striker.greens
    if set(division.names) <= set(greens.ports):
        weights = np.zeros((len(greens.ports), 1))
        for name, share in zip(division.names, division.shares, strict=True):
            weights[greens.port_index(name)] = share
        yield ONE_PORT, replace(striker, greens=greens.combined(weights, ("contact",)))
    if scene.load or scene.base or scene.spring or scene.gas is not None or scene.stopper is not None:
        return
    with in_role("reed", scene.reed):
        plate = scene.reed.thin_plate
        beam = None if plate is None else plate.as_a_beam(greens)
    if beam is not None:
        yield BEAM, beam
