"""Verdicts counted by specimen and mutation."""

import csv
from collections import Counter, defaultdict
from collections.abc import Mapping, Sequence
from pathlib import Path

from impact.files.safe_files import whole_file

from .trial import PASSED, Case, Verdict

HEAD = ("file", "mutation", "seed", "cases", *PASSED, "defects", "seconds", "slowest_s", "most_memory_MB")


def write_table(cases: Sequence[Case], verdicts: Mapping[str, Verdict], path: Path) -> None:
    """One row for every specimen and mutation."""
    groups: defaultdict[tuple[str, str, int], list[Verdict]] = defaultdict(list)
    for case in cases:
        groups[f"{case.specimen.name}/{case.specimen.target}", case.mutation, case.seed].append(verdicts[case.name])
    with whole_file(path) as temporary, temporary.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(HEAD)
        for key, found in sorted(groups.items()):
            words = Counter(verdict.word for verdict in found)
            passed = [words[word] for word in PASSED]
            seconds = [verdict.seconds for verdict in found]
            most = max(verdict.peak for verdict in found) / 1e6
            counts = (len(found), *passed, len(found) - sum(passed))
            writer.writerow((*key, *counts, f"{sum(seconds):.2f}", f"{max(seconds):.2f}", f"{max(most, 0.0):.0f}"))


def in_words(cases: Sequence[Case], verdicts: Mapping[str, Verdict]) -> str:
    """Totals, and every defect."""
    words = Counter(verdict.word for verdict in verdicts.values())
    lines = [f"{len(cases)} cases: " + ", ".join(f"{count} {word}" for word, count in words.most_common())]
    for case in cases:
        verdict = verdicts[case.name]
        if verdict.word not in PASSED:
            lines.append(f"{verdict.word}: {case.name} ({verdict.seconds:g} s): {verdict.said.strip()}")
    return "\n".join(lines)
