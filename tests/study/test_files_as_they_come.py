"""Universal files and records in scenes: what they state counts; a contradiction is refused with a key of the table."""

import re
from pathlib import Path

import numpy as np
import pytest

from seatfem.faces.plan_view import read_back
from seatfem.study.runs.pipeline import run_scene
from tests.gallery import load_text, refusal
from tests.universal_files import HEX, F, H, elements, function, groups, mode, nodes, units

REST = (
    '\n[reed]\nkind = "rigid_mass"\nmass = "20 g"\nvelocity = "-1 m/s"\n[contact]\n'
    'law = { kind = "spring", stiffness = "20 N/um" }\n[run]\nduration = "3 ms"\nfilter_width = "200 us"\n'
)


def seat(kind: str, file: str, *lines: str) -> str:
    return "\n".join(["[seat]", f'kind = "{kind}"', f'file = "{file}"', *lines, REST])


HEAD = "Analyser\nDate,2024-03-02\nfrequency,accelerance re,accelerance im\nHz,m/s^2/N,m/s^2/N\n"
AT = ("node = 1", 'direction = "+z"')


@pytest.mark.parametrize(
    ("text", "lines", "scale"),
    [
        (units(1, 1.0) + function(), (), 1.0),
        (function(), (), 1.0),
        (function(unit="g"), (), 9.80665),
        (units(5, 1e3, 1e3) + function(unit="NONE", force="NONE"), (), 1.0),
        (units(10, 1e3) + function(unit="mm/s^2"), (), 1e-3),
        (function(), ('system = "mm-N-s"',), 1e-3),
        (units(1, 1.0) + function(), ('units = { response = "g/N" }',), 9.80665),
    ],
)
def test_units_of_a_response(text: str, lines: tuple[str, ...], scale: float, tmp_path: Path) -> None:
    """Dataset 164, labels or the scene state the units; the plan says which."""
    (tmp_path / "a.uff").write_text(text, encoding="utf-8")
    scene = load_text(tmp_path, seat("frf", "a.uff", *AT, *lines))
    measured = scene.seat.response()
    assert measured.receptance[:, 0, 0] * measured.per_receptance == pytest.approx(scale * H, rel=1e-5)
    assert f"{scale:.6g} m/(N s^2)" in dict(read_back(scene))["seat, file"]


LABELLED = units(1, 1.0) + function(unit="g")
MASSLESS = units(1, 1.0) + mode(1, 900.0, 0.0) + mode(2, 2600.0, 0.0)


@pytest.mark.parametrize(
    ("kind", "text", "lines", "key", "words"),
    [
        ("frf", LABELLED, AT, "seat.file", "'g/N', which contradicts dataset 164 .*units.response"),
        ("frf", LABELLED, ("node = 1", "averages = 3"), "seat.averages", "CSV files.*remove"),
        ("frf", LABELLED, (), "seat.node", "state the number"),
        ("frf", LABELLED, (*AT, 'system = "SI"', 'units = { response = "g/N" }'), "seat.file", "remove one"),
        ("modes", mode(1, 900.0), ("node = 5", 'direction = "+z"'), "seat.file", "state system"),
        ("modes", MASSLESS, ("node = 5", 'direction = "+z"'), "seat.file", "modal_mass = 1 "),
    ],
)
def test_what_a_universal_file_leaves_open_or_contradicts(
    kind: str, text: str, lines: tuple[str, ...], key: str, words: str, tmp_path: Path
) -> None:
    """The refusal stands at the key of the table that mends it."""
    (tmp_path / "a.uff").write_text(text, encoding="utf-8")
    said = refusal(lambda: read_back(load_text(tmp_path, seat(kind, "a.uff", *lines))))
    assert re.search(f"{key}: .*{words}", said)


def test_keys_of_modes(tmp_path: Path) -> None:
    """A modal mass that is stated stands in place of 0, in the file's unit of mass."""
    (tmp_path / "a.uff").write_text(MASSLESS, encoding="utf-8")
    one, two = (
        load_text(tmp_path, seat("modes", "a.uff", "node = 5", 'direction = "+z"', *lines)).seat.function().shapes
        for lines in (("modal_mass = 1",), ("modal_mass = 1", 'system = "mm-N-s"'))
    )
    assert one[:, 0] == pytest.approx([0.3, 0.6])
    assert two == pytest.approx(one / np.sqrt(1e3))  # tonnes


def test_a_key_of_universal_files_beside_another(tmp_path: Path) -> None:
    """A node, a direction or a system says nothing of a CSV file."""
    rows = "\n".join(f"{f},{h.real},{h.imag}" for f, h in zip(F, H, strict=True))
    (tmp_path / "a.csv").write_text(f"{HEAD}{rows}\n", encoding="utf-8")
    for line in AT:
        assert "remove the key" in refusal(load_text, tmp_path, seat("frf", "a.csv", line))
    scene = load_text(tmp_path, seat("frf", "a.csv"))
    assert "2 lines above the head" in dict(read_back(scene))["seat"]


@pytest.mark.parametrize(
    ("head", "lines", "size", "words"),
    [
        (units(5, 1e3, 1e3), (), 1e-3, "states its unit of length, 0.001 m"),
        (units(1, 1.0), ('unit = "mm"',), 1e-3, "of length of 1 m; the stated one, 0.001 m, counts"),
        ("", (), 1.0, "m is assumed"),
        ("", ('unit = "mm"',), 1e-3, None),
    ],
)
def test_units_of_a_mesh(head: str, lines: tuple[str, ...], size: float, words: str | None, tmp_path: Path) -> None:
    """The scene's counts, then the file's, then metres; the plan says which, where the scene does not."""
    text = head + nodes(2411, HEX) + elements(2412, (115, range(1, 9)))
    sets = {"contact": [(7, k) for k in (5, 6, 7, 8)], "fixed": [(7, k) for k in (1, 2, 3, 4)]}
    (tmp_path / "a.unv").write_text(text + groups(2467, **sets), encoding="utf-8")
    scene = load_text(tmp_path, seat("mesh", "a.unv", 'material = "steel"', *lines))
    assert scene.seat.read().quality.volume == pytest.approx(size**3)
    assert (words or "") in dict(read_back(scene)).get("seat, file", "")
    assert (words is None) == ("seat, file" not in dict(read_back(scene)))


@pytest.mark.slow
@pytest.mark.parametrize("form", ["labels", "g", "csv"])
def test_the_force_on_a_record_of_three_modes(form: str, tmp_path: Path) -> None:
    """0.35 kg at 900 Hz, 0.5 kg at 2600 Hz and 0.9 kg at 5200 Hz: 180.94 N and 36.19 mN s by another march."""
    f = 2.0 + 8.0 * np.arange(800)
    s = 2j * np.pi * f
    modes = ((0.35, 900.0, 0.01), (0.5, 2600.0, 0.008), (0.9, 5200.0, 0.01))
    h = sum(s**2 / (m * (s**2 + 4 * np.pi * z * w * s + (2 * np.pi * w) ** 2)) for m, w, z in modes)
    noise = 0.002 * np.sqrt(np.mean(np.abs(h) ** 2) / 2) * np.random.default_rng(1).normal(size=(2, len(f)))
    h = h + noise[0] + 1j * noise[1]
    rows = "\n".join(f"{x:.3f},{y.real:.8e},{y.imag:.8e}" for x, y in zip(f, h, strict=True))
    (tmp_path / "a.csv").write_text(f"{HEAD}{rows}\n", encoding="utf-8")
    (tmp_path / "labels.uff").write_text(function(of=(f, h)), encoding="utf-8")
    (tmp_path / "g.uff").write_text(function(unit="g", of=(f, h / 9.80665)), encoding="utf-8")
    text = seat("frf", "a.csv") if form == "csv" else seat("frf", f"{form}.uff", *AT)
    summary = run_scene(load_text(tmp_path, text), tmp_path / "out", pictures=False).summary
    assert summary["filtered_peak_force_N"] == pytest.approx(180.94, rel=0.01)
    assert summary["impulse_Ns"] == pytest.approx(36.19e-3, rel=0.01)
