"""`python -m tests.extremes [--folder F] [--subset N] [--seed S] [--cluster ADDRESS]`: the battery, its table, its map.

The whole battery rewrites docs/extremes.csv and docs/images/extremes.png; a subset writes both into the folder. A run
that was stopped goes on where it was.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from impact.files.atomic import OutputError
from impact.pictures.drawing import gap_of

from . import battery, draw_map, in_words, run_battery, subset, write_table

DOCS = Path(__file__).parents[2] / "docs"


def main(words: Sequence[str] | None = None) -> int:
    """Exit code 0: no cell is wrong; 1: some are; 2: the folder cannot be written to."""
    given = _arguments(words)
    whole = given.subset is None
    cells = battery() if whole else subset(battery(), given.subset, seed=given.seed)
    table = DOCS / "extremes.csv" if whole else given.folder / "extremes.csv"
    picture = DOCS / "images" / "extremes.png" if whole else given.folder / "extremes.png"
    try:
        outcomes = run_battery(cells, given.folder / "extremes.jsonl", cluster=given.cluster, progress=_bar)
    except OutputError as error:
        sys.stderr.write(f"{error}\n")
        return 2
    write_table(cells, outcomes, table)
    gap = gap_of(lambda path: draw_map(cells, outcomes, path), picture)
    told = (in_words(outcomes), f"wrote {table}", f"note: {gap}" if gap else f"wrote {picture}")
    sys.stdout.write("\n".join(told) + "\n")
    return 1 if any(outcome.verdict == "wrong" for outcome in outcomes.values()) else 0


def _arguments(words: Sequence[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m tests.extremes", description=__doc__)
    parser.add_argument("--folder", type=Path, default=Path("extremes"), help="of the log, and of a subset's table")
    parser.add_argument("--subset", type=int, help="only so many cells, drawn at random")
    parser.add_argument("--seed", type=int, default=0, help="of the draw")
    parser.add_argument("--cluster", help="address of a scheduler of dask, whose workers find these tests")
    return parser.parse_args(words)


def _bar(stage: str, done: float) -> None:
    sys.stderr.write(f"\r{100 * done:3.0f} %  {stage:<60.60}" + "\n" * (done >= 1.0))
    sys.stderr.flush()


if __name__ == "__main__":
    sys.exit(main())
