"""Speed for accuracy of a tilted landing along the lip: docs/trade_landing.md with its picture and tables.

Run: python benchmarks/trade_of_landing.py [journal; default: trade-landing.jsonl]
A run that was stopped goes on where it was. It takes ten minutes.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Final

from table import RESULTS, machine
from trade_charts import ROOT, Charted, line, section

from impact.files.atomic import whole_file
from seatfem.study.trade.chart import draw_trade
from seatfem.study.trade.table import write_trade
from seatfem.study.trade.trade import measure_trade

NAME: Final = "tilted_landing"
DOCUMENT: Final = ROOT / "docs" / "trade_landing.md"
LIMIT: Final = 40.0  # processor seconds for a point: the reference takes more than a minute
HEAD: Final = """# Speed for accuracy of a tilted landing

Written by `python benchmarks/trade_of_landing.py`. Measured on {machine}.
[Speed for accuracy](trade.md) says what the ladder, the errors and the star are; here it is a third of the ladder
(`--quick`), with {limit:g} processor seconds for a point. The file states 96 arcs of the lip and the step; the planner
chooses both. One port (the mean of the lip, over the mean of the gap) and a beam (of the plate's widths, at the
paddle's centre) stand in place of arcs and plate, on the centre's seat: they tell no force per length, so that they are
on the fronts of the other two measures at most. Of the seat's other levels none is struck along a lip, nor is a column.

| scene | points | target | planner's error | planner's time | excess over the front | over the cheapest at target | \
over the front with guesses |
|---|---|---|---|---|---|---|---|
"""


def main(journal: Path) -> None:
    """Measure, draw, write."""
    trade = measure_trade(ROOT / "examples" / f"{NAME}.toml", journal, time_limit=LIMIT, quick=True)
    tables = [RESULTS / f"trade_{NAME}.{ending}" for ending in ("csv", "json")]
    write_trade(trade, *tables)
    for table in tables:  # messages name files by their whole paths
        table.write_text(table.read_text(encoding="utf-8").replace(f"{ROOT}/", ""), encoding="utf-8")
    draw_trade(trade, DOCUMENT.parent / "images" / f"trade_{NAME}.png")
    words, charted = "; ".join(f"{key} {value}" for key, value in machine().items()), Charted(NAME, trade)
    with whole_file(DOCUMENT) as temporary:
        text = HEAD.format(machine=words, limit=LIMIT) + line(charted) + section(charted)
        temporary.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path("trade-landing.jsonl"))
