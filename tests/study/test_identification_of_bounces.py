"""Keys fitted to records of short pulses, which have no slope to each other where they miss; and the step's part."""

import numpy as np
import pytest

import impact
from impact.files.csv_table import write_csv
from seatfem.structures.cache import Cache
from seatfem.study.identify.fit import identify
from tests.steps import load_scene, problem_of, seat_of, striker_of
from tests.study.identification_truth import noise

SCENE = """
seat = { kind = "spring", stiffness = "5 N/um" }
reed = { kind = "cantilever", length = "25.4 mm", thickness = "0.305 mm", damping_ratio = 0.03, n_modes = 20, \
    release = { tip_deflection = "1 mm" } }
contact = { gap = "0.05 mm" }
run = { duration = "2 ms", time_step = "0.5 us", filter_width = "5 us" }
"""
NOISE = 0.3  # N, of peaks of 15 N
FINE = 5e-8  # a tenth of the fit's step
FITS = {
    "contact.gap": (0.05, 'start = "0.07 mm", from = "0.02 mm", to = "0.2 mm"'),
    "reed.damping_ratio": (0.03, "start = 0.05, from = 0.005, to = 0.1"),
    "reed.thickness": (0.305, 'start = "0.31 mm", from = "0.25 mm", to = "0.4 mm"'),
}


@pytest.fixture(scope="module")
def bounces(tmp_path_factory):
    """Give times [s] and forces [N] of a reed that bounces on its seat, at a fine step."""
    path = tmp_path_factory.mktemp("bounces") / "reed.toml"
    path.write_text(SCENE, encoding="utf-8")
    scene = load_scene(path, {"run.time_step": "0.05 us"})
    problem = problem_of(scene, striker_of(scene), impact.Body(seat_of(scene, Cache(None)).greens))
    result = impact.solve(problem, dt=FINE, duration=scene.run.duration)
    time = np.arange(1.3e-6, 1.99e-3, 4e-6)
    return time, np.interp(time, result.time[1:] - FINE / 2, np.ravel(result.force)[1:])


def write_files(folder, bounces, fit, sigma=NOISE):
    time, force = bounces
    (folder / "reed.toml").write_text(SCENE, encoding="utf-8")
    path, force = folder / "record.toml", force + sigma * noise(len(time), 1)
    record = f'[[record]]\nname = "force"\nfile = "force.csv"\nkind = "force"\nnoise = "{sigma} N"\n'
    path.write_text(f'scene = "reed.toml"\n{record}[fit]\n{fit}\n', encoding="utf-8")
    write_csv(folder / "force.csv", ["time [us]", "force [N]"], np.column_stack([1e6 * time, force]).tolist())
    return path


@pytest.mark.slow
@pytest.mark.parametrize("key", FITS)
def test_a_start_whose_pulses_miss_those_of_the_record(key, bounces, tmp_path):
    """Least squares alone stay where they begin, at 3.5 to 4.2 times the noise."""
    true, words = FITS[key]
    result = identify(write_files(tmp_path, bounces, f"{key} = {{ {words} }}"))
    [(_, fitted, _, ends)] = result
    assert fitted.value(ends.low) <= true <= fitted.value(ends.high)
    assert result.counted[0].misfit < 1.2  # 1.12: noise, and half of it that the step leaves
    assert result.as_json()["keys"][0]["told"]
    assert "reached from another start than yours" in "\n".join(result.sentences())


@pytest.mark.slow
def test_a_record_that_no_start_reaches_tells_nothing(bounces, tmp_path):
    path = write_files(tmp_path, bounces, 'contact.gap = { start = "0.12 mm", from = "0.1 mm", to = "0.15 mm" }')
    result = identify(path)
    said = "\n".join(result.sentences())
    assert "does not reach force, and tells no key" in said
    assert "nothing nearer was found" in said or "from another start" in said
    assert not result.as_json()["keys"][0]["told"]


@pytest.mark.slow
def test_the_part_of_the_step_is_in_the_interval_and_said(bounces, tmp_path):
    """The step of the fit moves the gap out of the interval that little noise alone would have."""
    fit = 'contact.gap = { start = "0.052 mm", from = "0.02 mm", to = "0.2 mm" }'
    result = identify(write_files(tmp_path, bounces, fit, 0.03))
    [(_, fitted, _, ends)] = result
    assert fitted.value(ends.low) <= 0.05 <= fitted.value(ends.high)
    assert not fitted.value(ends.low + ends.of_step) <= 0.05 <= fitted.value(ends.high - ends.of_step)
    assert "0.5 us: state a finer run.time_step" in "\n".join(result.sentences())
