"""What `decisions` found, as tables: what the planner said against what is true, the wrong ones, plan against front."""

from __future__ import annotations

import csv
import math
from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path
from statistics import median
from typing import TYPE_CHECKING, Final

from decision_options import BY_USER, DECISIONS, LADDERS
from table import write_between

if TYPE_CHECKING:
    from decisions import Judged, Record

PRICE: Final = 1.3  # of the time of the chosen option over that of the cheaper one that was enough, which is allowed
CAUTIOUS: Final = 0.1  # of the scenes, in which more may be paid
FRONT, WORST_FRONT = 1.3, 3.0  # of the plan's time over that of the cheapest point: median and worst that are aimed at
START: Final = 1.4  # s of processor time of a process that only imports what a run needs
LONG: Final = 1.0  # s that the cheapest point takes, from which on planning is no large part
Pair = tuple["Record", "Judged"]


def is_courage(record: Record, each: Judged) -> bool:
    """Whether the plan said that something is enough which is not; one that says it will miss has promised nothing."""
    missed = bool(each.chosen) and each.chosen_change > record.target and record.promised
    return missed or (each.said_enough and bool(each.cheaper) and not each.enough)


def is_caution(record: Record, each: Judged) -> bool:
    """Whether the plan said that something is not enough which is."""
    return each.enough and not each.said_enough


def price(each: Judged) -> float:
    """Return the time with the chosen option over that with the cheaper one; nan where either is not known."""
    return each.seconds / each.cheaper_seconds if each.cheaper_seconds > 0 else math.nan


def costs_more(each: Judged) -> bool:
    """Whether wrong caution cost more than `PRICE`, or nobody knows what."""
    return not price(each) <= PRICE


def judged_pairs(records: Sequence[Record], decision: str, *, by_plan: bool = True) -> list[Pair]:
    """Return each scene with its decision of a kind."""
    pairs = ((record, each) for record in records for each in record.decisions)
    return [pair for pair in pairs if (pair[1].decision, pair[1].by_plan) == (decision, by_plan)]


def _counts(pairs: Sequence[Pair]) -> tuple[int, int, int, int]:
    """Statements: enough rightly and wrongly, not enough rightly and wrongly."""
    right, wrong, needed, needless = 0, 0, 0, 0
    for record, each in pairs:
        if each.chosen:
            courage = each.chosen_change > record.target and record.promised
            right, wrong = right + (each.chosen_change <= record.target), wrong + courage
            needed += each.chosen_change > record.target and not record.promised
        if each.cheaper:
            right += each.said_enough and each.enough
            wrong += each.said_enough and not each.enough
            needed += not each.enough and not each.said_enough
            needless += is_caution(record, each)
    return right, wrong, needed, needless


def table(records: Sequence[Record]) -> Iterator[str]:
    """Yield the decisions of the planner as a table in Markdown."""
    yield (
        "| decision | scenes | enough, rightly | enough, wrongly | not enough, rightly | not enough, wrongly | "
        f"price of these: median, largest | price above {PRICE:g}: scenes | seconds lost | goal |"
    )
    yield "|---|---|---|---|---|---|---|---|---|---|"
    for decision in DECISIONS:
        pairs = judged_pairs(records, decision)
        if decision in BY_USER or not pairs:
            continue
        cautious = [each for record, each in pairs if is_caution(record, each)]
        known = [price(each) for each in cautious if math.isfinite(price(each))]
        more = sum(map(costs_more, cautious))
        lost = sum(max(0.0, each.seconds - each.cheaper_seconds) for each in cautious if math.isfinite(price(each)))
        counts = _counts(pairs)
        prices = f"{median(known):.2f}, {max(known):.2f}" if known else ""
        costly = f"{more} ({more / len(pairs):.0%})"
        met = counts[1] == 0 and more <= CAUTIOUS * len(pairs)
        yield (
            f"| {decision} | {len(pairs)} | {' | '.join(map(str, counts))} | {prices} | {costly} | "
            f"{lost:.0f} | {'met' if met else 'missed'} |"
        )


def users_table(records: Sequence[Record]) -> Iterator[str]:
    """Yield what the scene states, and what the other choice would have changed."""
    yield "| stated by the scene | scenes | the cheaper one would have been enough | its change: median, largest |"
    yield "|---|---|---|---|"
    for decision in DECISIONS:
        pairs = [pair for pair in judged_pairs(records, decision, by_plan=False) if pair[1].cheaper]
        if pairs:
            changes = [each.cheaper_change for _, each in pairs]
            enough = sum(each.enough for _, each in pairs)
            largest = "no value" if math.isinf(max(changes)) else f"{max(changes):.2g}"
            yield f"| {decision} | {len(pairs)} | {enough} | {median(changes):.2g}, {largest} |"


def wrong_ones(records: Sequence[Record]) -> Iterator[str]:
    """Yield each wrong courage as a list."""
    wrong = [(record, each) for record in records for each in record.decisions if each.by_plan]
    wrong = [(record, each) for record, each in wrong if is_courage(record, each)]
    if not wrong:
        yield "No scene has a wrong courage."
    for record, each in wrong:
        yield f"- {_scene(record)}: {each.decision}, {_wrong_words(record, each)}"


def _scene(record: Record) -> str:
    target = "" if math.isnan(record.target) else f", target {record.target:.1%}"
    return f"{record.index} {record.seat}, {record.reed} ({record.about}){target}"


def _wrong_words(record: Record, each: Judged) -> str:
    if not (each.chosen and each.chosen_change > record.target):
        return f"{each.cheaper} is said to be enough and changes {each.measure} by {each.cheaper_change:.2g}"
    words = f"{each.chosen} changes {each.measure} by {each.chosen_change:.1%}"
    if each.final:
        return f"{words}; the run found it and ended with {each.final} ({each.final_change:.1%})"
    if record.met is False:
        return f"{words}; the run states that it misses the target"
    return f"{words}; the run states that it meets the target"


def fronts_table(records: Sequence[Record]) -> Iterator[str]:
    """Yield the plan's time against that of the cheapest point that meets the target, as a table."""
    fronts = [record.front for record in records if record.front is not None]
    known = [front for front in fronts if front.meeting]
    points = sum(front.points for front in fronts)
    yield f"{len(fronts)} scenes have a grid, {points} points in all; in {len(known)} one meets the target in truth."
    yield ""
    yield (
        "| plan over the cheapest point: median, worst | scenes | both with the start of the program | point with its "
        "error bars | seat, reed and march of the point alone |"
    )
    yield "|---|---|---|---|---|"
    groups = {
        "all": known,
        f"the point takes {LONG:g} s or more": [front for front in known if front.seconds >= LONG],
        "it takes less": [front for front in known if front.seconds < LONG],
    }
    for name, group in groups.items():
        if group:
            kinds = (
                [(front.plan_seconds + START) / (front.seconds + START) for front in group],
                [front.ratio for front in group],
                [front.bare_ratio for front in group],
            )
            yield f"| {name} | {len(group)} | {' | '.join(map(_ratios, kinds))} |"
    planned = [record for record in records if record.front is not None and record.planning_seconds > 0]
    if planned:
        share = median(record.planning_seconds / record.run_seconds for record in planned)
        yield ""
        yield f"Planning takes {share:.0%} of the plan's time (median of {len(planned)} of these scenes)."


def _ratios(values: Sequence[float]) -> str:
    """Median and worst, and whether that is what is aimed at."""
    met = median(values) <= FRONT and max(values) <= WORST_FRONT
    return f"{median(values):.3g}, {max(values):.3g} ({'met' if met else 'missed'})"


def ends(records: Sequence[Record]) -> str:
    """Return how the scenes ended, in words."""
    counts = Counter(record.outcome for record in records)
    by_plan = [each for record in records for each in record.decisions if each.by_plan]
    states = sum(2 if each.decision in LADDERS and each.chosen and each.cheaper else 1 for each in by_plan)
    minutes = sum(record.seconds for record in records) / 60
    return (
        f"{len(records)} scenes: {', '.join(f'{number} {outcome}' for outcome, number in counts.most_common())}. "
        f"{len(by_plan)} decisions of the planner, {states} statements; {minutes:.0f} min of processor time."
    )


def unjudged(records: Sequence[Record]) -> Iterator[str]:
    """Yield the scenes that were not judged, and why."""
    for record in records:
        if record.outcome != "judged":
            yield f"- {_scene(record)}: {record.outcome}, {record.reason}"


def summary(records: Sequence[Record]) -> str:
    """Return all of it."""
    parts = [ends(records), "", *table(records), "", *users_table(records), "", *wrong_ones(records), ""]
    return "\n".join([*parts, *fronts_table(records), "", "Not judged:", *unjudged(records)])


def document(records: Sequence[Record], csv_file: Path, page: Path) -> None:
    """Write the table as CSV, and all of it between the marks of a page."""
    with csv_file.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(HEADS)
        writer.writerows(_row(record, each) for record in records for each in record.decisions)
    parts = [ends(records), "", *table(records), "", *wrong_ones(records), "", *users_table(records), ""]
    parts += ["### Plan against front", "", *fronts_table(records)]
    write_between(page, "decisions", "\n".join(["", *parts, ""]))


OF_THE_SCENE: Final = ("seed", "index", "seat", "reed", "about", "target", "promised", "met")
OF_THE_CHOICE: Final = ("decision", "by", "chosen", "chosen_change", "cheaper", "cheaper_change", "enough")
OF_THE_PRICE: Final = ("said_enough", "measure", "seconds", "cheaper_seconds", "final", "final_change", "verdict")
HEADS: Final = (*OF_THE_SCENE, *OF_THE_CHOICE, *OF_THE_PRICE)


def _row(record: Record, each: Judged) -> list[str]:
    """One line of the table, by its columns."""
    verdict = "courage" if is_courage(record, each) else "caution" if is_caution(record, each) else "right"
    own = {"by": "plan" if each.by_plan else "scene", "verdict": verdict if each.by_plan else ""}
    values = ({**vars(record), **vars(each), **own}[name] for name in HEADS)
    return [("" if math.isnan(v) else f"{v:.3g}") if isinstance(v, float) else str(v) for v in values]
