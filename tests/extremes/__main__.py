"""The battery and its table: `python -m tests.extremes`, with the options below.

The whole battery, and with --write any part of it, renews its lines of docs/extremes.csv and the counts in
docs/extremes.md; other parts write a table into the folder. A run that was stopped goes on where it was.
"""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from impact.files.safe_files import OutputError

from . import battery, describe_outcomes, random_cells, read_table, run_battery, subset, write_counts, write_table
from .runner import MOST_RANDOM

DOCS = Path(__file__).parents[2] / "docs"


def main(words: Sequence[str] | None = None) -> int:
    """Return the exit code 0: no cell is wrong; 1: some are; 2: the folder cannot be written to."""
    given = _arguments(words)
    whole = given.write or (given.subset is None and given.random is None and not given.only)
    cells = battery() if given.random is None else random_cells(min(given.random, MOST_RANDOM))
    cells = tuple(cell for cell in cells if not given.only or cell.name.startswith(tuple(given.only)))
    if given.subset is not None:
        cells = subset(cells, given.subset, seed=given.seed)
    table = DOCS / "extremes.csv" if whole else given.folder / "extremes.csv"
    try:
        log = given.folder / "extremes.jsonl"
        outcomes = run_battery(cells, log, cluster=given.cluster, workers=given.workers, progress=_bar)
    except OutputError as error:
        sys.stderr.write(f"{error}\n")
        return 2
    if whole:
        outcomes = {**read_table(table), **outcomes}
        more = [cell for cell in random_cells(MOST_RANDOM) if cell.name in outcomes]
        cells = tuple({cell.name: cell for cell in (*battery(), *more)}.values())
        outcomes = {cell.name: outcomes[cell.name] for cell in cells if cell.name in outcomes}
        write_counts(cells, outcomes, DOCS / "extremes.md")
    write_table(cells, outcomes, table)
    sys.stdout.write(f"{describe_outcomes(outcomes)}\nwrote {table}\n")
    return 1 if any(outcome.verdict == "wrong" for outcome in outcomes.values()) else 0


def _arguments(words: Sequence[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m tests.extremes", description=__doc__)
    parser.add_argument("--folder", type=Path, default=Path("extremes"), help="of the log, and of a subset's table")
    parser.add_argument("--subset", type=int, help="only so many cells, drawn at random")
    parser.add_argument("--only", nargs="+", default=[], help="only cells whose names begin so")
    parser.add_argument("--write", action="store_true", help="renew the lines of these cells in docs/")
    parser.add_argument("--random", type=int, help=f"random scenes alone, {MOST_RANDOM} at most: the long form")
    parser.add_argument("--workers", type=int, default=1, help="processes that carry out cells")
    parser.add_argument("--seed", type=int, default=0, help="of the draw")
    parser.add_argument("--cluster", help="address of a scheduler of dask, whose workers find these tests")
    return parser.parse_args(words)


def _bar(stage: str, done: float) -> None:
    sys.stderr.write(f"\r{100 * done:3.0f} %  {stage:<60.60}" + "\n" * (done >= 1.0))
    sys.stderr.flush()


if __name__ == "__main__":
    sys.exit(main())
