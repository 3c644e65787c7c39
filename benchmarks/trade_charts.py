"""Speed for accuracy of several scenes: docs/trade.md with its pictures, and the tables in benchmarks/results.

Run: python benchmarks/trade_charts.py [folder of the journals; default: trade-charts] [scenes]
A run that was stopped goes on where it was. With names of scenes, only these are measured anew; the others stay.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from table import RESULTS, machine

from impact.files.atomic import whole_file
from seatfem.study.trade.chart import draw_trade
from seatfem.study.trade.ladder import RATIO
from seatfem.study.trade.table import summary_of, write_trade
from seatfem.study.trade.trade import AS_FILED, LONGER, PLANNED, Trade, measure_trade

ROOT: Final = Path(__file__).parents[1]
DOCUMENT: Final = ROOT / "docs" / "trade.md"
SCENES: Final = (
    *("flapper_on_annular_seat", "flapper_on_valve_plate", "flapper_on_stopper", "flapper_on_peek_sleeve"),
    *("flapper_on_valve_body", "mass_on_meshed_seat"),  # from CAD, from a mesh
)
LIMIT: Final = 10.0  # processor seconds for a point

HEAD: Final = f"""# Speed for accuracy, measured

Written by `python benchmarks/trade_charts.py`. Measured on {{machine}}. Other programs were running, which is why the
charts show processor time.

```text
seatfem trade SCENE [-o FOLDER] [--quick] [--limit SECONDS]
```

runs a scene at every fidelity that applies to it and draws time against error. Each point is a scene with its keys
stated (the JSON table says which) and runs in a process of its own, on one thread, with no seat at hand from before.

- **The ladder.** The diagonal refines mesh and band together by {RATIO} from rung to rung, for every level of modelling
  that describes the seat; it goes on as far as the time limit lets it (`--limit`; here {LIMIT:g} processor seconds
  for a point). Around its centre each choice is varied alone: mesh, order, band, tolerance of the reduction, its
  method, reed modes, time step, history engine. The centre is what the file states; what it leaves open
  follows the filter's band, the waves in that band and the size of the struck face. The column of material under the
  contact, as a spring E A/h and as a rod, stands for what is used where there are no finite elements: a guess, without
  an error bar. Whether it is right is known only once the reference is there, so it is drawn (hollow squares) but does
  not count for the front; the last column of the table counts it.
- **Time** is processor time from the scene to its measures: mesher, assembly, reduction, contact; no error bars, files
  or pictures. The start of the program is a column of its own. What takes less than a few seconds is measured twice and
  the second counts, so that compiled code is not loaded in it. Peak memory is that of the point's process.
- **Error** is the relative difference from a reference that is finer than the whole ladder in every choice. The rings
  of the patch are one, or as the file states; where the planner takes more, as on the meshed seat, so many are a rung
  of their own, and the reference has twice as many. The
  reference is computed once more, one notch coarser in every choice; their difference over {RATIO} - 1 (order 1) is
  the reference's own uncertainty: the shaded floor. Errors below it are drawn at its edge and count as the floor.
- **Stopped** points (time limit; {LONGER:g} times as long for the reference and the planner's choice) and failed ones
  are in the table with the reason.
- **The planner's choice** (star) is what `seatfem plan` chooses if the file leaves all of it open; the diamond is the
  file as it is, where it states some. `planner_excess` is its cost over that of the cheapest point that is at least as
  accurate in the worst of the measures asked for; 1 is on the Pareto front.

A journal (`trade.jsonl`) takes each point as it ends: the same command goes on where a stopped one was. Outcomes of
another scene, point or version of the code are not used again.

| scene | points | target | planner's error | planner's time | excess over the front | over the cheapest at target | \
over the front with guesses |
|---|---|---|---|---|---|---|---|
"""


@dataclass(frozen=True)
class Charted:
    """A scene and its trade."""

    name: str
    trade: Trade


def anchor(charted: Charted) -> str:
    """Of its section, as Markdown makes it from the heading."""
    return re.sub(r"[^\w-]", "", charted.trade.title.lower().replace(" ", "-"))


def line(charted: Charted) -> str:
    """One row of the overview."""
    trade = charted.trade
    found = summary_of(trade)
    cells = (
        f"[{trade.title}](#{anchor(charted)})",
        f"{len(trade.done())} of {len(trade.points)}",
        f"{100 * trade.target:g} %",
        f"{100 * trade.trusted_error(PLANNED):.2g} %",
        f"{trade.cost(PLANNED):.2g} s",
        f"{found['planner_excess']:.2f}",
        f"{found['planner_excess_at_target']:.2f}",
        f"{found['planner_excess_with_guesses']:.2f}",
    )
    return f"| {' | '.join(cells)} |\n"


def section(charted: Charted) -> str:
    """Chart, and the points of the front with the planner's."""
    trade = charted.trade
    parts = [f"\n## {trade.title}\n\n", f"`examples/{charted.name}.toml`\n\n"]
    parts.append(f"![Time against error](images/trade_{charted.name}.png)\n\n")
    heads = [measure.replace("_", " ") for measure in trade.measures]
    parts.append(f"| on the front of the worst error | processor time | peak memory | {' | '.join(heads)} |\n")
    parts.append("|---" * (3 + len(heads)) + "|\n")
    names = [*trade.front(), *(n for n in (PLANNED, AS_FILED) if n in trade.outcomes and n not in trade.front())]
    for name in names:
        outcome = trade.outcomes[name]
        errors = [f"{100 * trade.error(name, measure):.2g} %" for measure in trade.measures]
        label = name if name in trade.front() else f"*{name}, not on it*"
        parts.append(
            f"| {label} | {outcome.processor:.2g} s | {outcome.memory / 1e6:.0f} MB | {' | '.join(errors)} |\n"
        )
    floors = ", ".join(f"{h} {100 * trade.floor[m]:.2g} %" for h, m in zip(heads, trade.measures, strict=True))
    parts.append(
        f"\nUncertainty of the reference: {floors}. All points: `benchmarks/results/trade_{charted.name}.csv`.\n"
    )
    return "".join(parts)


def write_document(found: list[Charted]) -> None:
    """The scenes measured so far."""
    words = "; ".join(f"{key} {value}" for key, value in machine().items())
    text = HEAD.format(machine=words) + "".join(map(line, found)) + "".join(map(section, found))
    with whole_file(DOCUMENT) as temporary:
        temporary.write_text(text, encoding="utf-8")


def put_in_place(charted: Charted) -> None:
    """One scene of the document anew."""
    mark = f"\n## {re.escape(charted.trade.title)}\n"
    text = DOCUMENT.read_text(encoding="utf-8")
    text = re.sub(rf"(?m)^\| \[.*\]\(#{anchor(charted)}\).*\n", lambda _: line(charted), text)
    text = re.sub(rf"(?s){mark}.*?(?=\n## |\Z)", lambda _: section(charted), text)
    with whole_file(DOCUMENT) as temporary:
        temporary.write_text(text, encoding="utf-8")


def main(folder: Path, names: Sequence[str]) -> None:
    """Measure, draw, write; the document grows scene by scene."""
    found: list[Charted] = []
    for name in names or SCENES:
        trade = measure_trade(ROOT / "examples" / f"{name}.toml", folder / f"{name}.jsonl", time_limit=LIMIT)
        tables = [RESULTS / f"trade_{name}.{ending}" for ending in ("csv", "json")]
        write_trade(trade, *tables)
        for table in tables:  # messages name files by their whole paths
            table.write_text(table.read_text(encoding="utf-8").replace(f"{ROOT}/", ""), encoding="utf-8")
        draw_trade(trade, DOCUMENT.parent / "images" / f"trade_{name}.png")
        found.append(Charted(name, trade))
        if names:
            put_in_place(found[-1])
        else:
            write_document(found)


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path("trade-charts"), sys.argv[2:])
