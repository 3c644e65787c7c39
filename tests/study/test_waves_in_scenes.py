"""Scenes with endless rods, incoming waves, chains and strain gauges: against d'Alembert, and what is refused."""

import csv
import json
import math

import numpy as np
import pytest

from tests.gallery import load_text
from tests.steps import SceneError, run_scene

ROD = """kind = "rod"
young = "200 GPa"
density = "8000 kg/m^3"
area = "300 mm^2"
"""
SPEED = 5000.0
WAVE = (
    f'\ncontact = {{ law = {{ kind = "rough_joint", force = "60 kN", closure = "20 um", recovery = 0.5 }} }}\n'
    f'run = {{ duration = "350 us" }}\naccuracy = {{ landing = "run", measures = ["impulse", "gauge_strain"] }}\n'
    f'[seat]\n{ROD}\nlength = "1 m"\nfar_end = "endless"\n[reed]\n{ROD}\nlength = "1 m"\nfar_end = "endless"\n'
    f'[[wave]]\nof = "seat"\npeak = -1e-3\nrise = "10 us"\nduration = "60 us"\nrecorded_at = "500 mm"\n[[gauge]]\n'
    f'name = "first"\nof = "seat"\nat = "500 mm"\n[[gauge]]\nname = "second"\nof = "reed"\nat = "250 mm"\n'
)
CHAIN = (
    f'\nrun = {{ duration = "400 us", time_step = "0.2 us" }}\naccuracy = {{ landing = "run" }}\n[stopper]\n{ROD}\n'
    f'length = "200 mm"\nfar_end = "free"\nvelocity = "-10 m/s"\nat = "1 m"\ngap = "0 mm"\n[reed]\n{ROD}\n'
    f'length = "1 m"\nfar_end = "free"\n[seat]\n{ROD}\nlength = "1 m"\nfar_end = "endless"\n[[gauge]]\n'
    f'name = "middle"\nof = "reed"\nat = "400 mm"\n[[gauge]]\nname = "last"\nof = "seat"\nat = "500 mm"\n[[gauge]]\n'
    f'name = "striker"\nof = "stopper"\nat = "100 mm"\n'
)


def run(text, folder):
    run_scene(load_text(folder, text), folder / "out", pictures=False)
    with (folder / "out" / "gauges.csv").open() as file:
        heads, *rows = csv.reader(file)
    columns = np.array(rows, dtype=float).T
    return json.loads((folder / "out" / "summary.json").read_text()), dict(zip(heads, columns, strict=True))


@pytest.mark.slow
def test_a_wave_comes_is_passed_on_and_seen(tmp_path):
    """The first gauge sees it as it was stated, and what the joint throws back 200 us later, the integral of which is
    half the closure that stays over c; the second one what is passed on."""
    summary, seen = run(WAVE, tmp_path)
    time, first, second = seen["time [s]"], seen["first [m/m]"], seen["second [m/m]"]
    coming = -1e-3 * np.interp(time, [0, 10e-6, 60e-6, 70e-6], [0, 1, 1, 0])
    np.testing.assert_allclose(first[time < 190e-6], coming[time < 190e-6], atol=1e-15)
    assert summary["gauge_first_smallest_strain"] == pytest.approx(-1e-3, rel=1e-9)
    assert summary["gauge_first_largest_strain"] == first.max() > 1e-4
    assert summary["peak_gauge_strain"] == pytest.approx(1e-3, rel=1e-9)
    assert summary["error_bar_gauge_first_largest_strain"] < 0.01 * first.max()
    dt = time[1] - time[0]
    back, on = float(np.sum(first[time > 190e-6])) * dt, float(np.sum(second)) * dt
    # what is not passed on comes back, but for what the joint gives way in the 50 us between both looks at it
    assert on == pytest.approx(-6e-8 + back, rel=2e-4)
    closure = (1e-3 * 200e9 * 300e-6 / 60e3) ** 0.5 * 20e-6  # at the plateau's force
    assert back == pytest.approx(0.5 * closure / (2 * SPEED), rel=0.015)  # it still creeps
    assert summary["seat_static_stiffness_N_per_m"] == pytest.approx(200e9 * 300e-6, rel=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize("slip", [1.0, 1.03])
def test_a_striker_drives_a_chain(slip, tmp_path):
    """Both bars see v/(2c) for 2 l/c, each later by its way, and the striker for as long less its ways."""
    summary, seen = run(CHAIN, tmp_path)
    time, strain = seen["time [s]"], -10.0 / (2 * SPEED)
    agrees = []
    for name, arrives, leaves in (
        ("middle", 120e-6, 200e-6), ("last", 300e-6, 380e-6), ("striker", 20e-6, 60e-6)
    ):  # fmt: skip
        expected = np.where((time > arrives) & (time < leaves), strain * slip, 0.0)
        steady = (np.abs(time - arrives) > 1e-6) & (np.abs(time - leaves) > 1e-6)  # rigid ends part within a step
        agrees.append(np.allclose(seen[f"{name} [m/m]"][steady], expected[steady], atol=1e-9))
    assert agrees == [slip == 1.0] * 3
    assert summary["stopper_impulse_Ns"] == pytest.approx(8000 * 300e-6 * 0.2 * 10, rel=1e-6)


def test_a_gauge_on_a_beam_sees_its_bending(tmp_path):
    """A lasting force at the tip has the strain 6 F (l - x)/(E b h^2)."""
    text = '[seat]\nkind = "spring"\nstiffness = "1 kN/m"\n[reed]\nkind = "cantilever"\nlength = "20 mm"\n'
    text += 'release = { tip_deflection = "1 mm" }\n[run]\nduration = "0.1 ms"\n'
    gauge = '[[gauge]]\nname = "root"\nof = "reed"\nat = "5 mm"\n'
    scene = load_text(tmp_path, text + gauge)
    reed, force = scene.reed, np.full(3, 2.0)
    held = reed.body()
    held = type(held)(held.greens)
    strain = reed.strain_at(scene.gauge[0].at, force, 1e-7, held)
    exact = 6 * 2.0 * 0.015 / (200e9 * 0.01 * 0.000305**2)
    np.testing.assert_allclose(np.abs(strain), exact, rtol=1e-6)
    assert not np.allclose(np.abs(strain), 1.03 * exact, rtol=1e-2)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('far_end = "endless"\n[reed]', 'far_end = "fixed"\n[reed]', "wave.0.of:.*endless"),
        ("peak = -1e-3", "", "wave.0.strain: nothing"),
        ('rise = "10 us"\n', "", "wave.0.rise: required"),
        ('rise = "10 us"', 'rise = "80 us"', "wave.0.rise:.*trapezoid"),
        ("peak = -1e-3", "peak = -0.2", "wave.0.peak"),
        ('peak = -1e-3\nrise = "10 us"\nduration = "60 us"', 'strain = "wave.csv"', "give times that count from"),
        ('name = "second"', 'name = "first"', "gauge.1.name: 'first'"),
        ('at = "1 m"', 'at = "900 mm"', "stopper.at:.*undamped"),
        ('at = "400 mm"', 'at = "1.2 m"', "gauge.0.at"),
        ('velocity = "-10 m/s"', "", "reed.velocity: required"),
        ('velocity = "-10 m/s"', 'force = "1 N"', "stopper.force"),
        ('of = "reed"\nat = "250', 'of = "stopper"\nat = "250', r"gauge.1.of:.*\[stopper\]"),
    ],
)
def test_impossible_waves_gauges_and_chains_are_refused(old, new, words, tmp_path):
    (tmp_path / "wave.csv").write_text("time [us],strain [um/m]\n-300,0\n-200,-900\n0,-900\n")
    text = WAVE if old in WAVE else CHAIN
    assert old in text
    with pytest.raises(SceneError, match=words):
        load_text(tmp_path, text.replace(old, new, 1))


def test_other_bodies_have_no_gauges(tmp_path):
    body = '[reed]\nkind = "rigid_mass"\nmass = "1 g"\nvelocity = "-1 m/s"\n'
    text = '[seat]\nkind = "spring"\nstiffness = "1 kN/m"\n' + body + '[run]\nduration = "0.1 ms"\n'
    for of in ("reed", "seat"):
        with pytest.raises(SceneError, match=r"gauge.0.at: .*(rigid mass|spring)"):
            load_text(tmp_path, f'{text}[[gauge]]\nname = "root"\nof = "{of}"\nat = "5 mm"\n')


def test_a_wave_from_a_file_is_that_of_the_file(tmp_path):
    (tmp_path / "wave.csv").write_text("time [us],strain [um/m]\n0,0\n20,-900\n40,0\n")
    given = 'peak = -1e-3\nrise = "10 us"\nduration = "60 us"'
    scene = load_text(tmp_path, WAVE.replace(given, 'strain = "wave.csv"'))
    moved = scene.wave[0].incoming(SPEED).outwards(np.array([0.0, 1.0]))
    np.testing.assert_allclose(moved, [0.0, 2 * SPEED * 900e-6 * 20e-6], rtol=1e-12)
    assert scene.seat.wave_speed == pytest.approx(math.sqrt(200e9 / 8000))
