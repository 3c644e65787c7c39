"""A record of a mass on a bar whose joint, mesh and step are other than those of the fit, of known values."""

from pathlib import Path

import numpy as np
import scipy

import impact
from impact.files.csv_table import write_csv

TRUE = {
    "contact.law.closure": 8.0,  # um at 4 kN
    "contact.law.recovery": 0.7,
    "reed.velocity": -1.0,  # m/s
    "seat.damping_ratio": 0.03,
    "delay": 3.0,  # us
}
NOISE = 40.0  # N, of a peak of 2900 N
STEP = 1e-7
LASTS = 200e-6
ELEMENTS, KNOTS = 200, 96
SCENE = """
reed = { kind = "rigid_mass", mass = "60 g", velocity = "-1 m/s" }
seat = { kind = "rod", young = "206 GPa", density = "7800 kg/m^3", area = "100 mm^2", length = "200 mm", \
    damping_ratio = 0.02 }
contact = { gap = "20 um", law = { kind = "rough_joint", force = "4 kN", closure = "8 um", recovery = 0.9 } }
run = { duration = "200 us", time_step = "0.5 us", filter_width = "5 us" }
"""
RECORD = (
    '\nscene = "mass_on_bar.toml"\n[[record]]\nname = "force"\nfile = "force.csv"\nkind = "force"\nnoise = "40 N"\n'
    '[fit]\ncontact.law.closure = { start = "15 um", from = "2 um", to = "40 um", name = "closure" }\n'
    "contact.law.recovery = { start = 0.9, from = 0.2, to = 1.0 }\n"
    'reed.velocity = { start = "-1.2 m/s", from = "-2 m/s", to = "-0.5 m/s" }\n'
    "seat.damping_ratio = { start = 0.01, from = 0.002, to = 0.2 }\n"
    'delay = { start = "0 us", from = "-10 us", to = "10 us" }\n'
)


def meshed_bar(elements: int = ELEMENTS) -> impact.ModalGreens:
    """Return the bar, by linear elements whose mass cancels their first error in frequency."""
    length, stiffness, mass = 0.2 / elements, 206e9 * 1e-4, 7800.0 * 1e-4
    k = stiffness / length * np.array([[1.0, -1.0], [-1.0, 1.0]])
    m = mass * length / 12 * np.array([[5.0, 1.0], [1.0, 5.0]])
    whole = np.zeros((2, elements + 1, elements + 1))
    for first in range(elements):
        part = slice(first, first + 2)
        whole[:, part, part] += [k, m]
    squares, shapes = scipy.linalg.eigh(whole[0, :-1, :-1], whole[1, :-1, :-1])
    damping = np.full(elements, TRUE["seat.damping_ratio"])
    return impact.ModalGreens(np.sqrt(squares), damping, shapes[:1].T.copy(), impact.Residual.none(1))


def joint_by_table() -> impact.TableJoint:
    """Return the joint, of straight pieces, on loading and unloading branches with the fit's law between them."""
    closures = 1.6 * TRUE["contact.law.closure"] * 1e-6 * np.linspace(0, 1, KNOTS + 1) ** 1.5
    forces = 4e3 * (closures / (TRUE["contact.law.closure"] * 1e-6)) ** 2
    recovery = TRUE["contact.law.recovery"]
    back = closures[-1] * (1 - recovery) + recovery * closures
    rows = np.sort(np.concatenate([closures[1:-1], back]))
    return impact.TableJoint(
        tuple(rows), tuple(np.interp(rows, closures, forces)), tuple(np.interp(rows, back, forces))
    )


def true_record() -> tuple[np.ndarray, np.ndarray]:
    """Return times [s] and forces [N] without noise, as the record has them: late by the delay."""
    striker = impact.rigid_mass(mass=0.06, velocity=TRUE["reed.velocity"])
    problem = impact.ContactProblem(striker, meshed_bar(), gap=20e-6, law=joint_by_table())
    result = impact.solve(problem, dt=STEP, duration=LASTS)
    time = np.arange(1e-6, 0.95 * LASTS, 2e-6)
    return time, np.interp(time - TRUE["delay"] * 1e-6, result.time[1:] - STEP / 2, result.force[1:])


def noise(count: int, seed: int, correlation: float = 0.0) -> np.ndarray:
    """Return standard noise, that of neighbours with this correlation."""
    draws = np.random.default_rng(seed).standard_normal(count)
    for k in range(1, count):
        draws[k] = correlation * draws[k - 1] + np.sqrt(1 - correlation**2) * draws[k]
    return draws


def write_files(folder: Path, time: np.ndarray, force: np.ndarray, record: str = RECORD, scene: str = SCENE) -> Path:
    """Write scene, record file and record; return the record file."""
    (folder / "mass_on_bar.toml").write_text(scene, encoding="utf-8")
    path = folder / "record.toml"
    path.write_text(record, encoding="utf-8")
    write_csv(folder / "force.csv", ["time [us]", "force [N]"], np.column_stack([1e6 * time, force]).tolist())
    return path
