"""Strain at the gauges of a scene and the force of its valve springs, from the contact forces of a run."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Final

import numpy as np

from impact.after.loads import spring_displacements, without_springs
from impact.bodies.body import Body
from impact.bodies.loads import SprungBody
from impact.files import csv_table
from impact.greens.base import Array, GreensFunction
from impact.march.stepper import with_recorded_loads
from impact.runs.variations import Values
from seatfem.study.impacts.gas import lift_of
from seatfem.study.impacts.touches import Touches, on_the_ports, pushes
from seatfem.study.scene import ContactGeometry, drives
from seatfem.study.scene.waves import Gauged

FILE: Final = "gauges.csv"
Strains = Mapping[str, Array]
"""The (n + 1,) strain of each gauge by its name, > 0 in tension, in the middle of the step that ends at each time."""


def gauge_strains(
    gauged: Sequence[Gauged], striker: Body, force: Array, stopper: Array | None, dt: float, opening: Array
) -> Strains:
    """Return the strain at gauges in a run, from the forces (n + 1,) of the seat's contact and of the stopper's, if
    there is one [N], and the mean opening (n + 1,) at the seat [m], at steps ``dt`` [s]."""
    if not gauged:
        return {}
    pushed = pushes(striker, force, stopper)
    marched = without_springs(with_recorded_loads(striker, opening, dt), pushed, dt)
    on = {"seat": force, "reed": pushed, "stopper": stopper}
    return {each.gauge.name: _strain(each, on[each.gauge.of], dt, marched) for each in gauged}


def _strain(gauged: Gauged, force: Array | None, dt: float, striker: Body) -> Array:
    gauge, body, wave = gauged.gauge, gauged.mount.structure, gauged.mount.wave
    assert force is not None
    strain = body.strain_at(gauge.at, force, dt, striker, gauged.contact_at)
    if wave is not None and (speed := body.wave_speed) is not None:
        middle = np.asarray(dt * (np.arange(len(strain)) - 0.5), dtype=np.float64)
        return np.asarray(strain + wave.incoming(speed).strain_at(middle, gauge.at))
    return strain


def gauge_values(strains: Strains) -> Values:
    """Return the largest and the smallest strain of each gauge, by their keys in summary.json."""
    ends = (("largest", np.max), ("smallest", np.min))
    return {f"gauge_{name}_{word}_strain": float(end(strain)) for name, strain in strains.items() for word, end in ends}


def write_strains(folder: Path, strains: Strains, dt: float) -> Path:
    """Write gauges.csv, the courses of all gauges, a row a step at the time of its middle; return its path."""
    columns: Sequence[Array] = list(strains.values())
    time = dt * (np.arange(1, len(columns[0])) - 0.5)
    heads = ["time [s]", *(f"{name} [m/m]" for name in strains)]
    csv_table.write_csv(folder / FILE, heads, np.column_stack([time, *(column[1:] for column in columns)]).tolist())
    return folder / FILE


def valve_spring_keys(
    springs: Sequence[drives.ValveSpring],
    geometry: ContactGeometry,
    striker: Body,
    seat: GreensFunction,
    touches: Touches,
) -> dict[str, object]:
    """Return the keys of the force of all valve springs together, towards the ``seat``: the largest one and that as the
    hardest landing begins; none where there are no such springs."""
    if not isinstance(striker, SprungBody):
        return {}
    dt = touches.seat.dt
    marched = with_recorded_loads(striker, lift_of(touches), dt)
    ports = on_the_ports(geometry, striker.greens, seat, touches)
    (moved,) = spring_displacements(marched, ports, dt, striker.springs.stiffness[:, None])
    force = np.asarray(sum(spring.force_on_undeformed(geometry.contact.gap) for spring in springs) + moved)
    hard = None if touches.landings is None else touches.landings.hardest
    return {
        "valve_spring_force_max_N": float(force.max()),
        "valve_spring_force_at_landing_N": hard and float(np.interp(hard.start, touches.seat.time, force)),
    }
