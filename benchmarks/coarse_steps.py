"""Whether the error bar of a step stated too long holds: rods, springs and reeds against steps that resolve the waves.

    python benchmarks/coarse_steps.py [--scenes 500] [--seed 2]

Steps of 0.03 to 30 transits of the rod's waves, 2 to 30 of them in the filter. For each rule of the time step's share,
the part of all measures whose true error is inside 1.5 times the share, as the bar has it.
"""

from __future__ import annotations

import argparse
import math
import tempfile
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np
from rich.console import Console

import impact
from impact.runs.budget import SAFETY, Values
from impact.runs.variations import FINE
from seatfem.study.impacts.contact import measures_of, problem_of, seat_of, striker_of, time_step
from seatfem.study.scene import Scene, load_scene

TRANSIT, SPEED, YOUNG, DENSITY, AREA = 1e-5, 5000.0, 2e11, 8000.0, 1e-6
LENGTH = TRANSIT * SPEED
STIFFNESS = YOUNG * AREA / LENGTH
BANDS = (0.0, 0.1, 1.0, 3.0, 10.0, math.inf)  # of the step over the transit
REED = """[reed]
kind = "cantilever"
length = "40 mm"
width = "8 mm"
thickness = "0.4 mm"
material = { young = "200 GPa", density = "7850 kg/m^3" }
n_modes = 6
release = { tip_deflection = "2 mm" }
"""


@dataclass(frozen=True)
class Sample:
    """One scene: its step, the step that the program would choose, and the measures by step."""

    dt: float
    auto: float
    steps_per_filter: float
    exact: Values
    at: Mapping[str, Values]

    def change(self, step: str, name: str) -> float:
        """Of a measure, from the step itself to another one."""
        return abs(self.at["h"][name] - self.at[step][name])


def main() -> None:
    """Draw, run, print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--scenes", type=int, default=500)
    parser.add_argument("--seed", type=int, default=2)
    given = parser.parse_args()
    rng = np.random.default_rng(given.seed)
    with tempfile.TemporaryDirectory() as folder:
        samples = [sample(scene) for scene in drawn(rng, given.scenes, Path(folder) / "scene.toml")]
    tell = Console(highlight=False, markup=False, width=200).print
    tell(f"{len(samples)} scenes; inside the bar, and the largest excess over the value:")
    for low, high in pairwise(BANDS):
        chosen = [s for s in samples if low <= s.dt / TRANSIT < high]
        tell(f"step / transit {low:g} .. {high:g}, {len(chosen)} scenes")
        for title, rule in RULES.items():
            tell(f"  {title:45s} {inside(chosen, rule)}")


def drawn(rng: np.random.Generator, count: int, path: Path) -> Iterator[Scene]:
    """A mass of 0.1 to 1e4 rods on a rod or spring, or a reed, with a step and a filter at random."""
    for _ in range(count):
        ratio, gap = 10 ** rng.uniform(-1, 4), 5 * rng.uniform()
        span = (math.pi * math.sqrt(ratio) + 2) * TRANSIT  # of the contact
        dt = min(10 ** rng.uniform(-1.5, 1.5) * TRANSIT, 0.3 * span * rng.uniform(0.03, 1))
        width = float(rng.choice([2.2, 3, 4, 6, 10, 16.5, 30])) * dt
        seat = (
            f'kind = "rod"\nyoung = "{YOUNG} Pa"\ndensity = "{DENSITY} kg/m^3"\narea = "1 mm^2"\nlength = "{LENGTH} m"'
        )
        if rng.uniform() < 0.2:
            seat = f'kind = "spring"\nstiffness = "{STIFFNESS} N/m"'
        reed, duration = REED, 4e-3
        if rng.uniform() < 0.8:
            mass = ratio * DENSITY * AREA * LENGTH
            reed = f'[reed]\nkind = "rigid_mass"\nmass = "{mass!r} kg"\nvelocity = "-1 m/s"\n'
            reed += f'[contact]\ngap = "{gap * dt!r} m"\n'
            duration = gap * dt + 1.5 * span + 3 * width
        run = f'[run]\nduration = "{max(duration, 2 * width)!r} s"\nfilter_width = "{width!r} s"\n'
        path.write_text(f'[seat]\n{seat}\n{reed}{run}time_step = "{dt!r} s"\n', encoding="utf-8")
        yield load_scene(path)


def sample(scene: Scene) -> Sample:
    """Run the scene with its step h, with others, and with an eighth of the step that the program would choose."""
    dt, striker, seat = scene.run.time_step, striker_of(scene), seat_of(scene).greens
    assert dt is not None
    auto = time_step(scene, striker.greens, seat)
    finest = max(min(auto / 8, dt / 16), scene.run.duration / 2e6)
    steps = {"h": dt, "2h": 2 * dt, "4h": 4 * dt, "h/2": dt / 2, "fine": min(auto, dt / 2)}
    steps["bounded"] = max(steps["fine"], dt / 8)
    at = {name: measures_of(scene, problem_of(scene, striker, impact.Body(seat)), step) for name, step in steps.items()}
    exact = measures_of(scene, problem_of(scene, striker, impact.Body(seat)), finest)
    return Sample(dt, auto, scene.run.filter_width / dt, exact, at)


def coarsened(s: Sample, name: str) -> float:
    """Twice and four times the step; where these hardly resolve the filter, half of it."""
    floor = s.dt if name == "contact_duration" and s.at["h"][name] > 0 else 0.0
    doubled = s.change("2h", name) if s.steps_per_filter >= 4 else 0.0
    other = s.change("4h", name) / 3 if s.steps_per_filter >= FINE else 2 * s.change("h/2", name)
    return max(floor, doubled, other)


def refined(s: Sample, name: str, step: str = "fine") -> float:
    """Where the step is longer than the program's own: also that one, its change taken as of first order."""
    if s.dt <= 1.001 * s.auto:
        return coarsened(s, name)
    fine = min(s.auto, s.dt / 2) if step == "fine" else max(min(s.auto, s.dt / 2), s.dt / 8)
    return max(coarsened(s, name), s.change(step, name) * s.dt / (s.dt - fine))


RULES: dict[str, Callable[[Sample, str], float]] = {
    "2 h and 4 h, or h/2": coarsened,
    "also the program's own step": refined,
    "also the program's own step, at least h/8": lambda s, name: refined(s, name, "bounded"),
}


def inside(samples: list[Sample], rule: Callable[[Sample, str], float]) -> str:
    """Share of the measures inside their bar, and by how much of the value the worst is outside."""
    found = [
        (abs(s.at["h"][name] - exact) - SAFETY * rule(s, name)) / abs(exact)
        for s in samples
        for name, exact in s.exact.items()
        if exact
    ]
    return f"{np.mean(np.array(found) <= 1e-9):7.1%}   {max(found):6.2f}" if found else "-"


if __name__ == "__main__":
    main()
