"""Available memory: the least of the machine's, the control groups' and the address space's."""

import subprocess
import sys
from pathlib import Path

import pytest

from seatfem.machine.resources import available_memory

MB = 1 << 20
WITHOUT_LIMIT = 9223372036854771712  # as version 1 writes it


def system(root: Path, groups: str, files: dict[str, str]) -> Path:
    """Return a folder that looks like the /proc and /sys of a system."""
    for name, text in {"proc/self/cgroup": groups, **files}.items():
        path = root / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="ascii")
    return root


def test_version_2_the_groups_limit_less_its_use(tmp_path: Path) -> None:
    group = "sys/fs/cgroup/user.slice/job"
    root = system(
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
        available_memory(system(tmp_path, groups, {f"{top}{name}": f"{text}\n" for name, text in files.items()}))
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
