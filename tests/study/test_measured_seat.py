"""Measured seats in scenes: units, keys and contradictions of their files, bars, and lines that do not fit."""

import re
from dataclasses import replace
from io import StringIO
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console

import impact
from impact.measured.frf import receptance
from impact.measured.pole_fit import fit_response
from impact.notices import Advice
from seatfem.faces.plan_view import read_back
from seatfem.faces.tables import result_table
from seatfem.structures.fits import fit_of
from seatfem.study.answers.verdict import verdict
from seatfem.study.impacts.validity import validity_advice
from seatfem.study.ladders.mesh import OF_DRAWS
from tests import universal_files as uff
from tests.gallery import load_text, refusal
from tests.steps import SAFETY, GreensFunction, RunError, Scene, SceneError, load_scene, run_scene, seat_of
from tests.universal_files import HEX, H, elements, function, groups, mode, nodes, units

F = np.arange(40.0, 12e3, 20.0)
S = 2j * np.pi * F
BODY = impact.ModalGreens(
    2 * np.pi * np.array([2.3e3, 6.1e3]),
    np.array([0.02, 0.015]),
    2 * np.pi * np.array([[2.3e3 * 1.1e-4], [6.1e3 * 7e-5]]),
    impact.Residual.spring(2e-9),
)
REED = (
    '\n[reed]\nkind = "rigid_mass"\nmass = "400 g"\nvelocity = "-1 m/s"\n[contact]\n'
    'law = { kind = "spring", stiffness = "5e7 N/m" }\n[run]\nduration = "3 ms"\nfilter_width = "200 us"\n'
)
SEAT = """seat = { kind = "frf", file = "hammer.csv", columns = { frequency = "f", magnitude = "H1", phase = "Phi" }, \
    units = { frequency = "kHz", response = "dB re 1 g/N", phase = "deg" }, quantity = "accelerance" }
"""


def advice_of(scene: Scene, *bodies: GreensFunction) -> tuple[Advice, ...]:
    return validity_advice(scene.geometry, scene.run.filter_width, *bodies)


def scene(folder: Path, noise: float, seat: str = SEAT, odd: float = 1.0, body: impact.ModalGreens = BODY) -> Scene:
    exact = body.transfer(S)[:, 0, 0] * S**2 * np.where((F > 8.4e3) & (F < 8.6e3), odd, 1.0)
    rng = np.random.default_rng(4)
    size = noise * np.sqrt(np.mean(np.abs(exact) ** 2) / 2)
    h = exact + size * (rng.normal(size=len(F)) + 1j * rng.normal(size=len(F)))
    columns = (F / 1e3, 20 * np.log10(np.abs(h) / 9.80665), np.degrees(np.angle(h)))
    rows = ["\t".join(f"{x:.7f}" for x in row).replace(".", ",") for row in zip(*columns, strict=True)]
    (folder / "hammer.csv").write_text("\n".join(["f\tH1\tPhi", *rows]), encoding="utf-8-sig")
    return load_text(folder, seat + REED)


@pytest.mark.slow
def test_bars_of_seat_and_baseline_hold_the_truth(tmp_path: Path) -> None:
    path = scene(tmp_path, 0.02)
    summary = run_scene(path, tmp_path / "out", pictures=False).summary
    static = float(BODY.static_compliance()[0, 0])
    apart = abs(summary["seat_static_stiffness_N_per_m"] * static - 1)
    assert apart < summary["error_bar_seat_static_stiffness_N_per_m"] * static < 0.05
    for prefix, body in (("", BODY), ("spring_", impact.spring(stiffness=1 / static))):
        law, striker = impact.LinearSpring(stiffness=5e7), impact.rigid_mass(mass=0.4, velocity=-1.0)
        problem = impact.ContactProblem(striker, target=impact.Body(body), law=law)
        result = impact.solve(problem, dt=5e-7, duration=3e-3)
        exact = {
            "filtered_peak_force_N": impact.measures.filtered_peak_force(result, 200e-6),
            "impulse_Ns": impact.measures.impulse(result),
        }
        for key, value in exact.items():
            bar = summary[f"error_bar_{prefix}{key}"]
            assert abs(summary[prefix + key] - value) < bar < 0.2 * value
    assert summary["error_record_filtered_peak_force_N"] > 0
    assert summary["error_reduction_filtered_peak_force_N"] == 0
    text = StringIO()
    Console(file=text, width=160).print(result_table(summary))
    (line,) = [each for each in text.getvalue().splitlines() if "peak force (mean over 200" in each][:1]
    assert line.count("±") == 2  # the baseline's, too


def test_a_free_seat_is_compared_with_a_rigid_body(tmp_path: Path) -> None:
    """Of 1 kg, with the compliance of its vibrations: the striker's impulse is twice the reduced mass times the
    speed."""
    body = impact.ModalGreens.from_hz([0.0, 2.3e3], [0.0, 0.02], [1.0, 1.2])
    free = scene(tmp_path, 0.0005, SEAT.replace(", quantity", ", free = true, quantity"), body=body)
    summary = run_scene(free, tmp_path / "out", pictures=False).summary
    assert summary["seat_static_stiffness_N_per_m"] == 0
    assert summary["spring_impulse_Ns"] == pytest.approx(2 / (1 / 0.4 + 1 / 1.0), rel=0.01)
    assert summary["impulse_Ns"] < 0.97 * summary["spring_impulse_Ns"]  # the vibration takes energy
    assert "rigid" in str(result_table(summary).columns[2].header)
    assert "A rigid body of the seat's mass and static compliance would give" in verdict(summary)


@pytest.mark.slow
def test_lines_that_do_not_fit_are_advised(tmp_path: Path) -> None:
    path = scene(tmp_path, 0.002, odd=1.4)
    (advice,) = advice_of(path, path.seat.fit().greens)  # type: ignore[attr-defined]
    assert "misfit of the seat's poles over the noise of the record" in str(advice) or "miss beyond" in str(advice)
    ranges = fit_of(path.seat.fit().greens).ranges  # type: ignore[attr-defined]
    assert any(low < 8.6e3 and high > 8.4e3 for low, high in ranges)
    assert f"from {ranges[0][0]:.4g} to {ranges[0][1]:.4g} Hz" in str(advice)
    assert "seat.free = true" in advice.remedy
    whole = scene(tmp_path, 0.002)
    assert not advice_of(whole, whole.seat.fit().greens)  # type: ignore[attr-defined]


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('magnitude = "H1"', 'magnitude = "H2"', "columns.magnitude = 'H2'.*0"),
        ('response = "dB re 1 g/N", ', "", "like 'frequency .Hz.,mobility real"),
        ('quantity = "accelerance"', 'quantity = "mobility"', "like 'frequency .Hz.,mobility real"),
        ('quantity = "accelerance"', "averages = 0", "seat.averages: "),
    ],
)
def test_what_the_scene_says_of_columns_is_checked(tmp_path: Path, old: str, new: str, words: str) -> None:
    with pytest.raises((SceneError, ValueError), match=words):
        scene(tmp_path, 0.01, SEAT.replace(old, new)).seat.response()


@pytest.mark.slow
def test_a_rigid_contact_that_a_record_cannot_tell_is_refused_in_words_of_a_scene(tmp_path: Path) -> None:
    """A mass on modes without flexibility is refused by keys of the scene: neither yields at once."""
    scene(tmp_path, 0.02, body=replace(BODY, residual=impact.Residual.spring(0.0)))
    path = tmp_path / "scene.toml"
    rigid = path.read_text(encoding="utf-8").replace('law = { kind = "spring", stiffness = "5e7 N/m" }', "")
    path.write_text(rigid, encoding="utf-8")
    with pytest.raises(RunError, match=r"contact\.law .* rigid.*run\.time_step") as refused:
        run_scene(path, tmp_path / "out", pictures=False)
    assert "impact." not in str(refused.value)


SLEEVE = Path(__file__).parents[2] / "examples" / "flapper_on_peek_sleeve.toml"
NOISE = 0.02  # of the root mean square of all lines


@pytest.fixture(scope="module")
def sleeve() -> GreensFunction:
    return seat_of(load_scene(SLEEVE)).greens


@pytest.mark.slow
@pytest.mark.parametrize(("highest", "in_band"), [(60e3, 2), (80e3, 3), (100e3, 4)])
def test_what_lies_above_the_band_is_in_the_bars(sleeve: GreensFunction, highest: float, in_band: int) -> None:
    """The record ends between modes. A mode next to the end of the band stays one, and does not leave to stand for
    those above; these fit the lines alike in different numbers, which changes the static compliance by more than noise.
    """
    lines = np.arange(100.0, highest, 100.0)
    s = np.asarray(2j * np.pi * lines, dtype=np.complex128)
    exact = sleeve.transfer(s)[:, 0, 0] * s**2
    rng = np.random.default_rng(13)
    noise = NOISE * np.sqrt(np.mean(np.abs(exact) ** 2) / 2)
    measured = exact + noise * (rng.normal(size=len(lines)) + 1j * rng.normal(size=len(lines)))
    fit = fit_response(receptance(lines, measured, "accelerance"))
    report = fit.greens.provenance["fit"]
    assert report["pole_pairs"] >= in_band
    assert report["unexplained_lines_hz"] == []
    static, true = (float(each.static_compliance()[0, 0]) for each in (fit.greens, sleeve))
    changes = [abs(float(draw.static_compliance()[0, 0]) - static) for draw in fit.draws]
    bar = SAFETY * OF_DRAWS * max(changes)  # that of a run
    assert abs(static - true) < bar < 0.1 * true
    width, t = 2 / lines[-1], np.linspace(0.0, 2e-4, 600)
    own, exactly = (each.filtered_matrix(t, width)[0, 0] for each in (fit.greens, sleeve))
    error = fit.greens.error_estimate.reduction
    assert np.abs(own - exactly).max() < error * np.abs(exactly).max() < 0.1 * np.abs(exactly).max()


STRIKES = REED.replace("400 g", "20 g").replace("5e7 N/m", "20 N/um")


def seat_keys(kind: str, file: str, *lines: str) -> str:
    return "\n".join(["[seat]", f'kind = "{kind}"', f'file = "{file}"', *lines, STRIKES])


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
    scene = load_text(tmp_path, seat_keys("frf", "a.uff", *AT, *lines))
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
    said = refusal(lambda: read_back(load_text(tmp_path, seat_keys(kind, "a.uff", *lines))))
    assert re.search(f"{key}: .*{words}", said)


def test_keys_of_modes(tmp_path: Path) -> None:
    """A modal mass that is stated stands in place of 0, in the file's unit of mass."""
    (tmp_path / "a.uff").write_text(MASSLESS, encoding="utf-8")
    one, two = (
        load_text(tmp_path, seat_keys("modes", "a.uff", "node = 5", 'direction = "+z"', *lines)).seat.function().shapes
        for lines in (("modal_mass = 1",), ("modal_mass = 1", 'system = "mm-N-s"'))
    )
    assert one[:, 0] == pytest.approx([0.3, 0.6])
    assert two == pytest.approx(one / np.sqrt(1e3))  # tonnes


def test_a_key_of_universal_files_beside_another(tmp_path: Path) -> None:
    """A node, a direction or a system says nothing of a CSV file."""
    rows = "\n".join(f"{f},{h.real},{h.imag}" for f, h in zip(uff.F, H, strict=True))
    (tmp_path / "a.csv").write_text(f"{HEAD}{rows}\n", encoding="utf-8")
    for line in AT:
        assert "remove the key" in refusal(load_text, tmp_path, seat_keys("frf", "a.csv", line))
    scene = load_text(tmp_path, seat_keys("frf", "a.csv"))
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
    scene = load_text(tmp_path, seat_keys("mesh", "a.unv", 'material = "steel"', *lines))
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
    text = seat_keys("frf", "a.csv") if form == "csv" else seat_keys("frf", f"{form}.uff", *AT)
    summary = run_scene(load_text(tmp_path, text), tmp_path / "out", pictures=False).summary
    assert summary["filtered_peak_force_N"] == pytest.approx(180.94, rel=0.01)
    assert summary["impulse_Ns"] == pytest.approx(36.19e-3, rel=0.01)
