"""Whole scenes drawn at random over all that a scene file may say, with quantities driven out to their extremes.

No closed form knows them. Each is judged by what holds of every run: energy by its balance, forces that push, numbers
that are numbers; and by its price.
"""

import math
import re
from dataclasses import dataclass

import numpy as np
from drawn_scenes import draw_scene

from tests.extremes.cell import Cell, Finding
from tests.extremes.scene_run import Files, Known, SceneRun, judge, run_text

SHORT, SEED = 75, 1
"""Random scenes of the battery, and the seed of all of them."""
LONGEST = 30.0  # s: scenes that take longer are left out


def random_cells(count: int = SHORT, seed: int = SEED) -> tuple[Cell, ...]:
    """Return scenes drawn at random; by default those of the short form."""
    scenes = [Driven(index, seed) for index in range(count)]
    return tuple(Cell("random scenes", f"{seed}-{n:04d}: {scene.words}", scene) for n, scene in enumerate(scenes))


@dataclass(frozen=True)
class Driven:
    """A scene of the whole language (`benchmarks/drawn_scenes.py`) of which up to three quantities are driven out.

    Each by up to six decades.
    """

    index: int
    seed: int

    @property
    def words(self) -> str:
        """Return the words that tell what is in the scene, and what was driven out."""
        return self._scene()[2]

    def __call__(self) -> Finding:
        """Run it, and judge it by its balances."""
        text, files, _ = self._scene()
        return balanced(run_text(text, files, most_seconds=LONGEST))

    def _scene(self) -> tuple[str, Files, str]:
        rng = np.random.default_rng([self.seed, self.index])
        drawn = draw_scene(self.index, self.seed)
        quantities = list(re.finditer(r'(\w+) = "(-?[\d.e+-]+) ([^"]+)"', drawn.text))
        text, changes = drawn.text, []
        for match in sorted(rng.choice(len(quantities), size=rng.integers(1, 4), replace=False).tolist(), reverse=True):
            key, value, unit = quantities[match].groups()
            new = f"{float(value) * 10 ** rng.uniform(-6, 6):.6g} {unit}"
            changes.append(f"{key} {new}")
            text = f'{text[: quantities[match].start()]}{key} = "{new}"{text[quantities[match].end() :]}'
        return text, drawn.files, f"{drawn.seat}, {drawn.reed} ({drawn.about}), " + ", ".join(changes)


def balanced(run: SceneRun) -> Finding:
    """Judge a run by what holds of every one: energy is kept to 1e-6, the mean of a force is below its peak, what is a
    number is finite, and error bars are not negative."""
    for key, value in run.summary.items():
        if isinstance(value, float) and (not math.isfinite(value) or (key.startswith("error_bar_") and value < 0)):
            return Finding(math.nan, 0.0, run.messages, f"{key} = {value:g}")
    peak, mean = run.number("peak_force_N"), run.number("filtered_peak_force_N")
    over = Known("filtered_peak_force_N", peak, 1e-9, value=max(mean, peak))
    return judge(run, Known("energy_residual", 0.0, 1e-6, scale=1.0), over)
