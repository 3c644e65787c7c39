"""
A measured seat
===============

A measured seat: the impulse response of a rod, noisy, in a CSV file, is read, checked, repaired and struck.

The rod, fixed at its far end, is as heavy as the mass that strikes it. Undamped, the contact lasts 3.068 l/c
(Saint-Venant); here modal damping of 3 % is added, and `impact.fixed_rod` gives the exact answer to compare with.
"""
# sphinx_gallery_thumbnail_path = "docs/images/scenes/measured_seat.png"

from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

import impact
from impact.greens.passivity import passivity, repair
from impact.measured.frf import read_impulse_response
from impact.pictures.drawing import sheet

YOUNG, DENSITY, AREA, LENGTH = 2e11, 7850.0, 1e-4, 0.1
TRANSIT = LENGTH / (YOUNG / DENSITY) ** 0.5  # l/c
DT = TRANSIT / 100
rod = impact.fixed_rod(young=YOUNG, density=DENSITY, area=AREA, length=LENGTH, damping_ratio=0.03)


def hammer_test(path: Path) -> None:
    """g at 0 ... 4 l/c with 5 % of noise, as a data logger would write it."""
    time = DT * np.arange(401)
    noise = 0.05 * np.random.default_rng(5).normal(size=time.size)
    g = rod.impulse_response(time) + noise * float(rod.initial_value()[0, 0])
    rows = [f"{1e6 * t:.6f},{1e6 * v:.6g}" for t, v in zip(time, g, strict=True)]
    path.write_text("\n".join(["time [us],impulse_response [um/(N s)]", *rows]), encoding="utf-8")


def kept_energy(greens: impact.GreensFunction) -> float:
    """Share of its energy that the mass has when the contact is over, before the record ends."""
    striker = impact.rigid_mass(mass=DENSITY * AREA * LENGTH, velocity=-1.0)
    result = impact.solve(impact.ContactProblem(striker, impact.Body(greens)), dt=DT, duration=399.5 * DT)
    assert 3.0 < impact.measures.contact_intervals(result)[-1][1] / TRANSIT < 3.2
    assert result.energy.target.min() >= -1e-9 * result.energy.input[0]  # the seat never gives what it did not get
    return float(result.energy.striker[-1] / result.energy.input[0])


with TemporaryDirectory() as folder:
    hammer_test(Path(folder) / "seat.csv")
    seat = read_impulse_response(Path(folder) / "seat.csv")

before = passivity(seat, seat.dt)
mended = repair(seat)  # DT and its multiples
after = passivity(mended, mended.dt)
print(f"before: {before}")
print(f"after:  {after}")
assert not before.passive
assert after.passive

exact, measured, repaired = (kept_energy(greens) for greens in (rod, seat, mended))
done = mended.provenance["repair"]
assert isinstance(done, dict)
print(f"largest change of g: {done['change_of_peak']:.1%} of its peak")
print(f"share of the energy kept by the mass: exact {exact:.4f}, as measured {measured:.4f}, repaired {repaired:.4f}")
assert abs(repaired / exact - 1) < 0.02

with sheet("measured_seat.png", 6.4, 3.4) as figure:
    axes = figure.add_subplot(xlabel="time [µs]", ylabel="g [µm/(N s)]", title="Green's function of a rod")
    times = DT * np.arange(401)
    for name, greens, style in (("measured", seat, "."), ("repaired", mended, "-"), ("exact", rod, "--")):
        axes.plot(1e6 * times, 1e6 * greens.impulse_response(times).ravel(), style, markersize=2, label=name)
    axes.legend()
