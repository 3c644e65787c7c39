"""What is missing or broken on a machine is found, and named with what mends it; how much memory is left."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from impact.names import how_to_mend
from seatfem.machine import doctor
from seatfem.machine import libraries as system
from seatfem.machine.doctor import doctor_report
from seatfem.machine.resources import available_memory

ROOT = Path(__file__).parents[2]


def test_a_missing_library_of_an_extra_is_a_gap_with_its_remedy(monkeypatch: pytest.MonkeyPatch) -> None:
    known = doctor.installed_version
    monkeypatch.setattr(doctor, "_try", lambda code: (True, ""))
    monkeypatch.setattr(doctor, "installed_version", lambda name: "" if name == "plotly" else known(name))
    (found,) = (check for check in doctor_report() if check.name == "extra report")
    assert (found.ok, found.required, found.remedy) == (False, False, "pip install 'seatfem[report]'")
    assert found.detail == "not installed: plotly"


def test_pictures_without_egl_need_osmesa(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("VTK_DEFAULT_OPENGL_WINDOW", raising=False)
    monkeypatch.setattr(system, "_loads", lambda library: False)
    assert "libegl1" in str(system.picture_library_gap())
    monkeypatch.setattr(system, "_loads", lambda library: library.startswith("libOSMesa"))
    assert not system.picture_library_gap()
    monkeypatch.setenv("VTK_DEFAULT_OPENGL_WINDOW", "")
    monkeypatch.delenv("VTK_DEFAULT_OPENGL_WINDOW")
    system.select_offscreen_window()
    assert system.os.environ["VTK_DEFAULT_OPENGL_WINDOW"] == "vtkOSOpenGLRenderWindow"


def test_pictures_without_their_packages(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(system, "PICTURE_PACKAGES", ("matplotlib", "no_such_package"))
    gap = system.picture_library_gap()
    assert re.search(r"no_such_package .*pip install 'seatfem\[pictures\]'", gap)


@pytest.mark.parametrize(
    ("code", "detail"),
    [
        ("import os, signal; os.kill(os.getpid(), signal.SIGSEGV)", "crashed (signal 11)"),
        ("raise ValueError('no')", "ValueError: no"),
        ("raise SystemExit(3)", "exit code 3"),
    ],
)
def test_a_crash_in_a_probe_is_a_finding(monkeypatch: pytest.MonkeyPatch, code: str, detail: str) -> None:
    monkeypatch.setattr(doctor, "GMSH_PROBE", code)
    finding = doctor.check_gmsh()
    assert (finding.ok, finding.detail) == (False, f"gmsh {detail}")


HIDDEN = ("libGL.so.1", "libGLU.so.1", "libEGL.so.1")
HOOK = """
import ctypes
load = ctypes.CDLL
def refused(name, *rest, **options):
    if name in {hidden}:
        raise OSError(f"{{name}}: cannot open shared object file")
    return load(name, *rest, **options)
ctypes.CDLL = refused
"""
"""Where no name space of mounts may be made; processes of their own see the libraries then."""
VERBS = """
import sys
from seatfem.faces.cli import run_command
for number, verb in enumerate({verbs}):
    print(f"exit code {{number}}: {{run_command(verb)}}", flush=True)
"""


def without(libraries: tuple[str, ...], verbs: list[list[str]], **environment: str) -> subprocess.CompletedProcess[str]:
    """Run command lines in an interpreter on a machine that lacks the libraries."""
    code = VERBS.format(verbs=verbs)
    listing = subprocess.run(["/sbin/ldconfig", "-p"], capture_output=True, text=True).stdout if libraries else ""
    paths = [line.split()[-1] for line in listing.splitlines() if line.split()[:1] and line.split()[0] in libraries]
    files = sorted({os.path.realpath(file) for file in paths})
    command = [sys.executable, "-P", "-c", code]
    hide = ["unshare", "-rm", "mount", "--bind", "/dev/null"]  # from a command, where that may be
    if files and shutil.which("unshare") and not subprocess.run([*hide, files[0]], capture_output=True).returncode:
        mounts = "; ".join(f"mount --bind /dev/null {file}" for file in files)
        command = ["unshare", "-rm", "sh", "-c", f'{mounts}; exec "$@"', "sh", *command]
    elif libraries:
        command[-1] = HOOK.format(hidden=libraries) + code
    env = {**os.environ, "PYTHONPATH": str(ROOT), "COLUMNS": "200", **environment}
    return subprocess.run(command, capture_output=True, text=True, env={k: v for k, v in env.items() if v}, timeout=120)


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="system libraries of Linux")
def test_on_a_machine_without_gl_it_says_what_is_missing_and_goes_on_without_meshes(tmp_path: Path) -> None:
    """gmsh cannot be loaded: looks and runs without a mesh are as ever, a mesh ends in one command."""
    drawn, spring = (
        str(ROOT / "examples" / f"{name}.toml") for name in ("flapper_on_annular_seat", "flapper_on_spring")
    )
    out, store = str(tmp_path / "out"), str(tmp_path / "store")
    quick = ["--no-pictures", "--quiet", "--set", "run.duration=0.8 ms"]
    verbs = [["doctor"], ["plan", spring, "--quiet"], ["run", spring, *quick, "-o", out]]
    verbs += [["run", drawn, *quick, "-o", out]]
    done = without(HIDDEN, verbs, SEATFEM_STORE=store)
    assert re.findall(r"exit code \d: (\d)", done.stdout) == ["1", "0", "0", "1"], done
    output = " ".join(done.stdout.replace("│", " ").split())
    assert re.search("off-screen rendering gap .*libEGL", output)
    meshing, run = done.stderr.splitlines()
    command = "apt-get install --no-install-recommends libglu1-mesa libgl1"
    assert re.fullmatch(f"meshing: .*; {command}", meshing)
    assert run.startswith("seatfem: gmsh cannot load a system library")
    assert run.endswith(command)
    assert (tmp_path / "out" / "summary.json").is_file()


@pytest.mark.slow
def test_without_a_home_and_with_nothing_to_write_to(tmp_path: Path) -> None:
    """HOME in a folder that is not there and cannot be made: the cache is a gap with its remedy."""
    (tmp_path / "file").write_text("", encoding="utf-8")
    nowhere = str(tmp_path / "file" / "home")
    done = without((), [["doctor"]], XDG_CACHE_HOME="", SEATFEM_STORE="", HOME=nowhere)
    assert "exit code 0: 0" in done.stdout
    assert done.stderr == ""
    output = " ".join(done.stdout.replace("│", " ").split())
    assert re.search("cache folder gap .*Not a directory", output)
    assert "set SEATFEM_STORE to a folder" in output


RUN = "import sys; from seatfem.faces.cli import run_command; sys.exit(run_command(sys.argv[1:]))"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("code", "reason"),
    [
        ('raise ImportError("libpint.so: cannot open")', "libpint.so: cannot open"),
        ('raise AttributeError("module numpy has no float_")', "module numpy has no float_"),
        ("import no_such_dependency", "No module named 'no_such_dependency'"),
    ],
)
def test_a_broken_package_is_named(code: str, reason: str, tmp_path: Path) -> None:
    """It is no bug of this program, whatever its import raises."""
    (tmp_path / "scene.toml").write_text('[reed]\nkind = "ball"\ndiameter = "1 furlong"\n', encoding="utf-8")
    (tmp_path / "pint").mkdir()
    (tmp_path / "pint" / "__init__.py").write_text(code, encoding="utf-8")
    program = f"import sys; sys.path[:0] = [{str(tmp_path)!r}, {str(ROOT)!r}]; {RUN}"
    command = [sys.executable, "-c", program, "plan", "scene.toml"]
    done = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path)
    assert done.returncode == 1
    message = " ".join(done.stderr.split())
    assert re.search(rf"pint is installed but .*\({reason}\).*: pip install --force-reinstall pint$", message)
    assert "this is a bug" not in message


@pytest.mark.parametrize(
    ("error", "words"),
    [
        (ModuleNotFoundError("No module named 'pandas'", name="pandas"), "pandas .*not installed.*install .*with"),
        (ModuleNotFoundError("No module named 'dateutil'", name="dateutil"), "pandas .*'tables'.* installed but"),
        (ImportError("x"), r"pandas .*'tables'.* installed but .*\(x\)"),
    ],
)
def test_what_is_absent_is_installed_and_what_is_broken_anew(error: ImportError, words: str) -> None:
    assert re.match(words, how_to_mend("pandas", "tables", error))


MB = 1 << 20
WITHOUT_LIMIT = 9223372036854771712  # as version 1 writes it


def pretended(root: Path, groups: str, files: dict[str, str]) -> Path:
    """Return a folder that looks like the /proc and /sys of a system."""
    for name, text in {"proc/self/cgroup": groups, **files}.items():
        path = root / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="ascii")
    return root


def test_version_2_the_groups_limit_less_its_use(tmp_path: Path) -> None:
    group = "sys/fs/cgroup/user.slice/job"
    root = pretended(
        tmp_path,
        "0::/user.slice/job\n",
        {f"{group}/memory.max": f"{300 * MB}\n", f"{group}/memory.current": f"{120 * MB}\n"},
    )
    assert available_memory(root) == 180 * MB
    (root / group / "memory.stat").write_text(f"anon {70 * MB}\ninactive_file {50 * MB}\n", encoding="ascii")
    assert available_memory(root) == 230 * MB  # cached files give way
    (root / group / "memory.high").write_text(f"{200 * MB}\n", encoding="ascii")
    assert available_memory(root) == 130 * MB  # beyond it the system slows the group down to a halt
    (root / group / "memory.current").write_text(f"{400 * MB}\n", encoding="ascii")
    assert available_memory(root) == 0.0


TOP, V1 = "sys/fs/cgroup/pod", "sys/fs/cgroup/memory"


@pytest.mark.parametrize(
    ("groups", "files", "left"),
    [
        (
            "0::/pod/one\n",
            {
                "/memory.max": 100 * MB, "/memory.current": 40 * MB,
                "/one/memory.max": "max", "/one/memory.current": 10 * MB,
            },
            60 * MB,
        ),
        (
            "12:cpu,cpuacct:/docker/1\n4:memory:/docker/1\n0::/init\n",
            {
                "/docker/1/memory.limit_in_bytes": 500 * MB, "/docker/1/memory.usage_in_bytes": 150 * MB,
                "/docker/1/memory.stat": f"inactive_file 1\ntotal_inactive_file {30 * MB}",
                "/memory.limit_in_bytes": WITHOUT_LIMIT, "/memory.usage_in_bytes": 900 * MB,
            },
            380 * MB,
        ),
    ],
    ids=["a group around ours", "version 1"],
)  # fmt: skip
def test_the_least_of_all_groups_counts(groups: str, files: dict[str, object], left: int, tmp_path: Path) -> None:
    top = TOP if groups.startswith("0") else V1
    assert (
        available_memory(pretended(tmp_path, groups, {f"{top}{name}": f"{text}\n" for name, text in files.items()}))
        == left
    )


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="limits of the address space, as Linux keeps them")
def test_the_limit_of_the_address_space(tmp_path: Path) -> None:
    """A real one: what is left is the limit less what is mapped, and allocating much more than that does fail."""
    program = """
import resource, sys
import numpy as np
from seatfem.machine.resources import available_memory
mapped = int(open("/proc/self/statm").read().split()[0]) * resource.getpagesize()
resource.setrlimit(resource.RLIMIT_AS, (mapped + (200 << 20), resource.RLIM_INFINITY))
left = available_memory()
np.ones(int(0.8 * left / 8))
try:
    np.ones(int(1.2 * left / 8))
except MemoryError:
    print(left)
"""
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert float(done.stdout) == pytest.approx(200 * MB, rel=0.1)  # importing and measuring map a little
