"""The battery at the extremes: how it judges, resumes and covers; a seeded part of it, and the ends of all axes."""

import json
import math
from collections.abc import Iterator
from contextlib import nullcontext
from dataclasses import replace
from decimal import Decimal
from itertools import combinations, product
from pathlib import Path

import numpy as np
import pytest

from impact import Body, GreensFunctionError, Residual, solve
from seatfem.jobs.crew import Ask, crew
from tests.extremes import (
    Cell,
    Finding,
    Outcome,
    balances,
    battery,
    carry_out,
    draw_map,
    in_words,
    precise,
    read_table,
    runner,
    scenes,
    subset,
    write_counts,
    write_table,
)
from tests.extremes import __main__ as command
from tests.extremes.cell import Price, Standing, judge_price
from tests.extremes.mixed import LEVELS as OF_FILES
from tests.extremes.mixed import REFUSED as REFUSED_FILES
from tests.extremes.mixed import SHORT, random_cells
from tests.extremes.pairwise import covering_array, pairs_of
from tests.extremes.table import MARK, TOGETHER
from tests.extremes.together import LEVELS, REFUSED, Scene, checked, problem_of, together_cells

CELLS = battery()
# seconds each: the chosen ones stand for them
SLOW = ("run length", "energy over", "elements across", "scene file", "Zeno")
CHOSEN = (
    "run length in contact, steps = 100000", "run length in free motion, steps = 1e+06",
    "energy over 1e6 steps, conserving = Hertz, wall", "energy over 1e6 steps, conserving = rigid",
    "energy over 1e6 steps, passive = rigid, 5 modes", "scene file, rod of length = 1 mm",
    "scene file, duration / half swing = 0.001", "scene file, duration / half swing = 1e+08",
    "scene file, impact speed, m/s = 1e-13", "Zeno, restitution = 0.5", "disc, diameter, m = 1e-07",
    "disc, thickness / diameter = 0.1", "flapper, band / 50 kHz = 0.001", "flapper, band / 50 kHz = 0.01",
    "arcs of a lip = 4", "valve spring, stiffness, N/m = 1e-06", "film, viscosity / stopping = 0.5",
    "base, amplitude / gap = 0.4", "base, speed of the seat, m/s = 1", "Hertz, speed, m/s = 1e-09",
    "seat stress, speed, m/s = 1", "life, load ratio = 0.5", "gas, cylinder / suction pressure = 0.5",
    "gas, clearance / swept volume = 0.001", "frf, noise / signal = 0.1",
)  # fmt: skip


def quick(cell: Cell) -> bool:
    return (
        not cell.of_scene_file
        and not cell.axis.startswith(SLOW)
        and (cell.axis != "pairwise" or "modes 3000" not in cell.value)
    )


ENDS = [cell for cell in CELLS if cell.end and quick(cell)]
DRAWN = subset([cell for cell in CELLS if not cell.end and quick(cell)], 30, seed=1)
NAMED = [next(cell for cell in CELLS if cell.name == name) for name in CHOSEN]


@pytest.mark.slow(only=("scene file, rod", "arcs of a lip", "bounces", "gas,", "flapper, band", "frf,", "seat stress"))
@pytest.mark.parametrize("cell", [*NAMED, *ENDS, *DRAWN], ids=lambda cell: cell.name[:70])
def test_no_cell_is_wrong(cell: Cell) -> None:
    outcome = carry_out(cell)
    assert outcome.verdict != "wrong", outcome.reason
    if outcome.verdict == "refused":
        assert len(outcome.reason) > 30, "a refusal says what to do"
    if outcome.verdict in ("warned", "advised") and not cell.of_scene_file:
        assert "limit" in outcome.reason or "above accuracy.target" in outcome.reason, "number and limit"
        remedies = ("use ", "measure ", "start ", "merge ", "shorten ", "write ")
        assert any(word in outcome.reason for word in remedies)


def test_names_are_unique_and_every_axis_has_its_ends() -> None:
    assert len({cell.name for cell in CELLS}) == len(CELLS) > 400
    for axis in {cell.axis for cell in CELLS} - set(TOGETHER):
        assert sum(cell.end for cell in CELLS if cell.axis == axis) >= 2


def broken() -> Finding:
    raise RuntimeError("lost")


def stands(error: float, *, bar: float) -> Finding:
    """Asked for to 1 %, and advised."""
    standing = Standing("impulse", error, bar, 1e-4, 1e-2)
    return Finding(error, standing.stated, ("too coarse",), "", standing)


def refusing() -> Finding:
    raise GreensFunctionError("zeta must be >= 0")


def warning() -> Finding:
    return Finding(float(np.log(np.zeros(1))[0]), 1.0)


@pytest.mark.parametrize(
    ("check", "verdict", "reason"),
    [
        (lambda: Finding(1e-3, 1e-2), "right", ""),
        (lambda: Finding(2e-2, 1e-2), "wrong", ""),
        (lambda: Finding(2e-2, 1e-2, ("too coarse",)), "warned", "too coarse"),
        (lambda: Finding(1e-3, 1e-2, ("too coarse",)), "advised", "too coarse"),
        (lambda: Finding(math.nan, 1e-2, ("too coarse",)), "wrong", "not finite"),
        (lambda: Finding(math.inf, math.inf), "wrong", "not finite"),
        (broken, "wrong", "RuntimeError: lost"),
        (refusing, "refused", "zeta must be >= 0"),
        (warning, "wrong", "RuntimeWarning"),
        (lambda: Finding(float("x"), 1.0), "wrong", "ValueError"),  # not one of ours
        (lambda: stands(2e-2, bar=1e-2), "wrong", "too coarse"),  # advice excuses nothing that has a bar
        (lambda: stands(2e-2, bar=3e-2), "barred", "too coarse"),
        (lambda: stands(9e-3, bar=3e-2), "advised", "too coarse"),
        (lambda: stands(0.9, bar=math.inf), "barred", "too coarse"),
        (lambda: stands(9e-3, bar=math.inf), "advised", "too coarse"),
        (lambda: replace(stands(9e-3, bar=3e-2), too_costly="9 s, above 1 s"), "slow", "9 s"),
        (lambda: replace(stands(2e-2, bar=1e-2), too_costly="9 s, above 1 s"), "wrong", "9 s"),
    ],
)
def test_verdicts(check: object, verdict: str, reason: str) -> None:
    outcome = carry_out(Cell("axis", "1", check))  # type: ignore[arg-type]
    assert outcome.verdict == verdict
    assert reason in outcome.reason


@pytest.mark.slow
def test_covering_array_holds_every_pair_with_few_rows() -> None:
    levels = [5, 4, 3, 3, 2, 2]
    rows = covering_array(levels, seed=3)
    found = set().union(*(pairs_of(row) for row in rows))
    wanted = {
        (a, i, b, j) for a, b in combinations(range(6), 2) for i, j in product(range(levels[a]), range(levels[b]))
    }
    assert found == wanted
    assert 20 <= len(rows) <= 30
    assert rows == covering_array(levels, seed=3)
    few = covering_array(levels, seed=3, excluded={(0, 1, 2, 0), (4, 0, 5, 1)})
    assert set().union(*(pairs_of(row) for row in few)) == wanted - {(0, 1, 2, 0), (4, 0, 5, 1)}
    assert len(together_cells((1,))) < 60 < math.prod(len(v) for v in LEVELS.values())


def test_no_run_of_the_covering_arrays_is_refused_as_a_whole() -> None:
    """A row that is refused would leave its other pairs untested."""
    for cell in together_cells():
        values = {name: getattr(cell.check, name) for name in LEVELS}
        assert not any(values[a] == i and values[b] == j for a, i, b, j in REFUSED)


def test_mixed_scenes_hold_every_pair_and_come_again() -> None:
    """Of the covering array no row is refused as a whole; the long form begins with the short one."""
    mixes = [cell.check for cell in CELLS if cell.axis == "pairs of scene files"]
    axes, pairs = list(OF_FILES), set()
    for mix in mixes:
        assert not any(mix.levels[a] == i and mix.levels[b] == j for a, i, b, j in REFUSED_FILES)
        pairs |= {(a, mix.levels[a], b, mix.levels[b]) for a, b in combinations(axes, 2)}
    wanted = {(a, i, b, j) for a, b in combinations(axes, 2) for i, j in product(OF_FILES[a], OF_FILES[b])}
    for a, i, b, j in REFUSED_FILES:
        wanted -= {(a, i, b, j), (b, j, a, i)}
    assert pairs == wanted
    drawn = [cell.name for cell in CELLS if cell.axis == "random scenes"]
    assert drawn == [cell.name for cell in random_cells(SHORT + 2)][:SHORT]


@pytest.mark.slow(but="9")
@pytest.mark.parametrize("number", [3, 4, 9, 19])
def test_random_scenes_keep_their_balances(number: int) -> None:
    outcome = carry_out(random_cells(number + 1)[number])
    assert outcome.verdict not in ("wrong", "slow"), outcome.reason


@pytest.mark.parametrize(
    ("price", "told"),
    [
        (Price(119.0, 1e9), ""),
        (Price(121.0, 1e9), "121 s, above 120 s"),
        (Price(121.0, 2.1e9), "121 s, above 120 s, 2.1 GB, above 2 GB"),
        (Price(1.0, math.nan), ""),
    ],
)
def test_a_price_is_kept(price: Price, told: str) -> None:
    assert judge_price(price) == told


@pytest.mark.parametrize("x", [0.0, 1e-9, 0.7, 3.0, 1e3, 123456.789, 1e7])
def test_precise_cosine(x: float) -> None:
    c, s = precise.cosine_sine(Decimal(x))
    assert float(c) == pytest.approx(math.cos(x), abs=2e-16)
    assert float(s) == pytest.approx(math.sin(x), abs=2e-16)
    assert abs(c * c + s * s - 1) < Decimal("1e-45")


def test_a_wrong_kernel_is_found() -> None:
    """The oracle of the covering array sees 1e-6 of the frequencies, the exponential of the clinging mass 3 %."""
    scene = Scene(
        step=1e-2, steps=300, speed=1.0, stiffness=1.0, mass=1.0, damping=0.0, modes=3, spacing="harmonic",
        residual="relaxation", gap="closed", law="rigid", rule="passive", ports="one", engine="auto", unit=1.0,
        push=0.0,
    )  # fmt: skip
    assert checked(scene).error <= 1
    problem = problem_of(scene)
    result = solve(problem, dt=scene.step, duration=scene.step * scene.steps, engine=scene.engine)
    force, gap = (np.reshape(a, (len(result.time), -1)) for a in (result.force, result.gap))
    seat = problem.target.greens
    off = Body(replace(seat, omega=seat.omega * (1 + 1e-6)))
    other = replace(problem, contacts=tuple(replace(c, target=off) for c in problem.contacts))
    errors = []
    for known in (problem, other):
        expected, scale = balances.replayed(known, force, scene.step)
        errors.append(float(np.max(np.abs(gap[-len(expected) :] - expected) / scale)))
    assert errors[0] < 1e-12 < errors[1]
    exact = scenes.clinging_force(scenes.modal_rod(5), 1.0, 0.5)
    slow = scenes.modal_rod(5)
    slow = replace(slow, omega=slow.omega * 1.03)
    assert abs(scenes.clinging_force(slow, 1.0, 0.5) / exact - 1) > 1e-4


@pytest.fixture(scope="module")
def one_crew() -> Iterator[Ask]:
    with crew(runner.WORKER) as ask:
        yield ask


@pytest.fixture
def one_worker(one_crew: Ask, monkeypatch: pytest.MonkeyPatch) -> None:
    """The same one for every part of a run: its start takes longer than the cells."""
    monkeypatch.setattr(runner, "crew", lambda *given, **named: nullcontext(one_crew))


@pytest.mark.slow
@pytest.mark.usefixtures("one_worker")
def test_a_run_is_resumed_and_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Outcomes come from the worker once; a cut line and those of other sources are computed again."""
    cells = [c for c in CELLS if c.axis in ("damping ratio", "zero gap")][:4]
    log = tmp_path / "log" / "extremes.jsonl"
    heard: list[float] = []
    first = runner.run_battery(cells[:2], log, progress=lambda _, done: heard.append(done))
    assert {o.verdict for o in first.values()} <= {"right", "advised"}
    assert heard == [0.5, 1.0]
    with log.open("a") as file:
        file.write('{"cell": "' + cells[2].name)  # killed while writing
    second = runner.run_battery(cells, log)
    assert list(second) == [cell.name for cell in cells]
    assert second[cells[0].name] == first[cells[0].name]  # seconds too: not computed again
    assert len([line for line in log.read_text().splitlines() if line.endswith("}")]) == 4
    monkeypatch.setattr(runner, "battery_version", lambda: "another")
    third = runner.run_battery(cells[:1], log)
    assert json.loads(log.read_text().splitlines()[-1])["version"] == "another"
    assert third[cells[0].name].seconds != first[cells[0].name].seconds


@pytest.mark.slow
def test_a_hang_ends_as_an_outcome(tmp_path: Path) -> None:
    """Almost no time: the worker is stopped."""
    cells = [next(c for c in CELLS if c.name == "run length in contact, steps = 1e+06")]
    (outcome,) = runner.run_battery(cells, tmp_path / "log.jsonl", time_limit=1e-3).values()
    assert outcome.verdict == "wrong"
    assert "no end within" in outcome.reason


@pytest.mark.slow
@pytest.mark.usefixtures("one_worker")
def test_a_part_of_the_battery_by_command(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Its table and map in the folder; what is in the log is not computed again, whatever the folder is called."""
    words = ["--folder", str(tmp_path / "new"), "--subset", "2", "--seed", "3"]
    assert command.main(words) == 0
    told = capsys.readouterr().out
    assert told.startswith("2 cells: ")
    assert f"wrote {tmp_path / 'new' / 'extremes.png'}" in told
    assert sorted(path.name for path in (tmp_path / "new").iterdir()) == [
        "extremes.csv",
        "extremes.jsonl",
        "extremes.png",
    ]
    assert len((tmp_path / "new" / "extremes.csv").read_text().splitlines()) == 3
    log = (tmp_path / "new" / "extremes.jsonl").read_text()
    assert command.main(words) == 0
    assert (tmp_path / "new" / "extremes.jsonl").read_text() == log


def test_a_folder_that_cannot_be_written_to_is_found_first(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(runner, "battery_version", lambda: pytest.fail("begun"))
    (tmp_path / "file").write_text("", encoding="utf-8")
    out = tmp_path / "file" / "deep"
    assert command.main(["--folder", str(out), "--subset", "1"]) == 2
    assert f"{out / 'extremes.jsonl'}: cannot be written (Not a directory)" in capsys.readouterr().err


@pytest.mark.slow
def test_table_map_and_words(tmp_path: Path) -> None:
    cells = [
        Cell("a", "1e-07", broken),
        Cell("a", "1", broken),
        *(Cell("pairwise", f"{k:03d}: x", broken) for k in range(30)),
    ]
    outcomes = {c.name: Outcome("right", 1e-3, 1e-2, "impulse", 0.1) for c in cells}
    outcomes[cells[1].name] = Outcome("wrong", math.nan, math.nan, "no end\nwithin 1 s", 1.0)
    write_table(cells, outcomes, tmp_path / "t.csv")
    lines = (tmp_path / "t.csv").read_text().splitlines()
    assert len(lines) == 33
    assert lines[2] == "a,1,wrong,nan,nan,nan,1,,no end within 1 s"
    assert (
        in_words(outcomes).splitlines()[0]
        == "32 cells: 31 right, 0 advised, 0 barred, 0 warned, 0 refused, 0 slow, 1 wrong"
    )
    page = tmp_path / "page.md"
    page.write_text(f"before\n{MARK[0]}\nold\n{MARK[1]}\nafter\n")
    write_counts(cells, outcomes, page)
    text = page.read_text()
    assert text.startswith("before\n")
    assert text.endswith(f"{MARK[1]}\nafter\n")
    assert "| all | 2 | 32 | 31 | 0 | 0 | 0 | 0 | 0 | 1 |" in text
    assert "old" not in text
    draw_map(cells, outcomes, tmp_path / "map.png")
    assert (tmp_path / "map.png").stat().st_size > 5000


@pytest.mark.slow
def test_a_part_renews_its_lines_of_the_table(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """What was not run stays as it is, with the revision that it is of; lines of cells that are gone go."""
    docs, log = tmp_path / "docs", tmp_path / "log.jsonl"
    (docs / "images").mkdir(parents=True)
    (docs / "extremes.md").write_text(f"{MARK[0]}\n{MARK[1]}\n")
    one, other = CELLS[:2]
    known = {name: Outcome("right", 1e-3, 1e-2, "force", 0.5, 2e-2, "old") for name in (one.name, other.name)}
    gone = Cell("a", "1", broken)
    write_table([one, other, gone], known | {gone.name: known[one.name]}, docs / "extremes.csv")
    assert read_table(docs / "extremes.csv")[one.name] == known[one.name]
    found = Outcome("advised", 0.5, 1.0, "", 1.0, 0.25)
    line = {"cell": one.name, "version": "v", **vars(found)}
    log.write_text(
        json.dumps({**line, "version": "u", "error": 9.0}) + "\n" + json.dumps(line) + "\n" + '{"cell": "cut'
    )
    monkeypatch.setattr(command, "DOCS", docs)
    assert command.main(["--log", str(log), "--revision", "new", "--write"]) == 0
    renewed = read_table(docs / "extremes.csv")
    assert renewed == {other.name: known[other.name], one.name: replace(found, revision="new")}
    text = (docs / "extremes.md").read_text()
    assert "By revision of the program: 1 of new, 1 of old." in text
    assert (docs / "images" / "extremes.png").stat().st_size > 5000


@pytest.mark.slow
def test_the_first_blow_by_another_way() -> None:
    """Impulse of equal masses, by energy: what the rod keeps is what the mass has lost."""
    rest = 1 + math.exp(-2) / 2
    leaving = scenes.FIRST_BLOW - 1
    t = np.linspace(0, 2, 200_001)
    s = np.linspace(0, rest, 200_001)
    impulse = np.trapezoid(np.exp(-t), t) + np.trapezoid((2 + math.exp(-2) - 2 * s) * np.exp(-s), s)
    assert impulse == pytest.approx(scenes.FIRST_BLOW, rel=1e-9)
    assert 0 < leaving < 1
    assert Body(scenes.FIXED_ROD).greens.static_compliance()[0, 0] == 1.0
    assert Residual.none().compliance[0, 0] == 0.0
