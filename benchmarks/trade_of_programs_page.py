"""docs/trade_programs.md, its charts and the README's, from the table of `trade_of_programs.py`.

python benchmarks/trade_of_programs_page.py
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from statistics import median
from typing import Any, Final

from matplotlib.patches import Patch
from matplotlib.ticker import FixedLocator, NullLocator
from peers.plain_program import STEP
from table import RESULTS, describe_machine, machine, read_rows
from trade_of_programs import (
    CALCULIX,
    FILE,
    IMPULSE,
    OURS,
    PEAK,
    PLAIN,
    POINTS,
    ROOT,
    SCENES,
    SICONOS,
    WORDS,
    Judged,
    Row,
)

from impact.files.safe_files import write_whole
from impact.pictures.drawing import BLUE, GREEN, GREY, ORANGE, PURPLE, SKY, sheet

DOCUMENT: Final = ROOT / "docs" / "trade_programs.md"
IMAGES: Final = ROOT / "docs" / "images"
SCIKIT: Final = "scikit-fem and SciPy"
LOOKS: Final = {
    OURS: (BLUE, "o"), PLAIN: (ORANGE, "s"), POINTS: (GREEN, "^"), CALCULIX: (PURPLE, "D"), SCIKIT: (GREY, "v"),
    SICONOS: (SKY, "P"),
}  # fmt: skip
WIDE: Final = 8.0  # inch, from which on a legend is one line
LEAST: Final = 1e-5  # relative, the smallest error or doubt that is drawn
SHOWN: Final = ("beam_on_rod", "mass_on_lip", "tilted_flapper")


@dataclass(frozen=True)
class Point:
    """A program at a setting: time [s], relative errors by key, its own bars over the reference's values."""

    program: str
    setting: str
    wall: float
    processor: float
    errors: dict[str, float]
    bars: dict[str, float]

    @property
    def worst(self) -> float:
        """Return the largest error."""
        return max(abs(error) for error in self.errors.values())


@dataclass(frozen=True)
class Chart:
    """A scene, the points of all programs but the reference itself, and the reference's doubts by key."""

    scene: Judged
    points: tuple[Point, ...]
    doubts: dict[str, float]
    seconds: float

    @property
    def floor(self) -> float:
        """Return the largest doubt."""
        return max(self.doubts.values())

    def of(self, program: str) -> list[Point]:
        """Return the points of a program."""
        return [point for point in self.points if point.program == program]


def tightest(scene: Judged) -> str:
    """Return the setting of our run for the scene's least target."""
    return f"{100 * min(scene.targets):g} %"


def is_complete(scene: Judged, rows: Sequence[Row]) -> bool:
    """Return whether all points of a scene are on file."""
    settings = {(row.program, row.setting) for row in rows if row.scene == scene.name}
    return {(scene.reference, f"level {scene.finest}"), (OURS, tightest(scene))} <= settings


def read_chart(scene: Judged, rows: Sequence[Row]) -> Chart:
    """Return errors and doubts of a scene."""
    grouped: dict[tuple[str, str], dict[str, Row]] = {}
    for row in rows:
        if row.scene == scene.name:
            grouped.setdefault((row.program, row.setting), {})[row.key] = row
    fine, coarser = (grouped[scene.reference, f"level {level}"] for level in (scene.finest, scene.finest - 1))
    truth = {key: fine[key].value for key in scene.keys}
    points = [
        Point(
            *name,
            wall=one[scene.keys[0]].wall_s,
            processor=one[scene.keys[0]].processor_s,
            errors={key: one[key].value / truth[key] - 1 for key in scene.keys},
            bars={key: one[key].bar / abs(truth[key]) for key in scene.keys if not math.isnan(one[key].bar)},
        )
        for name, one in grouped.items()
        if name != (scene.reference, f"level {scene.finest}")
    ]
    doubts = {key: abs(coarser[key].value / truth[key] - 1) for key in scene.keys}
    besides = peers() if scene.name == "mass_on_lip" else ()
    return Chart(scene, (*points, *besides), doubts, fine[scene.keys[0]].processor_s)


def peers() -> Iterator[Point]:
    """Yield what results/peers.json has of the same impact on a lip with round edges, beside its own mesh."""
    table = json.loads((RESULTS / "peers.json").read_text(encoding="utf-8"))["tables"]["impact"]
    for row in table["rows"]:
        one = dict(zip(table["columns"], row, strict=True))
        if one["program"] in (CALCULIX, SCIKIT):
            seconds, peak, impulse = (float(one[name]) for name in ("first (s)", "peak (%)", "impulse (%)"))
            errors = {IMPULSE: impulse / 100, PEAK: peak / 100}
            yield Point(one["program"], f"steps of {one['step (ns)']} ns", math.nan, seconds, errors, {})


HEAD: Final = """# Speed for accuracy, judged by other programs

By `python benchmarks/trade_of_programs_page.py` from what `python benchmarks/trade_of_programs.py` measured on
{machine}. Other programs were running, so the charts show processor time.

The reference is not a finer run of this program, as in [Speed for accuracy](trade.md), but an independent program: both
share only the scene files and the equations of these pages. All errors are relative.

- **seatfem**: `seatfem run SCENE --no-pictures`, a process with an empty store and one thread, from start to files, for
  targets of 30, 10, 3 and, except for the CAD seat, 1 %. A dash is the error bar of the run.
- **plain program** (`benchmarks/peers/plain_program.py`, `benchmarks/peers/plain_bodies.py`; NumPy, SciPy, Numba, and
  scikit-fem for an annular seat and a ring): a program of the kind that an engineer writes in an afternoon. Both
  bodies are sums of modes, in closed form or of finite elements, with a spring for the omitted modes; Strang's
  splitting (velocity Verlet) with steps of {step:g} us over 2^n on level n. It gives no error bar.
- **plate on points** (`benchmarks/points`): Mindlin's plate and the seat by spectral elements, a law at each point.
- **Siconos** (`benchmarks/peers/siconos_landing.py`): its theta rule on the modes of the plain program, in a quarter of
  its steps.
- **CalculiX**, **scikit-fem and SciPy**: the solver alone, on a given mesh, from [peers](peers.md).
- **Reference**: the finest level of the scene's independent program. Its doubt is the change from the next coarser
  level. Errors below the doubt, or below 0.001 %, are drawn at the edge of the shaded area.

| scene | reference | doubt | error at target 1 % (CAD: 3 %) | time | reference program's time | bars that hold |
|---|---|---|---|---|---|---|
{rows}

{findings}
"""
FINDINGS: Final = """Of {all} error bars of seatfem {held} contain the reference within its doubt.

- The median ratio of bar to error is {wide:.0f}.
- For the error that seatfem reaches at the smallest target the reference program takes {cheap}, and seatfem {low:.1f}
  to {high:.1f} times as long: it starts slower, and repeats the contact for bars and baseline. CalculiX, given the
  mesh, takes longest.
- A target of 30 % is hardly cheaper than one of 3 %: most of the time is not spent on the contact.
- The bar of the tilted flapper exceeds the target of 1 %, and the run says so.

All points: `benchmarks/results/trade_of_programs.csv`.
"""
ABOUT: Final = {
    "beam_on_rod": """A steel reed, moving in its first mode, lands on a rod of PEEK with its waves; the law is a
spring. The stress at the contact is a hot spot, for which runs have no bar.""",
    "repeated_landing": """A steel reed lands on a rod of cast iron repeatedly: rainflow, Goodman, a Basquin
curve with Haibach's slope, Miner's sum. The strength is invented.""",
    "gas_valve": """The cycle of [the gas page](gas.md) by the midpoint rule, on a beam reed between a seat and a
stopper; impulse and peak are those of the whole run, with the gas that presses the reed shut.""",
    "film_landing": """A rigid valve squeezes air out of the gap, N = -k/(g + f)^3 dg/dt ([methods](methods.md)), and
lands on a bar of PEEK.""",
    "mass_on_lip": """A rigid mass of 20 g strikes the sharp lip of an annular seat through a spring as stiff as the
seat. CalculiX, scikit-fem and SciPy had a lip with edges of 0.1 mm: the error of their mesh is not in their errors.""",
    "sprung_ring": """The ring of a ring valve, a Mindlin plate in both programs, closes under a valve spring on a lip
of PEEK.""",
    "mass_on_slot": """The same mass on the lip around a slot, a face of a STEP file. The plain program
meshes a quarter of it with gmsh; seatfem does not use planes of symmetry.""",
    "tilted_flapper": """A flapper lands tilted by 0.2 degrees on the lip of a solid steel seat. CalculiX marched our
mesh of plate and seat ([exchange](exchange.md)), which is coarse to limit its time; the time is that of the solver
alone.""",
}


def draw_panel(axes: Any, chart: Chart, error_of: Callable[[Point], float], floor: float, key: str = "") -> None:
    """Draw errors over processor time, those below the floor at its edge; of others the Pareto front; bars of a key."""
    axes.set(xscale="log", yscale="log", xlabel="processor time [s]")
    lowest, times = 100 * max(floor, LEAST), [point.processor for point in chart.points]
    for program, (colour, mark) in LOOKS.items():
        places = sorted((p.processor, max(100 * abs(error_of(p)), lowest)) for p in chart.of(program))
        if not places:
            continue
        front = [place for n, place in enumerate(places) if all(place[1] < other[1] for other in places[:n])]
        if program != OURS:
            axes.plot(*zip(*front, strict=True), color=colour, lw=1, drawstyle="steps-post")
        axes.plot(*zip(*places, strict=True), color=colour, marker=mark, ms=5, ls="none", label=program, clip_on=False)
    bars = [(p.processor, 100 * p.bars[key]) for p in chart.of(OURS) if key in p.bars]
    if bars:
        places, look = zip(*bars, strict=True), {"ls": "none", "marker": "_", "ms": 9, "mew": 1.5, "color": BLUE}
        axes.plot(*places, label="error bar of seatfem", **look)
    axes.axhspan(lowest / 3, lowest, color="#DDDDDD", lw=0, zorder=0)
    axes.set(xlim=(min(times) / 1.4, max(10 * min(times), 1.4 * max(times))))
    axes.set_ylim(bottom=lowest / 3)
    axes.xaxis.set_major_locator(FixedLocator([a * 10.0**b for b in range(-1, 4) for a in (1, 2, 5)]))
    axes.xaxis.set_minor_locator(NullLocator())
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_formatter("{x:g}")


def add_legend(figure: Any, panels: Sequence[Any]) -> None:
    """Add one legend for all panels below them."""
    named = {label: handle for a in panels for handle, label in zip(*a.get_legend_handles_labels(), strict=True)}
    shade = Patch(color="#DDDDDD", label="nothing is decided below")
    columns = 6 if figure.get_figwidth() > WIDE else 3
    figure.legend([*named.values(), shade], [*named, shade.get_label()], loc="outside lower center", ncols=columns)


def draw_scene(chart: Chart) -> None:
    """Draw a panel for each key."""
    keys = chart.scene.keys
    path = IMAGES / f"trade_programs_{chart.scene.name}.png"
    with sheet(path, max(5.6, 0.8 + 2.3 * len(keys)), 3.2) as figure:
        panels = figure.subplots(1, len(keys), squeeze=False, sharex=True)[0]
        for axes, key in zip(panels, keys, strict=True):
            draw_panel(axes, chart, lambda point, key=key: point.errors[key], chart.doubts[key], key)
            axes.set_title(WORDS[key].capitalize())
        panels[0].set_ylabel("error [%]")
        add_legend(figure, panels)


def draw_readme(charts: Sequence[Chart]) -> None:
    """Draw the largest error of three scenes in one picture."""
    with sheet(IMAGES / "trade_programs.png", 8.4, 3.1) as figure:
        panels = figure.subplots(1, len(charts), squeeze=False)[0]
        for axes, chart in zip(panels, charts, strict=True):
            draw_panel(axes, chart, lambda point: point.worst, chart.floor)
            axes.set_title(chart.scene.title)
        panels[0].set_ylabel("largest error [%]")
        add_legend(figure, panels)


def percent(share: float) -> str:
    """Return a share with two digits."""
    return f"{100 * share:.2g} %"


def cheapest(points: Sequence[Point], error: float) -> Point | None:
    """Return the cheapest point that is at least as accurate."""
    return min((p for p in points if p.worst <= error), key=lambda p: p.processor, default=None)


def at_least_target(chart: Chart) -> tuple[Point, Point | None]:
    """Return our run for the least target and the cheapest point of the reference's program that is as accurate."""
    best = next(point for point in chart.of(OURS) if point.setting == tightest(chart.scene))
    return best, cheapest(chart.of(chart.scene.reference), max(best.worst, chart.floor))


def stated_bars(chart: Chart) -> list[tuple[Point, str, float, bool]]:
    """Return each bar of our runs: point, key, bar, and whether the error is within it and the doubt."""
    bars = ((point, key, bar) for point in chart.of(OURS) for key, bar in point.bars.items())
    return [(point, key, bar, abs(point.errors[key]) <= bar + chart.doubts[key]) for point, key, bar in bars]


def overview(chart: Chart) -> str:
    """Return a scene's row."""
    best, other = at_least_target(chart)
    held = [holds for *_, holds in stated_bars(chart)]
    title = chart.scene.title
    link = title.lower().replace(" ", "-").replace(",", "")
    cells = [
        f"[{title}](#{link})",
        chart.scene.reference,
        percent(chart.floor),
        percent(best.worst),
        f"{best.processor:.1f} s",
        "none" if other is None else f"{other.processor:.1f} s ({other.setting})",
        f"{sum(held)} of {len(held)}",
    ]
    return f"| {' | '.join(cells)} |"


def failing(chart: Chart) -> str:
    """Return the bars that do not hold, in words."""
    fails = [
        f"{WORDS[key]} for {p.setting} (error {percent(p.errors[key])}, bar {percent(bar)}, doubt "
        f"{percent(chart.doubts[key])})"
        for p, key, bar, holds in stated_bars(chart)
        if not holds
    ]
    return f"Beyond bar and doubt: {'; '.join(fails)}." if fails else ""


def section(chart: Chart) -> str:
    """Return a scene's chart and words."""
    name, keys = chart.scene.name, chart.scene.keys
    doubts = ", ".join(f"{WORDS[key]} {percent(chart.doubts[key])}" for key in keys)
    words = [
        f"## {chart.scene.title}",
        f"`benchmarks/programs/{name}.toml`. {ABOUT[name]}",
        f"![Error against time](images/trade_programs_{name}.png)",
        *filter(None, [failing(chart)]),
        f"Reference: level {chart.scene.finest}, {chart.seconds:.0f} s. Its doubt: {doubts}.",
    ]
    return "\n\n".join(words) + "\n"


def describe_findings(charts: Sequence[Chart]) -> str:
    """Return what all charts say together."""
    bars = [each for chart in charts for each in stated_bars(chart)]
    ratios = [bar / max(abs(point.errors[key]), LEAST) for point, key, bar, _ in bars]
    times = [(best.processor, other.processor) for best, other in map(at_least_target, charts) if other]
    low, high = (f(ours / other for ours, other in times) for f in (min, max))
    cheap = f"{min(t for _, t in times):.1f} to {max(t for _, t in times):.1f} s"
    held = sum(holds for *_, holds in bars)
    return FINDINGS.format(all=len(bars), held=held, wide=median(ratios), cheap=cheap, low=low, high=high)


def write_page() -> None:
    """Draw the charts and write the page."""
    measured = read_rows(Row, FILE)
    charts = [read_chart(scene, measured) for scene in SCENES if is_complete(scene, measured)]
    for chart in charts:
        draw_scene(chart)
    if len(panels := [chart for chart in charts if chart.scene.name in SHOWN]) == len(SHOWN):
        draw_readme(panels)
    rows = "\n".join(map(overview, charts))
    head = HEAD.format(
        machine=describe_machine(machine()), findings=describe_findings(charts), step=1e6 * STEP, rows=rows
    )
    write_whole(DOCUMENT, "\n".join([head, *map(section, charts)]).encode())


if __name__ == "__main__":
    write_page()
