"""The outcomes as a table (CSV), in words, and as the counts of docs/extremes.md."""

import csv
import io
import math
import statistics
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Final

from impact.files.safe_files import whole_file, write_whole
from tests.extremes.cell import Cell, Outcome, Verdict

VERDICTS: tuple[Verdict, ...] = ("right", "advised", "barred", "warned", "refused", "slow", "wrong")
MEANING: Mapping[Verdict, str] = {
    "right": "right", "advised": "right, with advice", "barred": "off, and the error bar says so",
    "warned": "off, and the advice says so", "refused": "refused, with the reason",
    "slow": "slow or large", "wrong": "off and silent, or broken",
}  # fmt: skip
MARK: Final = "<!-- counts of the extremes -->", "<!-- end of the counts -->"
FILES, MARCH = "Scene files, one number at a time", "Marches and models"
TOGETHER: Final = {"random scenes": "Random scenes"}
"""Axes whose cells change all numbers at once, and what they are called in the page."""


NUMBERS: Final = ("error", "stated", "bar", "seconds")
COLUMNS: Final = ("axis", "value", "verdict", *NUMBERS, "revision", "reason")


def write_table(cells: Sequence[Cell], outcomes: Mapping[str, Outcome], path: Path) -> None:
    """Write a line per cell, of these `COLUMNS`."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(COLUMNS)
    for cell in cells:
        if (o := outcomes.get(cell.name)) is not None:
            numbers = (*(f"{x:.2e}" for x in (o.error, o.stated, o.bar)), f"{o.seconds:.2g}")
            writer.writerow((cell.axis, cell.value, o.verdict, *numbers, o.revision, " ".join(o.reason.split())))
    with whole_file(path) as temporary:
        temporary.write_text(text.getvalue(), encoding="utf-8")


def read_table(path: Path) -> dict[str, Outcome]:
    """Return the outcomes that a table holds, by the names of their cells; none of a table that is not there."""
    if not path.exists():
        return {}
    with path.open(encoding="utf-8", newline="") as file:
        return {
            f"{row['axis']} = {row['value']}": Outcome(
                row["verdict"],
                reason=row["reason"],
                revision=row["revision"],
                **{name: float(row[name]) for name in NUMBERS},
            )
            for row in csv.DictReader(file)
        }


def describe_outcomes(outcomes: Mapping[str, Outcome]) -> str:
    """Tell how many ended how, and every one that is wrong or slow."""
    counts = Counter(o.verdict for o in outcomes.values())
    head = f"{len(outcomes)} cells: " + ", ".join(f"{counts[v]} {v}" for v in VERDICTS)
    lines = [
        f"{o.verdict}: {name}: error {o.error:.2e}, stated {o.stated:.2e}; {o.reason}"
        for name, o in outcomes.items()
        if o.verdict in ("wrong", "slow")
    ]
    return "\n".join([head, *lines])


def write_counts(cells: Sequence[Cell], outcomes: Mapping[str, Outcome], page: Path) -> None:
    """Put the counts of a run between the marks of the page."""
    text = page.read_text(encoding="utf-8")
    before, rest = text.split(MARK[0])
    after = rest.split(MARK[1])[1]
    write_whole(page, f"{before}{MARK[0]}\n\n{counts(cells, outcomes)}\n{MARK[1]}{after}".encode())


def counts(cells: Sequence[Cell], outcomes: Mapping[str, Outcome]) -> str:
    """Return the page's table: how many cells of which kind ended how; and how bars stand."""
    run = [cell for cell in cells if cell.name in outcomes]
    groups: dict[str, list[Outcome]] = {name: [] for name in (MARCH, FILES, *TOGETHER.values())}
    axes: dict[str, set[str]] = {name: set() for name in groups}
    for cell in run:
        kind = group_of(cell)
        groups[kind].append(outcomes[cell.name])
        axes[kind].add(cell.axis)
    lines = [f"| | axes | runs | {' | '.join(MEANING[v] for v in VERDICTS)} |", "|---|" + "---|" * (2 + len(VERDICTS))]
    every = [outcome for group in groups.values() for outcome in group]
    for name, members in (*groups.items(), ("all", every)):
        if members:
            number = Counter(o.verdict for o in members)
            several = len(axes.get(name, ())) or len({cell.axis for cell in run})
            lines.append(f"| {name} | {several} | {len(members)} | {' | '.join(str(number[v]) for v in VERDICTS)} |")
    remaining = f"{len(cells) - len(run)} of {len(cells)} runs are still to be made.\n" if len(run) < len(cells) else ""
    return "\n".join([*lines, "", f"{_standing(every)} {_revisions(every)}", remaining])


def _revisions(outcomes: Sequence[Outcome]) -> str:
    """Return how many outcomes are of which revision of the program."""
    number = Counter(o.revision for o in outcomes if o.revision)
    versions = ", ".join(f"{count} of {revision}" for revision, count in number.most_common())
    return f"By revision of the program: {versions}." if versions else ""


def group_of(cell: Cell) -> str:
    """Return to which group of the page a cell belongs."""
    if cell.axis in TOGETHER:
        return TOGETHER[cell.axis]
    return FILES if cell.of_scene_file else MARCH


def _standing(outcomes: Sequence[Outcome]) -> str:
    """Return how many numbers have error bars, and how much larger these are than the errors."""
    barred = [o for o in outcomes if math.isfinite(o.bar) and math.isfinite(o.error)]
    unknown = sum(math.isinf(o.bar) for o in outcomes)
    ratio = statistics.median([o.bar / max(o.error, 1e-12) for o in barred]) if barred else math.nan
    return (
        f"The worst number has an error bar in {len(barred)} of these runs, with a median of {ratio:.2g} times its "
        f"error; in {unknown} runs the bar is not known."
    )
