"""Speed for accuracy of several scenes: docs/trade.md with its pictures, and the tables in benchmarks/results.

Run: python benchmarks/trade_charts.py [folder of the journals; default: trade-charts] [scenes]
A run that was stopped goes on where it was. With names of scenes, only these are measured anew; the others stay.
"""

from __future__ import annotations

import math
import re
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Final

from table import RESULTS, describe_machine, machine

from impact.files.safe_files import write_whole
from seatfem.study.trade.report import draw_trade, summary_of, write_trade
from seatfem.study.trade.trade import AS_FILED, LONGER, MEMORY, OWN_CHOICE, Trade, measure_trade

ROOT: Final = Path(__file__).parents[1]
DOCUMENT: Final = ROOT / "docs" / "trade.md"
SCENES: Final = (
    *("flapper_on_annular_seat", "flapper_on_valve_plate", "flapper_on_stopper", "flapper_on_peek_sleeve"),
    *("flapper_on_valve_body", "mass_on_meshed_seat"),  # from CAD, from a mesh
    "tilted_landing",
)
ON_LIP: Final = "tilted_landing"
LIMIT, LIMIT_ON_LIP = 10.0, 40.0  # processor seconds for a point; the reference of a lip takes more than a minute

HEAD: Final = f"""# Speed for accuracy, measured

By `python benchmarks/trade_charts.py` on {{machine}}. Other programs were running, so the charts show processor
time.

```text
seatfem trade SCENE [-o FOLDER] [--quick] [--limit SECONDS]
```

This command runs a scene at many levels of refinement and draws time against error. Each point runs in a process of
its own, on one thread, with an empty store. The same command continues a run that was stopped (`trade.jsonl`).

- **The points** are on the ladders of the [loop](methods.md#the-loop), also for keys that the file states. The
  states from the first values of a run to its own choice are the rounds of its loop. Around this choice each key is
  varied alone, to its first value and one rung finer, which halves its error, and so are the models of the seat
  (`--quick` omits these points). Two further states have all keys one and two rungs finer.
- **Time** is processor time from the scene to its measures, without error bars, files, pictures or start of the
  program. Memory is the peak of the point's process. The limit (`--limit`) is here {LIMIT:g} processor seconds for a
  point, {LIMIT_ON_LIP:g} for the tilted landing.
- **Error** is the relative difference from the finest state that ends, all keys two rungs finer where that ends within
  {LONGER:g} times the limit; a key at its limit is as in the run. The uncertainty of the reference (shaded floor) is
  its difference from the state one rung coarser.
- **Stopped** points (time limit) and failed ones are in the tables, `benchmarks/results/trade_*.csv`, with the reason.
- **The run's own choice** (star) is the final state of the loop of `seatfem run` if the file leaves all keys open; the
  diamond is the file as it is, if it states some. *Excess* is its time over that of the cheapest point that is at
  least as accurate in the worst of the requested measures; 1 is on the Pareto front.

| scene | points | target | error of the run's own choice | its time | excess over the front | \
over the cheapest at target |
|---|---|---|---|---|---|---|
"""
WORDS: Final = {
    "tilted_landing": """States alone (`--quick`). The file states 96 segments of the lip and the step; a run chooses
both where they are open.

""",
}
"""What sections say besides."""


def anchor(trade: Trade) -> str:
    """Return the anchor of its section, as Markdown makes it from the heading."""
    return re.sub(r"[^\w-]", "", trade.title.lower().replace(" ", "-"))


def line(trade: Trade) -> str:
    """Return its row of the overview."""
    summary = summary_of(trade)
    cells = (
        f"[{trade.title}](#{anchor(trade)})",
        f"{len(trade.done())} of {len(trade.points)}",
        f"{100 * trade.target:g} %",
        f"{100 * trade.trusted_error(OWN_CHOICE):.2g} %",
        f"{trade.cost(OWN_CHOICE):.2g} s",
        *(f"{summary[f'choice_excess{kind}']:.2f}" for kind in ("", "_at_target")),
    )
    return f"| {' | '.join(cells)} |\n"


def section(name: str, trade: Trade) -> str:
    """Return the chart of a scene, and the errors of a run's choice and of the file as it is."""
    heads = {measure: measure.replace("_", " ") for measure in trade.measures}
    parts = [f"\n## {trade.title}\n\n", f"`examples/{name}.toml`\n\n", WORDS.get(name, "")]
    parts.append(f"![Time against error](images/trade_{name}.png)\n\n")
    for choice in (OWN_CHOICE, AS_FILED):
        if choice in trade.outcomes:
            errors = ", ".join(f"{words} {100 * trade.error(choice, each):.2g} %" for each, words in heads.items())
            memory = trade.outcomes[choice].summary.get(MEMORY, math.nan) / 1e6
            parts.append(f"{choice.capitalize()}: {errors}; {trade.cost(choice):.2g} s, {memory:.0f} MB. ")
    floors = ", ".join(f"{words} {100 * trade.floor[each]:.2g} %" for each, words in heads.items())
    parts.append(f"Uncertainty of the reference: {floors}.\n")
    return "".join(parts)


def page(trades: dict[str, Trade]) -> str:
    """Return the page of the scenes measured."""
    sections = (section(*each) for each in trades.items())
    return "".join([HEAD.format(machine=describe_machine(machine())), *map(line, trades.values()), *sections])


def page_with(name: str, trade: Trade) -> str:
    """Return the page that is there, with the row and the section of one scene anew."""
    mark, text = f"\n## {re.escape(trade.title)}\n", DOCUMENT.read_text(encoding="utf-8")
    text = re.sub(rf"(?m)^\| \[.*\]\(#{anchor(trade)}\).*\n", lambda _: line(trade), text)
    return re.sub(rf"(?s){mark}.*?(?=\n## |\Z)", lambda _: section(name, trade), text)


def main(folder: Path, names: Sequence[str]) -> None:
    """Measure, draw, write; the document grows scene by scene."""
    trades: dict[str, Trade] = {}
    for name in names or SCENES:
        on_lip = name == ON_LIP
        limit = LIMIT_ON_LIP if on_lip else LIMIT
        scene, journal = ROOT / "examples" / f"{name}.toml", folder / f"{name}.jsonl"
        trade = trades[name] = measure_trade(scene, journal, time_limit=limit, quick=on_lip)
        tables = [RESULTS / f"trade_{name}.{ending}" for ending in ("csv", "json")]
        write_trade(trade, *tables)
        for table in tables:  # messages name files by their whole paths
            table.write_text(table.read_text(encoding="utf-8").replace(f"{ROOT}/", ""), encoding="utf-8")
        draw_trade(trade, DOCUMENT.parent / "images" / f"trade_{name}.png")
        write_whole(DOCUMENT, (page_with(name, trade) if names else page(trades)).encode())


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path("trade-charts"), sys.argv[2:])
