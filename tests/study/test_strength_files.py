"""Files of measured strength: read into SI, refused with every reason at once, named on the page."""

from pathlib import Path

import pytest

from impact.life.strength import Curve, Strength
from seatfem.life.table import load_strength
from seatfem.study.scene import SceneError

WHOLE = (
    '\nsource = "invented for tests"\ngrade = "strip"\ndirection = "along rolling"\nthickness = "0.3 mm"\n'
    'temperature = "120 degC"\nspecimens = 30\nultimate = "1800 MPa"\nfatigue_strength = "2 GPa"\n'
    'walker_exponent = 0.65\nloading_ratio = 0\ntorsion_limit = "310 MPa"\nbending_limit = "500 MPa"\n'
    'limit_cycles = 1e7\nimpact_velocity = "8 m/s"\n\n[curve]\nknee_stress = "400 MPa"\nknee_cycles = 1e7\nslope = 12\n'
    'scatter = 0.25\nsurvival = "90 %"\n'
)


def written(folder: Path, text: str) -> Path:
    path = folder / "strength.toml"
    path.write_text(text, encoding="utf-8")
    return path


def test_every_key_in_si(tmp_path: Path) -> None:
    assert load_strength(written(tmp_path, WHOLE)) == Strength(
        source="invented for tests",
        grade="strip",
        direction="along rolling",
        thickness=0.3e-3,
        temperature=393.15,
        specimens=30,
        ultimate=1.8e9,
        fatigue_strength=2e9,
        walker_exponent=0.65,
        loading_ratio=0.0,
        torsion_limit=310e6,
        bending_limit=500e6,
        limit_cycles=1e7,
        impact_velocity=8.0,
        curve=Curve((400e6,), (1e7,), 12.0, 23.0, scatter=0.25, survival=0.9),
    )


def test_a_source_is_enough(tmp_path: Path) -> None:
    assert load_strength(written(tmp_path, 'source = "a data sheet"\n')) == Strength("a data sheet")


@pytest.mark.parametrize(
    ("curve", "expected"),
    [
        ('points = [["500 MPa", 1e5], ["400 MPa", 1e6]]', (10.319, 10.319)),  # log 10/log 1.25
        ('knee_stress = "400 MPa"\nknee_cycles = 1e7\nslope = 12\nsecond_slope = 8', (12, 8)),
        ('knee_stress = "400 MPa"\nknee_cycles = 1e7\nslope = 12\nendurance_limit = true', (12, float("inf"))),
    ],
)
def test_curves(tmp_path: Path, curve: str, expected: tuple[float, float]) -> None:
    loaded = load_strength(written(tmp_path, f'source = "invented"\n[curve]\n{curve}\n')).curve
    assert (loaded.first_slope, loaded.last_slope) == pytest.approx(expected, rel=1e-4)


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        (('source = "invented for tests"', ""), "source: required"),
        (('"invented for tests"', '"  "'), "2: source: .*empty"),
        (('"1800 MPa"', '"1800 mm"'), "length.*strength"),
        (('"120 degC"', '"250 degF"'), "'120 degC'.*'393 K'"),
        (("loading_ratio = 0", "loading_ratio = 1"), "loading_ratio: 1.*1"),
        (("slope = 12", "slope = 0.08"), "curve.slope: 0.08"),
        (("slope = 12", ""), "missing: slope"),
        (("slope = 12", 'slope = 12\npoints = [["500 MPa", 1e5], ["400 MPa", 1e6]]'),
         "knee.*points"),
        (("slope = 12", "slope = 12\nsecond_slope = 9\nendurance_limit = true"), "leaves no second slope"),
        (('survival = "90 %"', "survival = 1"), "curve.survival"),
        (('knee_stress = "400 MPa"\nknee_cycles = 1e7\nslope = 12', 'points = [["400 MPa", 1e5], ["420 MPa", 1e6]]'),
         r"curve.points: S-N.*4e\+08 Pa.*100000 cycles.*4.2e\+08 Pa"),
        (('knee_stress = "400 MPa"\nknee_cycles = 1e7\nslope = 12', 'points = [["400 MPa", 1e5]]'),
         "two points or more"),
    ],
)  # fmt: skip
def test_what_is_refused(tmp_path: Path, changed: tuple[str, str], words: str) -> None:
    text = WHOLE.replace(*changed)
    assert text != WHOLE
    with pytest.raises(SceneError, match=words):
        load_strength(written(tmp_path, text))


def test_a_curve_of_a_table(tmp_path: Path) -> None:
    """Points in CSV are those of `points`; comments are left out."""
    (tmp_path / "sn.csv").write_text("# invented\nstress [MPa],cycles\n500,1e5\n400,1e7\n350,1e9\n", encoding="utf-8")
    points = 'points = [["500 MPa", 1e5], ["400 MPa", 1e7], ["350 MPa", 1e9]]'
    of_file, of_points = (
        load_strength(written(tmp_path, f'source = "invented"\n[curve]\n{curve}\nscatter = 0.2\n')).curve
        for curve in ('file = "sn.csv"', points)
    )
    assert of_file == of_points


@pytest.mark.parametrize(
    ("rows", "words"),
    [
        ("stress [MPa],cycles\n500,1e5\n400\n", r"sn.csv, line 3: 1 columns, 2 are needed, divided by commas"),
        ("stress [MPa],cycles\n500,1e5\n400,nan\n", "sn.csv, line 3, column 2: 'nan'"),
        ("stress,cycles\n500,1e5\n400,1e7\n", r"'stress'.*\[unit\],cycles"),
        ("stress [MPa],cycles\n400,1e5\n420,1e7\n", r"curve.file: S-N.*4e\+08 Pa.*100000 cycles"),
        ("stress [MPa],cycles\n400,1e5\n-20,1e7\n", "stress.*positive"),
        ("stress [MPa],cycles\n400,1e5\n", "points.*1"),
    ],
)
def test_a_table_that_is_none(tmp_path: Path, rows: str, words: str) -> None:
    (tmp_path / "sn.csv").write_text(rows, encoding="utf-8")
    with pytest.raises(SceneError, match=r"\.toml:3: curve\.file: (.|\n)*" + words.removeprefix("curve.file: ")):
        load_strength(written(tmp_path, 'source = "x"\n[curve]\nfile = "sn.csv"\n'))
