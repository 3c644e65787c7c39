"""`python -m tests.fuzz [--trials N] [--seed S] [--folder F] [--write]`: damaged files, their fate."""

import argparse
import csv
import signal
import sys
from collections import defaultdict
from collections.abc import Mapping
from pathlib import Path
from typing import Final

from impact.files.safe_files import whole_file

from .samples import build, warm_up
from .trials import PASSED, Verdict, run_trials, trials_of

TABLE: Final = Path(__file__).parents[2] / "benchmarks" / "results" / "fuzz.csv"
HEAD: Final = ("file", "seed", "cases", *PASSED, "defects", "seconds", "slowest_s", "most_memory_MB")


def main() -> int:
    """Carry out what the arguments ask for; return 1 where a defect was found."""
    given = _arguments()
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))  # the process at work is ended too
    folder = Path(given.folder).resolve()
    samples = {name: each for name, each in build(folder / "samples").items() if given.only in name}
    if given.cheap:
        samples = {name: each for name, each in samples.items() if each.share >= 1 and each.read != "draw"}
    warm_up(folder / "samples", folder / "warm")
    verdicts = run_trials(trials_of(samples, given.trials, given.seed), folder, _tell)
    if given.write:
        _write(verdicts)
    defects = sum(verdict.word not in PASSED for verdict in verdicts.values())
    _tell(f"{len(verdicts)} trials, {defects} defects")
    return int(defects > 0)


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--trials", type=int, default=3000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--folder", default="fuzz", help="of samples, log and the trial at work")
    parser.add_argument("--only", default="", help="part of the names of the samples")
    parser.add_argument("--cheap", action="store_true", help="without gmsh and plans")
    parser.add_argument("--write", action="store_true", help="the table benchmarks/results/fuzz.csv")
    return parser.parse_args()


def _write(verdicts: Mapping[str, Verdict]) -> None:
    """Write one row for every sample."""
    groups: defaultdict[tuple[str, str], list[Verdict]] = defaultdict(list)
    for trial, verdict in verdicts.items():
        name, _, _, seed = trial.split(" ")
        groups[name, seed].append(verdict)
    with whole_file(TABLE) as temporary, temporary.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(HEAD)
        for key, ended in sorted(groups.items()):
            passed = [sum(verdict.word == word for verdict in ended) for word in PASSED]
            times = [verdict.seconds for verdict in ended]
            numbers = f"{sum(times):.2f}", f"{max(times):.2f}", f"{max(verdict.peak for verdict in ended) / 1e6:.0f}"
            writer.writerow((*key, len(ended), *passed, len(ended) - sum(passed), *numbers))


def _tell(text: str) -> None:
    sys.stdout.write(f"{text}\n" if text else "")
    sys.stdout.flush()


if __name__ == "__main__":
    sys.exit(main())
