"""Files are whole or absent on full disks too; caches cost warnings; folders for results are looked at first."""

import json
import os
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import h5py
import numpy as np
import pytest

import impact
from impact.files.safe_files import OutputError, check_writable, whole_file, write_whole
from impact.storage.hdf5 import USER_BLOCK, OtherKeyError, load_greens, load_results, save_greens, written
from seatfem.machine.code import NOT_NUMERICS, hash_of
from seatfem.structures import cache
from seatfem.structures.cache import Cache, CacheWarning, Store, StoreError, content_key, key_of
from tests.fuzz.mutations import seal
from tests.gallery import load_text, write_scene
from tests.steps import BAD_INPUT, DONE, FAILED, Scene, run_command, seat_of, stated_method

ROOT = Path(__file__).parents[2]
BLOCK = """
seat = { kind = "block", width = "8 mm", depth = "8 mm", thickness = "8 mm", patch_width = "4 mm", \
    patch_depth = "4 mm", material = { young = "200 GPa", density = "7850 kg/m^3" }, \
    mesh = { size = "4 mm", contact_size = "4 mm" }, \
    greens = { bandwidth = "100 kHz", tolerance = 0.05, method = "krylov" } }
"""
BALL = '[reed]\nkind = "rigid_mass"\nmass = "1 g"\nvelocity = "-1 m/s"\n[run]\nduration = "30 us"\n'
SPRING = '[seat]\nkind = "spring"\nstiffness = "1 N/um"\n'
SEAT = impact.single_mode(frequency_hz=1e4, mass=0.01, damping_ratio=0.02)
OTHER = impact.single_mode(frequency_hz=2e4, mass=0.01, damping_ratio=0.02)
KEY = content_key({"seat": "a"})


def seat_key(scene: Scene) -> str:
    return key_of(scene.seat, stated_method(scene).seat)


@pytest.fixture
def tiny_disk(tmp_path: Path) -> Iterator[Path]:
    """Mount a real file system of 64 kB; only root may do so."""
    folder = tmp_path / "disk"
    folder.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", "size=64k", "tmpfs", str(folder)]
    if sys.platform != "linux" or os.geteuid() != 0 or subprocess.run(mount, capture_output=True).returncode:
        pytest.skip("mounting a file system takes root")
    try:
        yield folder
    finally:
        subprocess.run(["umount", str(folder)], check=True)


FULL_DISK = """
import resource, sys
from pathlib import Path
import numpy as np
from impact.storage.hdf5 import written
resource.setrlimit(resource.RLIMIT_FSIZE, (50_000, resource.RLIM_INFINITY))
try:
    with written(sys.argv[1], "greens") as file:
        for k in range(20):
            file[f"a{k}"] = np.random.default_rng(k).random(5000)
except OSError as problem:
    print(problem)
"""


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="limits of POSIX")
def test_hdf5_beyond_the_largest_file_is_one_error(tmp_path: Path) -> None:
    """HDF5 itself prints dozens of tracebacks and crashes."""
    path = tmp_path / "seat.h5"
    save_greens(SEAT, path)
    before = path.read_bytes()
    done = subprocess.run([sys.executable, "-c", FULL_DISK, str(path)], capture_output=True, text=True, timeout=60)
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout == f"[Errno 27] File too large: '{path}'\n"
    assert path.read_bytes() == before
    assert os.listdir(tmp_path) == ["seat.h5"]


@pytest.mark.slow
def test_a_run_onto_a_full_disk_says_one_line(tiny_disk: Path, tmp_path: Path) -> None:
    """The folder can be written to at first; result.h5 does not fit."""
    text = SPRING + BALL.replace('"30 us"', '"2 ms"') + 'time_step = "0.2 us"\n'
    command = [sys.executable, "-m", "seatfem", "run", str(write_scene(tmp_path, text)), "-o", str(tiny_disk / "out")]
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    done = subprocess.run(command, capture_output=True, text=True, timeout=120, env=environment)
    assert done.returncode == FAILED, done.stderr
    path = tiny_disk / "out" / "result.h5"
    remedy = "No space left on device; free space there, or choose another folder (--output)"
    assert done.stderr.splitlines()[-1] == f"seatfem: {path}: {remedy}"
    assert "Traceback" not in done.stderr
    assert not path.exists()
    assert not [name for name in os.listdir(path.parent) if name.startswith(".")]


def test_a_full_disk_is_found_before_anything_is_computed(tiny_disk: Path) -> None:
    (tiny_disk / "filler").write_bytes(bytes(64 << 10))
    with pytest.raises(OutputError, match=r"device\).*free space"):
        check_writable(tiny_disk / "out" / "result.h5")


def test_where_memory_runs_out_the_file_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "a.h5"
    with pytest.raises(MemoryError, match=r"a\.h5: .*memory"), written(path, "x"):
        raise RuntimeError("unable to allocate memory block")  # HDF5's own words
    assert list(tmp_path.iterdir()) == []


def test_an_error_of_the_disk_names_the_file_that_was_meant(tmp_path: Path) -> None:
    def failing() -> None:
        with whole_file(tmp_path / "picture.png") as temporary:
            raise OSError(28, "No space left on device", str(temporary))

    with pytest.raises(OSError, match=r"No space left.*picture\.png"):
        failing()
    write_whole(tmp_path / "under", b"x")
    with pytest.raises(OSError, match=r"File exists: '.*under'"):
        write_whole(tmp_path / "under" / "a", b"x")
    assert [path.name for path in tmp_path.iterdir()] == ["under"]


@pytest.mark.parametrize("verb", ["run", "greens", "modes", "trade"])
def test_a_folder_that_cannot_be_written_to_is_found_first(
    verb: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    runs = [f"seatfem.study.runs.pipeline.{name}" for name in ("cached_plan", "begin_plan", "last_round")]
    for place in (*runs, "seatfem.study.trade.trade.methods_of_rounds", "seatfem.structures.natural_modes.modes_of"):
        monkeypatch.setattr(place, lambda *given, **named: pytest.fail("computed"))
    (tmp_path / "file").write_text("", encoding="utf-8")
    out = tmp_path / "file" / "deep" / "out"
    assert run_command([verb, str(write_scene(tmp_path, BLOCK + BALL)), "-o", str(out), "--quiet"]) == BAD_INPUT
    message = capsys.readouterr().err
    assert re.search(rf"{out}.*\(Not a directory\); choose another place with --output", message)
    assert "Traceback" not in message


def test_looking_leaves_nothing_behind(tmp_path: Path) -> None:
    check_writable(tmp_path / "a" / "b" / "result.h5", "c.h5")
    assert list(tmp_path.iterdir()) == []
    (tmp_path / "result.h5").mkdir()
    with pytest.raises(OutputError, match=r"result\.h5: .*folder"):
        check_writable(tmp_path / "result.h5")


@pytest.mark.slow(but="/proc")
@pytest.mark.filterwarnings("default")
@pytest.mark.parametrize("store", ["a file", "/proc/nowhere", "disk"])
def test_a_cache_that_cannot_be_written_costs_a_warning(
    store: str, tmp_path: Path, request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch, capsys
) -> None:
    folder = tmp_path / "a file"
    if store == "disk":
        folder = request.getfixturevalue("tiny_disk")
        (folder / "filler").write_bytes(bytes(60 << 10))
    elif store == "/proc/nowhere":
        folder = Path(store)
    else:
        folder.write_text("", encoding="utf-8")
    monkeypatch.setenv("SEATFEM_STORE", str(folder))
    out = tmp_path / "seat.h5"
    assert run_command(["greens", str(write_scene(tmp_path, BLOCK + BALL)), "-o", str(out), "--quiet"]) == DONE
    said = capsys.readouterr().err
    assert re.match(rf"warning: the seat is not kept .*{folder}: .*SEATFEM_STORE", said)
    assert len(said.splitlines()) <= 3  # of the seat that the plan looks at, as a whole and in rings, and of the run's
    assert all(line.startswith("warning: the seat is not kept") for line in said.splitlines())
    assert load_greens(out).provenance["seat_key"]


def test_a_user_without_a_home_keeps_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    def homeless() -> Path:
        raise RuntimeError("Could not determine home directory.")

    monkeypatch.delenv("SEATFEM_STORE")
    monkeypatch.delenv("XDG_CACHE_HOME", raising=False)
    monkeypatch.setattr(Path, "home", homeless)
    assert Store.default().get(KEY) is None
    with pytest.raises(StoreError, match="SEATFEM_STORE"):
        Store.default().put(KEY, SEAT)


def test_a_kept_function_carries_key_and_seal(tmp_path: Path) -> None:
    messages: list[str] = []
    store, elsewhere = Store(tmp_path, messages.append), content_key({"seat": "b"})
    path = store.put(KEY, SEAT)
    assert load_greens(path, key=KEY).static_compliance() == pytest.approx(SEAT.static_compliance())
    store.path(elsewhere).write_bytes(path.read_bytes())  # another's function under the right name
    assert store.get(elsewhere) is None
    assert f"belongs to the key '{KEY}'" in messages[-1]
    path.write_bytes(bytes(USER_BLOCK) + path.read_bytes()[USER_BLOCK:])  # the seal taken off
    assert store.get(KEY) is None
    assert "has no seal of its content" in messages[-1]
    with h5py.File(path, "r+") as file:
        file["omega"][...] *= 2
    seal_before = store.put(elsewhere, SEAT).read_bytes()[:USER_BLOCK]
    path.write_bytes(seal_before + path.read_bytes()[USER_BLOCK:])  # other numbers under an old seal
    assert store.get(KEY) is None
    assert "checksum differs" in messages[-1]
    assert len(messages) == 3
    save_greens(OTHER, path)  # sealed, and of no key
    with pytest.raises(OtherKeyError, match="'of nothing'"):
        load_greens(path, key=KEY)
    assert store.get(KEY) is None
    assert load_greens(path).static_compliance() == pytest.approx(OTHER.static_compliance())  # a user's own file


def unsealed(path: Path) -> None:
    with h5py.File(path, "r+") as file:
        file["omega"][...] *= 1.05
    path.write_bytes(bytes(USER_BLOCK) + path.read_bytes()[USER_BLOCK:])


def odd(path: Path) -> None:
    with h5py.File(path, "r+") as file:
        file.attrs["valid_for"] = "long"
    seal(path)


@pytest.mark.slow(but="odd")
@pytest.mark.parametrize("change", [unsealed, odd])
def test_kept_seats_that_were_changed_are_computed_again(change, tmp_path: Path) -> None:
    scene, store, path = load_text(tmp_path, BLOCK + BALL), Store(tmp_path / "store"), tmp_path / "seat.h5"
    first = seat_of(scene, Cache(path, store))
    assert not first.reused
    assert seat_of(scene, Cache(path, store)).reused
    for file in (path, store.path(seat_key(scene))):
        change(file)
    why = "has no seal" if change is unsealed else "could not convert string to float: 'long'"
    with pytest.warns(CacheWarning, match=f"set aside.*: .*{why}"):
        again = seat_of(scene, Cache(path, store))
    assert not again.reused
    t = np.linspace(0, 3e-5, 50)
    assert np.allclose(again.greens.impulse_response(t), first.greens.impulse_response(t), rtol=1e-9)
    assert seat_of(scene, Cache(path, store)).reused


def test_the_key_holds_the_code(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A mended reduction does not serve what the broken one computed; a picture's colour changes nothing."""
    scene = load_text(tmp_path, BLOCK + BALL)
    before = seat_key(scene)
    monkeypatch.setattr(cache, "numerics_version", lambda: "mended")
    assert seat_key(scene) != before
    package = tmp_path / "seatfem"
    for name in ("structures/krylov.py", "pictures/plots.py", "new/room.py", "faces/cli.py"):
        (package / name).parent.mkdir(parents=True, exist_ok=True)
        (package / name).write_text("a = 1\n", encoding="utf-8")
    first = hash_of([package], NOT_NUMERICS)
    changes = {"pictures/plots.py": False, "faces/cli.py": False, "structures/krylov.py": True, "new/room.py": True}
    for name, counts in changes.items():
        (package / name).write_text("a = 2\n", encoding="utf-8")
        code_hash = hash_of([package], NOT_NUMERICS)
        assert (code_hash != first) is counts, name
        first = code_hash
    assert hash_of([tmp_path / "nothing"]) == hash_of([])  # the version of the package
    for name in NOT_NUMERICS:
        assert (ROOT / name).exists(), f"{name}: renamed? Its successor would count"


@pytest.mark.slow
def test_two_runs_at_once_in_one_folder_and_one_cache(tmp_path: Path) -> None:
    """Two real programs in one folder both end well, and what they leave is whole."""
    scene = write_scene(tmp_path, BLOCK + BALL)
    environment = os.environ | {"PYTHONPATH": str(ROOT), "SEATFEM_STORE": str(tmp_path / "store")}
    command = [sys.executable, "-m", "seatfem", "run", str(scene), "-o", str(tmp_path / "out")]
    command += ["--quiet", "--no-pictures", "--rounds", "1"]
    both = [subprocess.Popen(command, env=environment, stderr=subprocess.PIPE, text=True) for _ in range(2)]
    errors = [process.communicate(timeout=300)[1] for process in both]
    assert all(process.returncode in (DONE, FAILED) for process in both)  # whether the target is met is not the point
    assert "Traceback" not in "".join(errors)
    assert json.loads((tmp_path / "out" / "summary.json").read_text(encoding="utf-8"))["impulse_Ns"] > 0
    assert set(load_results(tmp_path / "out" / "result.h5")) >= {"wave", "spring"}
    key = load_greens(tmp_path / "out" / "seat.h5").provenance["seat_key"]
    load_greens(tmp_path / "out" / "seat.h5", key=str(key))
    for entry in Store(tmp_path / "store").entries():
        load_greens(entry.path, key=entry.key)
    assert [path for folder in ("out", "store") for path in (tmp_path / folder).iterdir() if path.name[0] == "."] == []


@pytest.fixture
def read_only(tmp_path: Path) -> Iterator[tuple[Path, list[str]]]:
    """Give a folder without the right to write, and how to start a command that obeys it, even for root."""
    folder = tmp_path / "read only"
    folder.mkdir()
    folder.chmod(0o555)
    bound = [] if os.geteuid() else ["setpriv", "--inh-caps=-all", "--bounding-set=-all"]
    try:
        done = subprocess.run([*bound, "touch", str(folder / "try")], capture_output=True, check=False)
        refused = done.returncode and b"denied" in done.stderr
    except OSError:
        refused = False
    if not refused:
        pytest.skip("nothing here takes root's rights away")
    yield folder, [*bound, sys.executable, "-P", "-m", "seatfem"]
    folder.chmod(0o755)


@pytest.mark.slow
@pytest.mark.own_gmsh
def test_faces_of_a_part_in_a_folder_that_is_read_only(read_only: tuple[Path, list[str]]) -> None:
    """The table is printed; the picture is refused by its own name, with the remedy."""
    folder, program = read_only
    part = str(ROOT / "meshes" / "bar.step")
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    done = subprocess.run([*program, "faces", part], cwd=folder, capture_output=True, text=True, env=environment)
    assert done.returncode == DONE
    assert "contact" in done.stdout
    assert re.search(r"(?m)^note: bar-faces\.png: .*Permission denied.*--output$", done.stdout)
    command = [*program, "faces", part, "-o", "faces.csv"]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, env=environment)
    assert done.returncode == BAD_INPUT
    assert re.search("faces.csv: .*Permission denied", done.stderr)
