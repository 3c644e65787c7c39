"""Files of Green's functions and results: what is read is what was written, and every damage is named."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import fields
from pathlib import Path

import h5py
import numpy as np
import pytest

import impact
from impact.after.result import RunRows
from impact.exact.closed_form import PowerGreens
from impact.files.safe_files import whole_file
from impact.greens.base import ErrorEstimate, GreensFunction
from impact.march.ladder import LadderMarch, finish_march, prepare_levels
from impact.march.prepared import discretise
from impact.runs.solver import collect
from impact.storage.hdf5 import SCHEMA, StorageError, load_greens, load_results, save_greens, save_results
from tests.bounded import bounded
from tests.fuzz.mutations import seal

STEEL = {"young": 200e9, "density": 7850.0, "area": 1e-6}
REED = {"young": 200e9, "density": 7850.0, "length": 25.4e-3, "width": 10e-3, "thickness": 0.305e-3}
TWO_PORTS = impact.ModalGreens(
    np.array([0.0, 1.0, 1e5]),
    np.array([0.0, 0.03, 1.2]),
    np.array([[1.0, 2.0], [0.5, -0.1], [1 / 3, 0.0]]),
    impact.Residual.exponential([[2e-9, 1e-9], [1e-9, 3e-9]], [[0.1, 0.0], [0.0, 0.2]]),
    ("tip", "stop"),
    ErrorEstimate(0.01, None),
    {"dof": 12, "versions": {"numpy": "2"}, "note": "Fl\u00e4che", "nothing": None},
)
KINDS: dict[str, GreensFunction] = {
    "spring": impact.spring(stiffness=3e7),
    "rod": impact.fixed_rod(**STEEL, length=0.03),
    "damped rod": impact.fixed_rod(**STEEL, length=0.03, damping_ratio=0.1),
}


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "seat.h5"
    save_greens(TWO_PORTS, path)
    return path


def assert_same(read: object, written: object) -> None:
    """Compare two results bit for bit, field by field."""
    assert type(read) is type(written)
    for field in fields(written):  # type: ignore[arg-type]
        a, b = getattr(read, field.name), getattr(written, field.name)
        if isinstance(b, np.ndarray):
            assert a.dtype == b.dtype
            np.testing.assert_array_equal(a, b)
        elif isinstance(b, impact.Residual | impact.EnergyLedger | RunRows):
            assert_same(a, b)
        else:
            assert a == b, field.name


@pytest.mark.parametrize("seat", ["spring", "rod", "damped rod"])
def test_results_are_read_as_they_were_written(seat: str, tmp_path: Path) -> None:
    """Results come back bit for bit, with the advice on a step too coarse for its reed, and of several contacts."""
    mass = impact.rigid_mass(mass=1e-3, velocity=-1.0)
    reed = impact.cantilever_reed(**REED, damping_ratio=0.03, n_modes=7, tip_deflection=1e-3)
    target = impact.Body(KINDS[seat])
    fine = impact.solve(impact.ContactProblem(mass, target), dt=1e-7, duration=2e-4)
    coarse = impact.solve(impact.ContactProblem(reed, target), dt=5e-6, duration=8e-4)
    assert fine.force.max() > 0
    assert coarse.advice
    seats = [impact.Contact(target), impact.Contact(KINDS["rod"], gap=1e-6)]
    two = impact.solve(impact.ContactProblem(mass, contacts=seats), dt=1e-7, duration=2e-5)
    assert two.force.shape == (201, 2)
    results = {"wave": fine, "spring": coarse, "several": two}
    save_results(tmp_path / "r.h5", results, {"title": "three", "path": tmp_path})
    read = load_results(tmp_path / "r.h5")
    assert set(read) == set(results)
    for name, written in results.items():
        assert_same(read[name], written)


def test_an_unknown_kind_of_greens_function_has_no_file_form(tmp_path: Path) -> None:
    class Odd(PowerGreens):
        @property
        def provenance(self) -> dict[str, object]:
            return {}

    with pytest.raises(StorageError, match="'Odd' has no file form"):
        save_greens(Odd(1.0, 0.5), tmp_path / "odd.h5")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
def test_what_is_no_such_file_at_all(file: Path, tmp_path: Path) -> None:
    whole = file.read_bytes()
    for kept in (0, len(whole) // 3, len(whole) - 9):
        file.write_bytes(whole[:kept])
        with pytest.raises(StorageError, match=r"seat\.h5: .*damaged"):
            load_greens(file)
    with pytest.raises(StorageError, match=r"absent\.h5: no such file"):
        load_greens(tmp_path / "absent.h5")
    with pytest.raises(StorageError, match="folder"):
        load_greens(tmp_path)  # a folder
    text = tmp_path / "scene.toml"
    text.write_text("title = 'not HDF5'\n" * 100)
    with pytest.raises(StorageError, match=r"scene\.toml:.*\(.*signature"):
        load_greens(text)
    with h5py.File(tmp_path / "other.h5", "w") as other:
        other["x"] = 1.0
    with pytest.raises(StorageError, match=r"other\.h5:.*'something else'.*'greens'"):
        load_greens(tmp_path / "other.h5")


def set_attribute(name: str, value: object) -> Callable[[h5py.File], None]:
    return lambda file: file.attrs.__setitem__(name, value)


def put(dataset: str, index: object, value: float) -> Callable[[h5py.File], None]:
    return lambda file: file[dataset].__setitem__(index, value)


def remove(name: str) -> Callable[[h5py.File], None]:
    return lambda file: (file.attrs if name in file.attrs else file).__delitem__(name)


def shorten(name: str) -> Callable[[h5py.File], None]:
    def act(file: h5py.File) -> None:
        kept = file[name][:-1]
        del file[name]
        file[name] = kept

    return act


def pack(file: h5py.File) -> None:
    """Write 2 GB of ones and zeros in a few million bytes."""
    del file["omega"]
    file.create_dataset("omega", (1 << 28,), "f8", chunks=(1 << 22,), compression="gzip", fillvalue=1.0)
    file["omega"][: 1 << 24] = 0.0


def write_text(file: h5py.File) -> None:
    del file["omega"]
    file["omega"] = [b"abc"]


@pytest.mark.parametrize(
    ("damage", "message"),
    [
        (pack, "omega claims 2.15 GB"),
        (write_text, "no real numbers"),
        *((set_attribute("provenance", text), "damaged") for text in ("[" * 100_000, "1" * 10_000, "[]", "{")),
        (set_attribute("schema", SCHEMA + 1), f"schema {SCHEMA + 1} .*update"),
        (set_attribute("content", "result"), "'result'.*'greens'"),
        (set_attribute("kind", "psychic"), "'psychic'.*modal, sampled, poles, delay_r"),
        (set_attribute("ports", '["tip"]'), "shapes .*1 ports"),
        (remove("kind"), "damaged .*kind"),
        (remove("omega"), "omega .*missing"),
        (shorten("zeta"), r"omega \(3,\), zeta \(2,\)"),
        (put("omega", 1, np.nan), "omega .*finite"),
        (put("omega", 1, -5.0), "omega .*>= 0.*-5"),
        (put("residual/compliance", (0, 1), np.nan), "residual/compliance .*finite"),
    ],
)
def test_damage_is_named(file: Path, damage: Callable[[h5py.File], None], message: str) -> None:
    """Damage is named, and memory is not taken for what a file claims."""
    with h5py.File(file, "r+") as opened:
        damage(opened)
    seal(file)
    with bounded(), pytest.raises(StorageError, match=rf"seat\.h5: .*{message}"):
        load_greens(file)


@pytest.mark.slow
def test_damaged_closed_forms_and_results_are_named(tmp_path: Path) -> None:
    rod = tmp_path / "rod.h5"
    save_greens(KINDS["rod"], rod)
    with h5py.File(rod, "r+") as opened:
        opened.attrs["provenance"] = '{"kind": "delay_rod", "impedance": 1.0}'
    seal(rod)
    with pytest.raises(StorageError, match=r"rod\.h5:.*round_trip"):
        load_greens(rod)
    problem = impact.ContactProblem(impact.rigid_mass(mass=1.0, velocity=-1.0), impact.Body(KINDS["spring"]))
    results = tmp_path / "result.h5"
    save_results(results, {"wave": impact.solve(problem, dt=1e-6, duration=1e-4)}, {})
    with pytest.raises(StorageError, match=r"result\.h5:.*'result'.*'greens'"):
        load_greens(results)
    damages = ((put("wave/force", 3, np.nan), "force .*finite"), (remove("wave/energy/input"), "energy/input"))
    for damage, words in damages:
        with h5py.File(results, "r+") as opened:
            damage(opened)
        seal(results)
        with pytest.raises(StorageError, match=rf"result\.h5: .*{words}"):
            load_results(results)


@pytest.mark.parametrize("error", [RuntimeError, KeyboardInterrupt, SystemExit])
def test_an_interrupted_writer_leaves_the_older_file(error: type[BaseException], tmp_path: Path) -> None:
    path = tmp_path / "deep" / "result.json"

    def write(text: str, fail: bool) -> None:
        with whole_file(path) as temporary:
            assert temporary.parent == path.parent
            assert temporary.suffix == ".json"
            temporary.write_text(text)
            if fail:
                raise error

    with pytest.raises(error):
        write("first", True)
    assert list(path.parent.iterdir()) == []
    write("second", False)
    with pytest.raises(error):
        write("third", True)
    assert [(p.name, p.read_text()) for p in path.parent.iterdir()] == [("result.json", "second")]
    assert path.stat().st_mode & 0o777 == 0o666 & ~umask()


def umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask


WRITER = """
import sys, time
from impact.files.safe_files import whole_file
with whole_file(sys.argv[1]) as temporary:
    temporary.write_text("half")
    print("writing", flush=True)
    for _ in range(1200):  # a signal that comes just before a sleep is seen after it
        time.sleep(0.05)
"""


@pytest.mark.parametrize("sent", [signal.SIGINT, signal.SIGKILL])
def test_a_killed_writer_leaves_no_half_file(sent: signal.Signals, tmp_path: Path) -> None:
    """A hidden temporary file may stay after SIGKILL; the final name holds the older file or none."""
    path = tmp_path / "result.h5"
    path.write_text("older")
    command = [sys.executable, "-c", WRITER, str(path)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True) as process:
        assert process.stdout.readline() == "writing\n"
        start = time.monotonic()
        process.send_signal(sent)
        process.wait(timeout=20)
    assert time.monotonic() - start < 20
    assert path.read_text() == "older"
    names = sorted(p.name for p in tmp_path.iterdir())
    assert names == ["result.h5"] if sent is signal.SIGINT else names[-1] == "result.h5" and names[0].startswith(".")


def in_long_steps() -> impact.ImpactResult:
    """Run a reed on its seat, in steps of several lengths."""
    reed = impact.cantilever_reed(**REED, damping_ratio=0.03, n_modes=7, tip_deflection=1e-4)
    one = discretise(impact.ContactProblem(reed, impact.spring(stiffness=1e6)), 1e-7, 2e-3)
    levels = prepare_levels(one)
    return collect(finish_march(LadderMarch(one, levels)))


def test_steps_of_different_lengths_are_kept_as_they_are(tmp_path: Path) -> None:
    """The file has a row for each step, and gives the same histories; it states schema 2."""
    result = in_long_steps()
    assert len(result.rows.ends) < len(result.time) / 2
    save_results(tmp_path / "r.h5", {"wave": result}, {})
    read = load_results(tmp_path / "r.h5")["wave"]
    assert_same(read, result)
    np.testing.assert_array_equal(read.force, result.force)
    with h5py.File(tmp_path / "r.h5") as file:
        assert file.attrs["schema"] == 2
        assert file["wave/force"].shape == file["wave/ends"].shape == result.rows.ends.shape


@pytest.mark.parametrize("wrong", [-1, 0, 10**12])
def test_ends_of_steps_that_do_not_rise_are_damage(wrong: int, tmp_path: Path) -> None:
    save_results(tmp_path / "r.h5", {"wave": in_long_steps()}, {})
    with h5py.File(tmp_path / "r.h5", "r+") as opened:
        opened["wave/ends"][-1] = wrong
    seal(tmp_path / "r.h5")
    with pytest.raises(StorageError, match=r"r\.h5.*ends of the steps"):
        load_results(tmp_path / "r.h5")
