"""Fatigue maps: cycles and damage of many points, Crossland's criterion, the mean over planes."""

from __future__ import annotations

import resource
from collections.abc import Callable, Iterator
from time import process_time

import numpy as np
from rainflow import extract_cycles
from table import Table, best, publish

from impact.life.curves import basquin
from impact.life.cycles import from_peak, rainflow
from impact.life.damage import damage
from impact.life.maps import SHARE, cycle_map, margin_map
from impact.life.mean_stress import Goodman
from impact.life.multiaxial import Crossland, DangVan, Papadopoulos
from impact.life.strength import Strength

POINTS, SAMPLES, BLOCK, MODES = 20_000, 200_000, 64, 12
INVENTED = Strength("invented for this benchmark", ultimate=1.8e9, curve=basquin(400e6, 1e7, 12.0))


def ringing() -> tuple[np.ndarray, np.ndarray]:
    """(P, modes) and (modes, n): histories as a reed's, sums of modes that ring down after a blow [Pa]."""
    random = np.random.default_rng(1)
    time = np.linspace(0, 1, SAMPLES)
    turns = 10 * (1 + np.arange(MODES)) ** 1.7
    shapes = 1e8 * random.normal(size=(POINTS, MODES)) / (1 + np.arange(MODES))
    return shapes, np.exp(-5 * time) * np.sin(2 * np.pi * turns[:, None] * time)


def mapped(what: str, block: Callable[[int], np.ndarray], share: float) -> tuple[str, ...]:
    """One row: all points, less the time that making their histories takes."""
    judge, making = Goodman(1.8e9), 0.0

    def blocks() -> Iterator[np.ndarray]:
        nonlocal making
        for first in range(0, POINTS, BLOCK):
            start = process_time()
            made = block(first)
            making += process_time() - start
            yield made[: POINTS - first]

    start = process_time()
    found = cycle_map(blocks(), lambda cycles: damage(cycles, INVENTED, judge), share)
    seconds = process_time() - start - making
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20
    title = f"{what}: cycles and damage, from {share:.0%} of the largest range"
    return title, f"{seconds:.1f} s", f"{found.skipped} of {len(found.values)} skipped; peak {peak:.2f} GiB"


def main() -> None:
    """One core."""
    shapes, courses = ringing()
    noises = 1e8 * np.random.default_rng(2).normal(size=(BLOCK, SAMPLES))
    rainflow(noises[0])
    noise = from_peak(noises[0])
    rows = [mapped("ringing", lambda first: shapes[first : first + BLOCK] @ courses, share) for share in (SHARE, 0.0)]
    rows.append(mapped("white noise", lambda first: noises, 0.0))
    ours = best(lambda: rainflow(noise), 3)
    theirs = best(lambda: list(extract_cycles(noise)), 1)
    what = f"cycles of one history of {len(noise)} turning points"
    rows.append((what, f"{ours * 1e3:.1f} ms", f"the package {theirs * 1e3:.0f} ms"))
    cycles, judge = rainflow(noise), Goodman(1.8e9)
    rows.append(
        ("their damage", f"{best(lambda: damage(cycles, INVENTED, judge), 3) * 1e3:.1f} ms", "Goodman, two slopes")
    )
    tensors = np.stack([shapes[k : k + 6] @ courses for k in range(4)]).transpose(0, 2, 1)
    for kind in (Crossland, DangVan):
        of_axes = kind(310e6, 500e6)
        of_axes.value(tensors[0])
        each = best(lambda j=of_axes: margin_map([tensors], j), 3) / len(tensors)
        rows.append((f"{kind.name}, one point of {SAMPLES} tensors", f"{each * 1e3:.1f} ms", "exact sphere"))
    for tolerance in (1e-3, 1e-4):
        of_planes = Papadopoulos(310e6, 500e6, tolerance)
        of_planes.value(tensors[0][:10])
        seconds = best(lambda j=of_planes: j.value(tensors[0]), 1)
        rows.append((f"papadopoulos, one point of {SAMPLES} tensors", f"{seconds:.1f} s", f"tolerance {tolerance:g}"))
    notes = (
        f"{POINTS} points of {SAMPLES} samples, {BLOCK} points at a time, "
        "processor time of one core; making histories not counted.",
        f"Ringing: {MODES} modes that decay, each point with its own sum. Aims: less than 120 s and 1 GiB.",
    )
    publish("life", Table("Fatigue maps", notes, ("what", "time", "besides"), tuple(rows)))


if __name__ == "__main__":
    main()
