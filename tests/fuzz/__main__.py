"""`python -m tests.fuzz [--cases N] [--seed S] [--folder F] [--again]`: mutated files, their verdicts, the table."""

import argparse
import signal
import sys
from pathlib import Path

from seatfem.faces.cli import run_command

from .corpus import build
from .plan import cases
from .runner import run_cases
from .table import in_words, write_table
from .trial import PASSED

RESULTS = Path(__file__).parents[2] / "benchmarks" / "results"


def main() -> int:
    given = _arguments()
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))  # the process at work is ended too
    folder = Path(given.folder).resolve()
    corpus = folder / "corpus"
    specimens = build(corpus)
    _warm_up(corpus, folder)
    log = folder / f"log-{given.seed}.jsonl"
    if given.cheap:
        specimens = tuple(specimen for specimen in specimens if specimen.cheap)
    chosen = cases(specimens, given.cases, given.seed, only=given.only)
    if given.again and log.exists():
        _forget_defects(log)
    verdicts = run_cases(chosen, corpus, folder / "work", log, _tell)
    if given.write:
        write_table(chosen, verdicts, RESULTS / "fuzz.csv")
    _tell(in_words(chosen, verdicts))
    return 0 if all(verdict.word in PASSED for verdict in verdicts.values()) else 1


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cases", type=int, default=12_000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--folder", default="fuzz", help="of corpus, log and the case at work")
    parser.add_argument("--only", default="", help="part of the names of the specimens")
    parser.add_argument("--cheap", action="store_true", help="without gmsh and plans")
    parser.add_argument("--again", action="store_true", help="carry out again what was a defect")
    parser.add_argument("--write", action="store_true", help="the table benchmarks/results/fuzz.csv")
    return parser.parse_args()


def _warm_up(corpus: Path, folder: Path) -> None:
    """Loops compiled once, before limits of memory and time stand."""
    for name in ("rod-area", "greens-modal", "matrices.npz"):
        run_command(["greens", str(corpus / name / "scene.toml"), "-o", str(folder / "warm" / f"{name}.h5"), "--quiet"])
    run_command(["run", str(corpus / "spring-reed" / "scene.toml"), "-o", str(folder / "warm" / "run"), "--quiet"])


def _forget_defects(log: Path) -> None:
    kept = [
        line for line in log.read_text(encoding="utf-8").splitlines() if any(f'"word": "{p}"' in line for p in PASSED)
    ]
    log.write_text("".join(f"{line}\n" for line in kept), encoding="utf-8")


def _tell(text: str) -> None:
    sys.stdout.write(text + "\n")
    sys.stdout.flush()


if __name__ == "__main__":
    sys.exit(main())
