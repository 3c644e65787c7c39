"""Measured sets are compared as they state, and the comparison can fail."""

import tomllib
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import impact
from seatfem import verify
from seatfem.study.scene.tables import LIMIT
from tests.known_answers.round_bars import bar_frequency
from tests.measured import bar_on_bar, striker_shot
from tests.steps import DONE, FAILED, SceneError, run_command

SETS = {record.name: record for record in verify.measured_sets()}
TEXT = """
[source]
title = "a record"
address = "https://example.org"
licence = "MIT"

[[predicted]]
name = "f"
value = 1.0
uncertainty = 0.1
unit = "Hz"
"""


@pytest.mark.slow(but="pipe_round_trip")
@pytest.mark.parametrize("name", SETS)
def test_a_set_compares_as_it_states(name: str) -> None:
    compared = verify.compare(SETS[name])
    assert [row.published.name for row in compared.rows if not row.as_stated] == []
    assert set(compared.fits) >= {key for key, fit in SETS[name].fitted.items() if "unit" in fit}


@pytest.mark.parametrize("name", SETS)
def test_every_number_has_an_uncertainty_and_every_disagreement_a_reason(name: str) -> None:
    record = SETS[name]
    assert record.about
    assert record.finding
    assert all(each.uncertainty > 0 for each in record.predicted)
    assert [each.name for each in record.predicted if not each.agrees and not each.note] == []


def test_at_least_eight_sets_count() -> None:
    assert sum(record.counts for record in SETS.values()) >= 8


@pytest.mark.slow(but="pipe_round_trip")
@pytest.mark.parametrize("name", ["pipe_round_trip", "ball_on_steel_plate", "fan_blade"])
def test_a_wrong_input_is_noticed(name: str) -> None:
    """Three times the density makes times at least 50 % longer and frequencies 42 % lower, beyond every bar."""
    record = SETS[name]
    value, unit = record.geometry["density"].split()
    wrong = record.model_copy(update={"geometry": {**record.geometry, "density": f"{3.0 * float(value)} {unit}"}})
    assert any(not row.as_stated for row in verify.compare(wrong).rows)


def test_a_set_with_as_many_fits_as_predictions_does_not_count(tmp_path: Path) -> None:
    record = written(tmp_path, TEXT + "[fitted.E]\nto = 'f'\n")
    row = verify.Comparison(record.predicted[0], verify.Estimate(1.0, 0.1))
    compared = [verify.ComparedSet(record, (row,), {}), verify.ComparedSet(SETS["jim_beam"], (row,), {})]
    assert not record.counts
    assert verify.counted(compared) == "1 of 2 sets count: 1 numbers fitted, 1 predicted, 1 of them overlap"
    assert any("does not count" in str(cell) for cell in verify.measured_table_view(compared).columns[4].cells)


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        (TEXT.replace("value = 1.0", "value = nan"), "value: .*nan"),
        (TEXT.replace("uncertainty = 0.1", "uncertainty = true"), "uncertainty: True.* number"),
        (TEXT.replace("[[predicted]]", "[[measured]]"), "predicted: required key is missing"),
        ("[source", "TOML syntax"),
        ("#" * (LIMIT + 1), "up to 1 MB"),
    ],
)
def test_a_wrong_file_is_refused_in_words(tmp_path: Path, changed: str, words: str) -> None:
    with pytest.raises(SceneError, match=words):
        written(tmp_path, changed)


def written(folder: Path, text: str) -> verify.MeasuredSet:
    path = folder / "of_a_test.toml"
    path.write_text(text, encoding="utf-8")
    return verify.read_measured_set(path)


@pytest.mark.parametrize(
    ("ours", "overlaps"), [((1.29, 0.2), True), ((1.31, 0.2), False), ((0.85, 0.05), True), ((0.849, 0.05), False)]
)
def test_intervals_overlap_up_to_the_sum_of_both(ours: tuple[float, float], overlaps: bool) -> None:
    assert (
        verify.Comparison(
            verify.Prediction(name="f", value=1.0, uncertainty=0.1, unit="Hz"), verify.Estimate(*ours)
        ).overlap
        == overlaps
    )


@pytest.mark.parametrize(("agrees", "code"), [(True, DONE), (False, FAILED)])
def test_verify_measured_fails_where_a_set_states_otherwise(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], agrees: bool, code: int
) -> None:
    record = SETS["pipe_round_trip"]
    stated = record.model_copy(update={"predicted": (record.predicted[0].model_copy(update={"agrees": agrees}),)})
    monkeypatch.setattr(verify, "measured_sets", lambda: (stated,))
    assert run_command(["verify", "--measured"]) == code
    assert "1 of 1 sets count: 0 numbers fitted, 1 predicted, 1 of them overlap" in " ".join(
        capsys.readouterr().out.split()
    )


def test_a_set_whose_module_leaves_a_number_out_is_refused() -> None:
    record = SETS["pipe_round_trip"]
    mass = verify.Prediction(name="mass", value=1.0, uncertainty=0.1, unit="kg")
    more = record.model_copy(update={"predicted": (*record.predicted, mass)})
    with pytest.raises(verify.VerificationError, match=r"pipe_round_trip\.py.*predict"):
        verify.measured_table(records=[more])


DATA = tomllib.loads((Path(__file__).parents[1] / "measured" / "bar_on_bar.toml").read_text(encoding="utf-8"))


def test_a_pulse_three_per_cent_longer_is_told_apart() -> None:
    coming, time = bar_on_bar.incident(DATA), DATA["incident"]["time_us"]
    longer = {"incident": {**DATA["incident"], "time_us": [time[0] + 1.03 * (each - time[0]) for each in time]}}
    law, name = impact.RoughJoint(0.0516, 2.0, 0.67), "width of what is passed on, at half height"
    own, other = (bar_on_bar.look(each, law).values[name] for each in (coming, bar_on_bar.incident(longer)))
    assert other - own > 3.0
    row = next(each for each in DATA["predicted"] if each["name"] == name)
    assert abs(other - row["value"]) > 2 * row["uncertainty"]


def test_laws_without_a_memory_throw_back_too_much_when_the_joint_opens() -> None:
    """Laws fitted to the first blip miss the second by more than three times its uncertainty."""
    coming, (closing, opening) = bar_on_bar.incident(DATA), (DATA["fitted"][key] for key in ("closure", "recovery"))
    for law in (lambda k: impact.LinearSpring(k), lambda k: impact.Hertz(k)):
        stiffness = bar_on_bar.stiffness_for(coming, law, closing["value"])
        second = bar_on_bar.look(coming, law(stiffness)).blips[1]
        assert second - opening["value"] > 3 * opening["uncertainty"]


SHOT = tomllib.loads((Path(__file__).parents[1] / "measured" / "striker_shot.toml").read_text(encoding="utf-8"))
RECORD = SimpleNamespace(geometry=SHOT["geometry"], fitted={}, data=SHOT)
MEASURED = np.array([row["value"] for row in SHOT["predicted"]])
KNOWN = np.array([row["uncertainty"] for row in SHOT["predicted"]])


@pytest.mark.slow
def test_the_waves_of_the_bar_are_those_of_pochhammer_and_chree() -> None:
    """The bar's waves converge at fourth order, to 1e-4 at 3/4 of the wave numbers; 3 % of Poisson's ratio show."""
    rows = striker_shot.WAVES * 3 // 4
    errors = []
    for elements in (1, 2):
        speeds = striker_shot.speeds(RECORD, elements)
        number = speeds[rows, 0]
        exact = bar_frequency(number, SHOT["geometry"]["poisson"]) / number
        errors.append(abs(speeds[rows, 1] - exact))
    assert np.log2(errors[0] / errors[1]) > 3.5
    assert errors[1] < 1e-4 < abs(bar_frequency(number, 1.03 * SHOT["geometry"]["poisson"]) / number - exact)


def test_neither_a_bar_without_dispersion_nor_one_three_per_cent_faster_agrees() -> None:
    speeds = striker_shot.speeds(RECORD, 2)
    plain = speeds.copy()
    plain[:, 1] = 1.0
    for other in (striker_shot.crests(RECORD, plain), striker_shot.crests(RECORD, speeds, 1.03**2)):
        assert np.abs(other - MEASURED).max() > 3 * KNOWN.max()
