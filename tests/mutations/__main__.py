"""Which tests find 300 errors of the product: `make test` has to find four fifths of what all tests find.

    python -m tests.mutations record     all tests once: which lines each executes, in build/mutations
    python -m tests.mutations run        each error in a copy of the checkout, until a test fails: a row of
                                         benchmarks/results/mutations.csv; goes on with those that have none
    python -m tests.mutations table      the shares that were found

An error is tried with the tests that execute its line: those of `make test`, then the others, each time of its own
room first. Tests that march stand in for compiled loops, tests that execute a line of the same file for what runs once.
"""

import csv
import io
import json
import os
import shutil
import subprocess
import sys
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict
from itertools import accumulate
from pathlib import Path
from queue import SimpleQueue
from typing import Any, Final

import coverage

from impact.files.safe_files import write_whole
from tests.mutations.drawing import GROUPS, ROOT, Mutation, draw_lot, draw_mutations

FOLDER: Final = ROOT / "build" / "mutations"
TABLE: Final = ROOT / "benchmarks" / "results" / "mutations.csv"
TIERS: Final = {"test": False, "test-all": True}
"""The make targets, and whether the tests are slow that are tried for each."""
LONGEST: Final = 30.0  # s of the tests that are tried of a tier, as recorded: the cheapest ones
PATIENCE: Final = 900.0  # s after which an error that hangs is found
ONE_THREAD: Final = dict.fromkeys(
    ("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS"), "1"
)
ROOMS: Final = (
    "faces",
    "jobs",
    "machine",
    "pictures",
    "structures",
    "study",
)  # folders of the product and of its tests
STEPPER: Final = "impact/march/stepper.py"  # which runs the compiled loops
COMPILED: Final = ("impact/march/loop/", "impact/march/laws.py")


def record_lines() -> None:
    """Run all tests once, and keep which lines each executes."""
    shutil.rmtree(FOLDER, ignore_errors=True)
    FOLDER.mkdir(parents=True)
    environment = os.environ | ONE_THREAD | {"MUTATIONS_FOLDER": str(FOLDER), "PYTHONPATH": str(ROOT)}
    command = [sys.executable, "-m", "pytest", "-n", "auto", "--dist", "worksteal", "-p", "tests.mutations.recorder"]
    subprocess.run(command, cwd=ROOT, env=environment, check=False)
    merged = coverage.Coverage(data_file=str(FOLDER / "coverage"), config_file=False)
    merged.combine([str(FOLDER)])
    merged.save()


class Record:
    """Lines that tests execute, and by test what it takes [s] and whether it is slow."""

    def __init__(self) -> None:
        self.lines = coverage.CoverageData(str(FOLDER / "coverage"))
        self.lines.read()
        self.tests: dict[str, tuple[float, bool]] = {}
        for path in FOLDER.glob("tests.*.json"):
            self.tests |= json.loads(path.read_text(encoding="utf-8"))

    def choose_tests(self, mutation: Mutation, are_slow: bool) -> list[str]:
        """Return the tests of one tier that may find an error: its own room and the cheapest first."""
        is_compiled = mutation.file.startswith(COMPILED[0])
        line = self.lines.contexts_by_lineno(str(ROOT / mutation.file)).get(mutation.line, ())
        tests = set() if is_compiled else set(line) & self.tests.keys()
        tests = tests or self._tests_near(ROOT / (STEPPER if is_compiled else mutation.file))
        room = next(part for part in (*Path(mutation.file).parts[1:], "") if part in ROOMS or not part)

        def rank(test: str) -> tuple[bool, float]:
            return not test.startswith(f"tests/{room or mutation.file.partition('/')[0]}/"), self.tests[test][0]

        ranked = sorted((test for test in tests if self.tests[test][1] == are_slow), key=rank)
        spent = accumulate(self.tests[test][0] for test in ranked)
        return [test for test, until in zip(ranked, spent, strict=True) if until < LONGEST]

    def _tests_near(self, file: Path) -> set[str]:
        """Return the tests that execute a file or, where none does, one of its folder, or of the folder above."""
        for place in (file, *file.parents):
            inside = [each for each in self.lines.measured_files() if Path(each).is_relative_to(place)]
            by_line = [contexts for each in inside for contexts in self.lines.contexts_by_lineno(each).values()]
            if tests := {test for contexts in by_line for test in contexts} & self.tests.keys():
                return tests
        return {*self.tests}


def run_mutations(workers: int) -> None:
    """Try each error that has no row in the table yet."""
    record, rows = Record(), read_rows()
    copies: SimpleQueue[Path] = SimpleQueue()
    for number in range(workers):
        copies.put(_copy_checkout(FOLDER / f"copy-{number}"))
    drawn = draw_mutations()
    rows = {mutation: rows[mutation] for mutation in drawn if mutation in rows}
    waiting = sorted(set(drawn) - rows.keys(), key=draw_lot)
    with ThreadPoolExecutor(workers) as pool:
        for mutation, row in zip(
            waiting, pool.map(lambda each: _try_mutation(each, record, copies), waiting), strict=True
        ):
            rows[mutation] = row
            write_rows(rows[each] for each in drawn if each in rows)
            sys.stdout.write(f"{row['found_by']:9} {row['file']}:{row['line']}: {row['old']} -> {row['new']}\n")
            sys.stdout.flush()


def _copy_checkout(copy: Path) -> Path:
    shutil.rmtree(copy, ignore_errors=True)
    files = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True, check=True).stdout.split("\n")
    for name in filter(None, files):
        if (ROOT / name).is_file():
            (copy / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(ROOT / name, copy / name)
    return copy


def _try_mutation(mutation: Mutation, record: Record, copies: SimpleQueue[Path]) -> dict[str, Any]:
    """Return the mutation as a row, with the target that found it ("" for none) and the test."""
    copy = copies.get()
    before = mutation.apply(copy)
    try:
        for target, are_slow in TIERS.items():
            if test := _failing_test(copy, record.choose_tests(mutation, are_slow), mutation):
                return asdict(mutation) | {"found_by": target, "test": test}
        return asdict(mutation) | {"found_by": "", "test": ""}
    finally:
        (copy / mutation.file).write_bytes(before)
        copies.put(copy)


def _failing_test(copy: Path, tests: Sequence[str], mutation: Mutation) -> str:
    """Return the first test that fails, "" where none does."""
    if not tests:
        return ""
    arguments = copy / "tests.txt"
    arguments.write_text("\n".join(tests), encoding="utf-8")
    compiled = copy / "compiled-sound"
    if mutation.file.startswith(COMPILED):  # numba's cache must not keep the code with the error
        shutil.rmtree(compiled := copy / "compiled-wrong", ignore_errors=True)
    environment = os.environ | ONE_THREAD | {"PYTHONPATH": str(copy), "NUMBA_CACHE_DIR": str(compiled)}
    command = [sys.executable, "-B", "-m", "pytest", "-x", "-p", "no:cacheprovider", f"@{arguments}"]
    try:
        done = subprocess.run(
            command, cwd=copy, env=environment, capture_output=True, text=True, timeout=PATIENCE, check=False
        )
    except subprocess.TimeoutExpired:
        return "none ended in time"
    if done.returncode == 0:
        return ""
    failed = [line for line in done.stdout.splitlines() if line.startswith(("FAILED ", "ERROR "))]
    return failed[0].split(" ")[1] if failed else "the tests do not begin"


def read_rows() -> dict[Mutation, dict[str, str]]:
    """Return what was found so far."""
    with TABLE.open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    numbers = ("line", "offset")
    return {
        Mutation(**{key: int(row[key]) if key in numbers else row[key] for key in Mutation.__dataclass_fields__}): row
        for row in rows
    }


def write_rows(rows: Iterable[Mapping[str, Any]]) -> None:
    """Write the table."""
    text = io.StringIO()
    writer = csv.DictWriter(text, [*Mutation.__dataclass_fields__, "found_by", "test"], lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    write_whole(TABLE, text.getvalue().encode())


def print_shares() -> None:
    """Say how many errors were found, and how many of these by the tests of `make test`."""
    rows = list(read_rows().values())
    for group in (*GROUPS, ""):
        counts = Counter(row["found_by"] for row in rows if group in ("", row["group"]))
        total = counts["test"] + counts["test-all"]
        share = counts["test"] / max(total, 1)
        sys.stdout.write(f"{group or 'all':9} {total} of {counts.total()} found, {share:.0%} of these by make test\n")


if __name__ == "__main__":
    match sys.argv[1:]:
        case ["record"]:
            record_lines()
        case ["run", *workers]:
            run_mutations(int(workers[0]) if workers else 2)
        case ["table"]:
            print_shares()
        case _:
            sys.exit(__doc__)
