"""[stress] of a scene: a bar pressed slowly, places, pictures, refusals."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from seatfem.structures.fields.recovery import Response, von_mises
from seatfem.study.runs import pipeline
from seatfem.study.runs.seat_fields import SeatMeshes
from seatfem.study.runs.seat_stress import SeatStress, seat_stress, stress_keys
from seatfem.study.runs.stress_spots import load_histories
from seatfem.study.runs.stress_wave import peak_pictures
from tests.gallery import BAR, spring
from tests.steps import SceneError, Stopwatch, begin_plan, load_scene, rounds, silent
from tests.study.small_scenes import PRESSED, PRESSURE

MIDDLE = '["0 mm", "0 mm", "5 mm"]'


def scene(folder: Path, stress: str, seat: str = BAR) -> Path:
    """Return a mass on a soft spring: the bar follows it as if at rest."""
    file = folder / "scene.toml"
    file.write_text(PRESSED.replace(BAR, seat).replace('distance = "3 mm"\n', stress + "\n"), encoding="utf-8")
    return file


@pytest.mark.slow
def test_a_bar_pressed_slowly_bears_force_over_area(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    kept: list[SeatStress] = []

    def keys(stress: SeatStress | None) -> dict[str, object]:
        kept.append(stress)
        return stress_keys(stress)

    monkeypatch.setattr("seatfem.study.runs.seat_stress.stress_keys", keys)
    pipeline.run_scene(load_scene(scene(tmp_path, f"points = [{MIDDLE}]\ndistance = '3 mm'")), tmp_path, pictures=False)
    summary = json.loads((tmp_path / "summary.json").read_text())
    of_middle = kept[0].named[0]
    along = np.abs(of_middle[:3]).max(axis=1)
    pressed = PRESSURE
    assert along.max() == pytest.approx(pressed, rel=0.02)
    assert of_middle[int(along.argmax())].min() == pytest.approx(-pressed, rel=0.02)
    assert np.sort(along)[1] < 0.02 * pressed
    assert summary["peak_seat_stress_Pa"] == pytest.approx(pressed, rel=0.2)
    assert 0 <= summary["error_bar_peak_seat_stress_Pa"] < 0.5 * pressed
    [middle] = summary["seat_stress_at_points"]
    assert abs(middle["von_mises_Pa"] - pressed) < middle["error_bar_Pa"] + 0.02 * pressed
    assert middle["error_bar_Pa"] < 0.05 * pressed
    assert summary["peak_seat_stress_time_s"] == pytest.approx(np.pi / 2 * np.sqrt(1e-3 / 1e5), rel=0.1)
    scale = np.sqrt(200e9 * 7850) * 0.5
    assert summary["peak_seat_stress_over_rho_c0_v"] == pytest.approx(summary["peak_seat_stress_Pa"] / scale, rel=1e-6)
    assert len(summary["peak_seat_stress_at_m"]) == 3
    for name, draw in peak_pictures(kept[0], "stress"):
        draw(path=tmp_path / name)
    assert (tmp_path / "seat_stress.png").stat().st_size > 10_000
    body = pytest.importorskip("pyvista").read(tmp_path / "seat_stress.vtu")
    assert np.nanmax(body["largest von Mises [Pa]"]) == pytest.approx(summary["peak_seat_stress_Pa"])
    assert np.nanmax(body["its time [s]"]) <= 330e-6


RING = (
    '\nkind = "annular"\nbore_radius = "4 mm"\nlip_width = "1 mm"\nlip_height = "0.5 mm"\nlip_edge_radius = "0 mm"\n'
    'outer_radius = "8 mm"\nthickness = "3 mm"\ndamping_ratio = 0.05\n'
    'mesh = { size = "1.5 mm", contact_size = "0.5 mm" }\ngreens = { bandwidth = "100 kHz" }\n'
    'material = { young = "200 GPa", poisson = 0.3, density = "7850 kg/m^3" }\n'
)
BELOW = '["0 mm", "4.5 mm", "1.5 mm"]'


@pytest.mark.slow
def test_a_lip_pressed_all_around_in_arcs_bears_what_it_bears_as_a_whole(tmp_path: Path) -> None:
    """A mass on a soft spring: the force is that of a mass on a spring to 1e-3, on one port or shared by eight."""
    results = []
    for name, ports, points in (("whole", "", ""), ("arcs", "ports = 8", f"points = [{BELOW}]\n")):
        folder = tmp_path / name
        folder.mkdir()
        model = "" if ports else "model = 'axisymmetric'\n"
        file = scene(folder, f"{points}distance = '0.1 mm'\napart = '0.6 mm'", RING + model)
        file.write_text(file.read_text().replace("[contact]", f"[contact]\n{ports}"))
        pipeline.run_scene(load_scene(file), folder, pictures=False)
        results.append(json.loads((folder / "summary.json").read_text()))
    whole, arcs = results
    assert arcs["peak_seat_stress_Pa"] == pytest.approx(whole["peak_seat_stress_Pa"], rel=0.01)
    assert arcs["error_bar_peak_seat_stress_Pa"] == pytest.approx(whole["error_bar_peak_seat_stress_Pa"], rel=0.1)
    spots = arcs["seat_stress_hot_spots"]
    assert spots[0]["von_mises_Pa"] == pytest.approx(arcs["peak_seat_stress_Pa"], rel=1e-12)  # sums in another order
    assert [spot["von_mises_Pa"] for spot in spots] == sorted((s["von_mises_Pa"] for s in spots), reverse=True)
    places = np.array([spot["at_m"] for spot in spots])
    apart = np.linalg.norm(places[:, None] - places, axis=2) + np.eye(len(places))
    assert apart.min() >= 0.6e-3
    assert min(spot["edge_distance_m"] for spot in spots) >= 0.1e-3
    rows = (tmp_path / "arcs" / "hot_spots.csv").read_text().splitlines()
    assert rows[0] == "von_mises_Pa,time_s,x_m,y_m,z_m,edge_distance_m,part,component,component_Pa"
    time, histories = load_histories(tmp_path / "arcs" / "stress.h5")
    first = [spots[k] for k in sorted({[s["part"] for s in spots].index(part) for part in ("lip", "body")})]
    for spot in first:  # its own stress at its own time, and all of it together von Mises' stress
        own = [v for name, v in histories.items() if name.startswith(f"seat, {spot['part']}, ")]
        state = np.array(own)[:, np.argmin(np.abs(time - spot["time_s"]))]
        assert np.abs(state).max() == pytest.approx(abs(spot["component_Pa"]), rel=1e-9)
        assert von_mises(state) == pytest.approx(spot["von_mises_Pa"], rel=1e-9)
    assert len(rows) == len(spots) + 1
    assert float(rows[1].split(",")[0]) == pytest.approx(spots[0]["von_mises_Pa"], rel=1e-8)


@pytest.mark.slow
def test_what_is_refused_is_refused_before_the_contact(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(pipeline, "rounds", lambda *_, **__: pytest.fail("the contact was run"))
    file = scene(tmp_path, 'points = [["4.5 mm", "0 mm", "1 mm"], ["9 mm", "0 mm", "1 mm"]]', RING)
    with pytest.raises(SceneError, match=r"stress\.points\.1: \(9, 0, 1\).*seat.* 1\.02 mm") as caught:
        pipeline.run_scene(load_scene(file), tmp_path, pictures=False)
    assert [problem.key for problem in caught.value.problems] == ["stress.points.1"]
    for more, seat, words in (
        ('points = [["50 mm", "1 mm", "1.5 mm"]]', BAR, r"stress\.points\.0: .*off the seat"),
        ('points = [["1 mm", "0 mm", "0.1 mm"]]', BAR, "distance"),
        ("surface = false", BAR, "surface = false"),
        ("", f"\n{spring('1e8 N/m')}", "no finite elements"),
    ):
        with pytest.raises(SceneError, match=words):
            pipeline.run_scene(load_scene(scene(tmp_path, more, seat)), tmp_path, pictures=False)


@pytest.mark.slow
def test_the_struck_face_is_left_out_by_default(tmp_path: Path) -> None:
    """None of its nodes, nor those of its rim's neighbourhood, is looked at; all others are."""
    stated, other = (load_scene(scene(tmp_path, f"distance = '1 mm'\n{more}")) for more in ("struck = true", ""))
    *_, done = rounds(begin_plan(stated), tmp_path, Stopwatch(), silent)
    whole, rest = (seat_stress(replace(done, plan=replace(done.plan, scene=each))).sites for each in (stated, other))
    top = whole[:, 2].max()
    assert np.isclose(whole[:, 2], top).sum() > 4
    assert top - rest[:, 2].max() >= 1e-3 * (1 - 1e-6)
    assert len(rest) == np.sum(whole[:, 2] < top - 1e-3 * (1 - 1e-6))


def test_the_stress_of_a_seat_comes_back_from_file_bit_for_bit(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    plan = begin_plan(load_scene(scene(tmp_path, f"points = [{MIDDLE}]\ndistance = '3 mm'")))
    *_, done = rounds(plan, tmp_path, Stopwatch(), silent)
    first = seat_stress(done)
    monkeypatch.setattr(Response, "from_model", lambda *a, **k: pytest.fail("computed again"))
    monkeypatch.setattr(SeatMeshes, "both", property(lambda meshes: pytest.fail("meshed again")))
    again = seat_stress(done)
    assert first is not None
    assert again is not None
    assert np.array_equal(first.peak.von_mises, again.peak.von_mises)
    assert np.array_equal(first.named, again.named)
    assert np.array_equal(first.bars, again.bars)
