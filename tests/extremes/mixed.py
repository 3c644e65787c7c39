"""Whole scenes that mix the axes of scene files: a pairwise covering array, and scenes drawn at random.

No closed form knows them. Each is judged by what holds of every run: energy by its balance, momentum of a free striker,
forces that push, numbers that are numbers; and by its price.
"""

import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from itertools import product

import numpy as np
from drawn_scenes import draw_scene

from tests.extremes.cell import Cell, Finding
from tests.extremes.pairwise import Pair, covering_array
from tests.extremes.plates_axes import DENSITY, POISSON, YOUNG
from tests.extremes.scene_run import Files, Known, SceneRun, judge, run_text
from tests.extremes.scene_text import Table, csv_text, material, run_table, scene_text, si

SHORT, SEED = 150, 1
"""Random scenes of the battery, and the seed of all of them."""
LONGEST = 30.0  # s: scenes that take longer are left out
DURATION, WIDTH, GAP = 2e-4, 5e-6, 2e-6
STEEL = material(YOUNG, DENSITY, POISSON)
FREE = ("rigid_mass", "disc", "ring_plate", "ball")
LEVELS: Mapping[str, tuple[str | float, ...]] = {
    "striker": (*FREE, "cantilever", "flapper"), "seat": ("spring", "rod", "annular", "soft annular"),
    "size": (0.1, 1.0, 10.0), "thickness": (0.3, 1.0, 2.0), "speed": (1e-3, 1.0, 30.0),
    "law": ("signorini", "spring", "hertz"), "spring": ("none", "soft", "pressed"), "film": ("none", "thin", "thick"),
    "base": ("none", "slow", "fast"), "load": ("none", "gravity", "pressure"), "division": ("none", "arcs", "rings"),
    "tilt": (0.0, 1e-3, 0.3), "stress": ("none", "seat"), "target": (0.05, 0.3),
}  # fmt: skip
BASED = {"none": 0.0, "slow": 0.01, "fast": 1.0}  # m/s of the seat
UNDIVIDED = [*product(("striker",), ("rigid_mass", "ball", "cantilever")), *product(("seat",), ("spring", "rod"))]
REFUSED = (  # these are refused, whatever the rest
    *((*one, "division", other) for one in UNDIVIDED for other in ("arcs", "rings")),
    *((*one, "tilt", other) for one in UNDIVIDED for other in (1e-3, 0.3)),
    *(("division", one, "tilt", other) for one in ("none", "rings") for other in (1e-3, 0.3)),
    *(("seat", one, "stress", "seat") for one in ("spring", "rod")),
    ("striker", "ball", "load", "gravity"),
)


def mixed_cells() -> tuple[Cell, ...]:
    """Return the covering array and the random scenes of the short form."""
    axes = list(LEVELS)
    excluded: set[Pair] = set()
    for a, i, b, j in REFUSED:
        one, other = (axes.index(a), LEVELS[a].index(i)), (axes.index(b), LEVELS[b].index(j))
        excluded.add((*min(one, other), *max(one, other)))
    rows = covering_array([len(levels) for levels in LEVELS.values()], seed=1, excluded=excluded)
    mixes = [Mix({axis: LEVELS[axis][i] for axis, i in zip(axes, row, strict=True)}) for row in rows]
    pairs = (Cell("pairs of scene files", f"{n:03d}: {mix.words}", mix) for n, mix in enumerate(mixes))
    return (*pairs, *random_cells(SHORT))


def random_cells(count: int, seed: int = SEED) -> tuple[Cell, ...]:
    """Return scenes drawn at random, by turns of these axes and of the whole scene language, driven out."""
    draws: tuple[Callable[[int, int], Mix | Driven], ...] = (drawn_mix, Driven)
    scenes = [draws[index % 2](index // 2, seed) for index in range(count)]
    return tuple(Cell("random scenes", f"{seed}-{n:04d}: {scene.words}", scene) for n, scene in enumerate(scenes))


@dataclass(frozen=True)
class Mix:
    """A scene of these axes; ``levels``: the value on each."""

    levels: Mapping[str, str | float]

    @property
    def words(self) -> str:
        """Return all values, in order."""
        return ", ".join(
            f"{axis} {value if isinstance(value, str) else f'{value:.3g}'}" for axis, value in self.levels.items()
        )

    def __call__(self) -> Finding:
        """Run it, and judge it by its balances."""
        run = run_text(
            self.text,
            {"base.csv": csv_text("time [s],velocity [m/s]", [0.0, 1.0], [self.carried] * 2)},
            most_seconds=LONGEST,
        )
        momentum = []
        pushed = any(self.levels[axis] != "none" for axis in ("spring", "film", "load", "base"))
        if (
            self.levels["striker"] in FREE
            and not pushed
            and not math.isnan(run.number("restitution"))
            and not self.levels["tilt"]
        ):
            reach = self.mass * self.speed
            bar = run.bar("restitution") * reach if math.isfinite(run.bar("restitution")) else 0.0
            momentum = [Known("impulse_Ns", reach * (1 + run.number("restitution")), 2e-3, bar)]
        return balanced(run, *momentum)

    @property
    def speed(self) -> float:
        """Return the speed of the striker [m/s]."""
        return float(self.levels["speed"])

    @property
    def carried(self) -> float:
        """Return the speed of the seat [m/s]."""
        return BASED[str(self.levels["base"])]

    @property
    def mass(self) -> float:
        """Return the mass of a free striker [kg], else infinity."""
        size, high = (
            1e-3 * float(self.levels["size"]),
            1e-3 * float(self.levels["size"]) * float(self.levels["thickness"]),
        )
        volumes = {
            "rigid_mass": size**3,
            "disc": math.pi * 100 * size**2 * high,
            "ring_plate": math.pi * 75 * size**2 * high,
            "ball": math.pi / 6 * 512 * size**3,
        }
        return DENSITY * volumes.get(str(self.levels["striker"]), math.inf)

    @property
    def text(self) -> str:
        """Return the scene as the text of its file."""
        size = float(self.levels["size"])
        tables: dict[str, Table | list[Table] | None] = {
            "seat": self._seat(), "reed": self._reed(), "contact": self._contact(),
            "run": run_table(DURATION * size, WIDTH * size), "accuracy": {"target": self.levels["target"]},
        }  # fmt: skip
        spring = {"soft": {"stiffness": "1 N/mm"}, "pressed": {"stiffness": "10 N/mm", "preload": "5 N"}}
        load: Mapping[str, Table] = {
            "gravity": {"gravity": "-1000 m/s^2"},
            "pressure": {"pressure": "-0.5 bar", "area": si(5e-5 * size**2, "m^2")},
        }
        tables["spring"] = [spring[str(self.levels["spring"])]] if self.levels["spring"] != "none" else None
        tables["load"] = [load[str(self.levels["load"])]] if self.levels["load"] != "none" else None
        tables["base"] = [{"of": "seat", "velocity": "base.csv"}] if self.levels["base"] != "none" else None
        tables["stress"] = {"struck": False} if self.levels["stress"] != "none" else None
        return scene_text(**tables)

    def _mm(self, value: float) -> str:
        return si(1e-3 * float(self.levels["size"]) * value, "m")

    def _seat(self) -> Table:
        kind, size = str(self.levels["seat"]), float(self.levels["size"])
        if kind == "spring":
            return {"kind": "spring", "stiffness": si(2e7 * size, "N/m")}
        if kind == "rod":
            area = si(1e-5 * size**2, "m^2")
            solid = {"young": si(YOUNG, "Pa"), "density": si(DENSITY, "kg/m^3"), "damping_ratio": 0.02}
            return {"kind": "rod", "area": area, "length": self._mm(15), **solid}
        return {
            "kind": "annular", "bore_radius": self._mm(7), "lip_width": self._mm(1), "lip_height": self._mm(0.5),
            "lip_edge_radius": "0 mm", "outer_radius": self._mm(10), "thickness": self._mm(4), "damping_ratio": 0.02,
            "material": material(4e9, 1300.0, 0.38) if kind.startswith("soft") else STEEL,
            "mesh": {"size": self._mm(2), "contact_size": self._mm(1)}, "greens": {"bandwidth": si(1e5 / size, "Hz")},
        }  # fmt: skip

    def _reed(self) -> Table:
        kind, high, speed = str(self.levels["striker"]), float(self.levels["thickness"]), si(-self.speed, "m/s")
        band = {"bandwidth": si(4e4 / float(self.levels["size"]), "Hz")}
        if kind == "rigid_mass":
            return {"kind": kind, "mass": si(self.mass, "kg"), "velocity": speed}
        if kind == "ball":
            sizes = {
                "diameter": self._mm(8),
                "contact_radius": self._mm(0.8),
                "greens": {"bandwidth": si(3e5 / float(self.levels["size"]), "Hz")},
            }
            return {"kind": kind, **sizes, "material": STEEL, "velocity": speed}
        sheet = {"thickness": self._mm(high), "material": STEEL, "damping_ratio": 0.02}
        if kind == "disc":
            return {"kind": kind, "diameter": self._mm(20), **sheet, "velocity": speed, "greens": band}
        if kind == "ring_plate":
            rings = {"outer_diameter": self._mm(20), "inner_diameter": self._mm(10), "greens": band}
            return {"kind": kind, **rings, **sheet, "velocity": speed}
        if kind == "cantilever":
            release = {"mode": 1, "velocity": speed}
            return {"kind": kind, "length": self._mm(25), "width": self._mm(8), **sheet, "release": release}
        shape = {"root_width": 12, "taper_length": 2, "neck_width": 10, "neck_length": 18, "paddle_diameter": 20}
        sizes = {key: self._mm(value) for key, value in shape.items()}
        return {"kind": kind, **sizes, **sheet, "release": {"velocity": speed}, "greens": band}

    def _contact(self) -> Table:
        size = float(self.levels["size"])
        laws: Mapping[str, Mapping[str, object]] = {
            "signorini": {},
            "spring": {"law": {"kind": "spring", "stiffness": si(2e7 * size, "N/m")}},
            "hertz": {"law": {"kind": "hertz", "stiffness": si(1e10 * math.sqrt(size), "N/m^1.5")}},
        }
        parts: Mapping[str, Mapping[str, object]] = {"none": {}, "arcs": {"ports": 8}, "rings": {"rings": 3}}
        films: Mapping[str, Mapping[str, object]] = {
            "none": {},
            "thin": {"viscosity": "18 uPa s", "floor": "0.5 um"},
            "thick": {"viscosity": "20 mPa s", "floor": "10 um"},
        }
        film = films[str(self.levels["film"])]
        stated = {"film": {**film, "width": self._mm(1), "length": self._mm(47)}} if film else {}
        tilt = {"tilt": si(float(self.levels["tilt"]), "deg")} if self.levels["tilt"] else {}
        gap = {"gap": si(GAP, "m")}
        solids = "annular" in str(self.levels["seat"]) or self.levels["striker"] == "ball"
        law = "spring" if solids and self.levels["law"] == "hertz" else str(self.levels["law"])  # else refused
        return {**gap, **laws[law], **parts[str(self.levels["division"])], **stated, **tilt}  # type: ignore[dict-item]


def drawn_mix(index: int, seed: int) -> Mix:
    """Return levels at random, numbers anywhere between their ends; one that is refused as a whole is drawn again."""
    rng = np.random.default_rng([seed, index])
    while True:
        levels = {axis: values[int(rng.integers(len(values)))] for axis, values in LEVELS.items()}
        if not any(levels[a] == i and levels[b] == j for a, i, b, j in REFUSED):
            break
    for axis in ("size", "thickness", "speed", "target"):
        low, high = (math.log(float(value)) for value in (LEVELS[axis][0], LEVELS[axis][-1]))
        levels[axis] = math.exp(rng.uniform(low, high))
    return Mix(levels)


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


def balanced(run: SceneRun, *known: Known) -> Finding:
    """Judge a run by what holds of every one: energy is kept to 1e-6, the mean of a force is below its peak, what is a
    number is finite, and error bars are not negative."""
    for key, value in run.summary.items():
        if isinstance(value, float) and (not math.isfinite(value) or (key.startswith("error_bar_") and value < 0)):
            return Finding(math.nan, 0.0, run.messages, f"{key} = {value:g}")
    peak, mean = run.number("peak_force_N"), run.number("filtered_peak_force_N")
    over = Known("filtered_peak_force_N", peak, 1e-9, value=max(mean, peak))
    return judge(run, Known("energy_residual", 0.0, 1e-6, scale=1.0), over, *known)
