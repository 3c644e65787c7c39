"""Scenes that travel: with every file they name, under safe names, and the same scene where they are unpacked."""

import json
from pathlib import Path

import pytest

from seatfem.jobs.crew import FILES
from seatfem.study.scene.files import by_content, packed
from tests.gallery import load_text
from tests.steps import Method, Scene, SceneError, key_of, load_scene

EXAMPLES = Path(__file__).parents[2] / "examples"
MESH = '[seat]\nkind = "mesh"\nfile = "{}"\ncontact = "lip"\nmaterial = "steel"\ndamping_ratio = 0.01\n'
REED = '[reed]\nkind = "rigid_mass"\nmass = "1 g"\nvelocity = "-1 m/s"\n[run]\nduration = "1 ms"\n'


def unpacked(path: Path, changed: dict[str, object], folder: Path) -> tuple[Scene, dict[str, Path]]:
    """Return the scene as another computer reads it, from a folder of its own, and which file is which."""
    place, there, files = packed(path, changed)
    for name, file in files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(file.read_bytes())
    here = json.loads(json.dumps(there).replace(FILES, str(folder)))
    return load_scene(place.replace(FILES, str(folder)), here), {
        str(folder / name): file for name, file in files.items()
    }


@pytest.mark.parametrize(
    ("name", "count"),
    [("flapper_on_valve_body", 1), ("suction_flapper", 1), ("life_of_a_flapper", 2), ("flapper_on_spring", 0)],
)
def test_a_scene_is_the_same_elsewhere(name: str, count: int, tmp_path: Path) -> None:
    """An unpacked scene is the same but for its files' places, also with tables that name others."""
    path = EXAMPLES / f"{name}.toml"
    there, files = unpacked(path, {"run.duration": "1.5 ms"}, tmp_path)
    text = there.model_dump_json()
    for place, file in files.items():
        text = text.replace(place, str(file))
    assert json.loads(text) == json.loads(load_scene(path, {"run.duration": "1.5 ms"}).model_dump_json())
    assert len(files) == count + 1


def test_files_that_vary_travel_too(tmp_path: Path) -> None:
    """Files that vary are packed in place of the scene's own, with those that they include under the names in them."""
    for name in ("a b.inp", "nodes.inp", "c.inp"):
        text = "*INCLUDE, INPUT=nodes.inp\n" if name[0] != "n" else "*NODE\n1, 0, 0, 0\n"
        (tmp_path / name).write_text(text, encoding="utf-8")
    (tmp_path / "scene.toml").write_text(MESH.format("c.inp") + REED, encoding="utf-8")
    _, there, files = packed(tmp_path / "scene.toml", {"seat.file": "a b.inp"})
    assert there == {"seat.file": f"{FILES}/1/input.inp"}
    assert {name: file.name for name, file in files.items()} == {
        "0/input.toml": "scene.toml", "1/input.inp": "a b.inp", "1/nodes.inp": "nodes.inp",
    }  # fmt: skip


@pytest.mark.parametrize("other", ["mesh/nodes.inp", "my nodes.inp"])
def test_what_cannot_travel(other: str, tmp_path: Path) -> None:
    """An included name that means something else elsewhere is refused."""
    folder = tmp_path / "deck"
    (folder / other).parent.mkdir(parents=True)
    (folder / other).write_text("*NODE\n", encoding="utf-8")
    (folder / "deck.inp").write_text(f"*INCLUDE, INPUT={other}\n", encoding="utf-8")
    (folder / "scene.toml").write_text(MESH.format("deck.inp") + REED, encoding="utf-8")
    with pytest.raises(SceneError, match=r"seat\.file: .*deck\.inp.*nodes\.inp"):
        packed(folder / "scene.toml", {})


def test_what_a_file_is_read_with_counts(tmp_path: Path) -> None:
    """A change of a mesh's other half, an .xdmf's HDF5 or an included deck changes the scene's content and the seat's
    key."""
    for name in ("disk.ele", "disk.node", "arrays.h5", "nodes.inp"):
        (tmp_path / name).write_bytes(b"one")
    (tmp_path / "disk.xdmf").write_text('<DataItem Format="HDF">arrays.h5:/data0</DataItem>', encoding="utf-8")
    (tmp_path / "deck.inp").write_text("*INCLUDE, INPUT=nodes.inp\n", encoding="utf-8")
    for name, other in (("disk.ele", "disk.node"), ("disk.xdmf", "arrays.h5"), ("deck.inp", "nodes.inp")):
        scene = load_text(tmp_path, MESH.format(name) + REED)
        assert f"1/{other}".replace("disk.", "input.") in packed(tmp_path / "scene.toml", {})[2]
        before = by_content(scene), key_of(scene.seat, Method())
        (tmp_path / other).write_bytes(b"two")
        assert by_content(scene)["seat"]["file"] != before[0]["seat"]["file"]
        assert key_of(scene.seat, Method()) != before[1]
        (tmp_path / other).write_bytes(b"one")
        assert (by_content(scene), key_of(scene.seat, Method())) == before


def test_the_curve_of_a_strength_counts(tmp_path: Path) -> None:
    for suffix in ("toml", "csv"):
        file = EXAMPLES / "strengths" / f"invented_strip.{suffix}"
        (tmp_path / file.name).write_text(file.read_text(encoding="utf-8"), encoding="utf-8")
    scene = load_scene(EXAMPLES / "life_of_a_flapper.toml", {"life.strength": str(tmp_path / "invented_strip.toml")})
    before = by_content(scene)
    curve = tmp_path / "invented_strip.csv"
    curve.write_text(curve.read_text(encoding="utf-8") + "\n", encoding="utf-8")
    assert {key for key, value in by_content(scene).items() if value != before[key]} == {"life"}
