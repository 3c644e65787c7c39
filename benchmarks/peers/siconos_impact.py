"""Siconos (Debian's python3-siconos), a program for nonsmooth dynamics, on the modes of a reduced seat."""

from __future__ import annotations

import subprocess
import tempfile
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from benchmarks.peers.calculix import PeerError
from benchmarks.peers.impact_scene import DURATION, MASS, SPEED, STIFFNESS, Array, Course

NAME, PYTHON = "Siconos", "/usr/bin/python3"
PROGRAM = Path(__file__).with_name("siconos_program.py")


def absent() -> str:
    """Why this peer cannot be asked; "" where it can."""
    try:
        asked = subprocess.run([PYTHON, "-c", "import siconos.kernel"], capture_output=True, check=False)
    except OSError:
        return f"there is no {PYTHON}"
    return f"{PYTHON} has no module siconos (Debian: apt-get install python3-siconos)" if asked.returncode else ""


@dataclass(frozen=True)
class Impact:
    """Mass [kg], closing speed [m/s], stiffness of the law [N/m] and duration [s]; those of all peers unless stated."""

    mass: float = MASS
    speed: float = SPEED
    stiffness: float = STIFFNESS
    duration: float = DURATION


def march(omega: Array, shares: Array, steps: tuple[float, ...], impact: Impact = Impact()) -> list[Course]:
    """By the theta rule in each of ``steps`` [s], on undamped modes with the patch's ``shares`` in their shapes."""
    with tempfile.TemporaryDirectory() as folder:
        asked, answer = Path(folder) / "asked.npz", Path(folder) / "answer.npz"
        np.savez(asked, omega=omega, shares=shares, steps=np.array(steps), **asdict(impact))
        command = [PYTHON, str(PROGRAM), str(asked), str(answer)]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        if done.returncode:
            raise PeerError(f"{NAME} fails with {done.returncode}: {done.stderr[-1000:]}")
        with np.load(answer) as found:
            rows = [found[name] for name in found.files]
    return [Course(row[1:], dt, float(row[0])) for row, dt in zip(rows, steps, strict=True)]
