"""Draws the bodies of every example for the gallery: docs/images/scenes/NAME.png.

    .venv/bin/python docs/scene_pictures.py [NAME ...]

Of the scenes and studies of examples/ what their files say; of its Python scripts what `PYTHON` says. Thicknesses and
places are true, openings and tilts are drawn larger than they are.
"""

from __future__ import annotations

import sys
import tomllib
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, Final

import numpy as np
from bodies import (
    BENT,
    ROLLED,
    Piece,
    Pose,
    arrow,
    cylinder_pieces,
    reach_of,
    stop_pieces,
    striker_pieces,
    target_pieces,
)

from impact.files.safe_files import whole_file
from impact.pictures.drawing import ORANGE
from seatfem.pictures.rendering import aim, halved, in_few_colours, load_pyvista, new_plotter, shoot
from seatfem.structures.kinds.beam import Beam
from seatfem.structures.kinds.plate_loads import ClampedPlate
from seatfem.structures.kinds.structure import Structure
from seatfem.study.scene import Scene, load_scene

ROOT = Path(__file__).resolve().parent.parent
EXAMPLES, PICTURES = ROOT / "examples", ROOT / "docs" / "images" / "scenes"
SIZE: Final = (720, 500)
"""Pixels that are rendered; the picture has half as many."""
VIEW: Final = (0.72, -0.85, 0.48)
"""Direction to the camera, which looks at the free end of a reed."""
TALL: Final = 2.5
"""Height over the width of bodies that are drawn lying."""
OWN: Final = np.array([[255, 255, 255], [int(ORANGE[k : k + 2], 16) for k in (1, 3, 5)]])
"""White, and the colour of struck faces, which are small."""
LIGHT: Final[dict[str, Any]] = {
    "ambient": 0.42, "diffuse": 0.6, "specular": 0.12, "smooth_shading": True, "split_sharp_edges": True
}  # fmt: skip
NEAR: Final = 0.1
"""In place of `bodies.BENT`, over a seat that is struck in a point."""
FLYING: Final = 0.35
"""Drawn opening of a free body over its size."""
STOP: Final = 0.1
"""Drawn gap under a stopper over the size of the reed."""
BESIDE: Final = 1.5
"""Distance of two scenes in one picture over the size of the striker."""
GHOSTS: Final = (0.5, 1.6)
"""Openings over the usual one, of what a study varies."""
ROD: Final = {"kind": "rod", "young": "200 GPa", "density": "7850 kg/m^3", "length": "60 mm", "area": "25 mm^2"}
SPRING: Final = {"kind": "spring", "stiffness": "80 N/um"}
GAS: Final = {"pressure": "0.1 bar", "area": "80 mm^2"}
PYTHON: Final[dict[str, list[tuple[str, dict[str, object]]]]] = {
    "ball_on_plate": [("ball_on_seat", {"seat.radius": "16 mm", "seat.thickness": "2 mm"})],
    "bar_as_rod": [("mass_on_bar", {"seat.length": "12 mm", "seat.width": "4 mm", "seat.height": "4 mm"})],
    "co_simulation": [("flapper_on_spring", {"load": [{"force": "-0.5 N"}]})],
    "colliding_rods": [
        ("mass_on_bar", {"seat": {**ROD, "far_end": "free"}, "reed": {**ROD, "far_end": "free", "velocity": "-1 m/s"}})
    ],
    "measured_seat": [("mass_on_bar", {"seat": ROD})],
    "own_matrices": [("flapper_on_spring", {"seat": {**ROD, "length": "12 mm", "area": "100 mm^2"}})],
    "pressure_feedback": [("flapper_on_spring", {"load": [GAS]})],
    "rod_against_spring": [("mass_on_bar", {"seat": ROD}), ("mass_on_bar", {"seat": SPRING})],
    "seat_from_step": [
        (
            "flapper_on_annular_seat",
            {"seat": {"kind": "cad", "file": "../meshes/annular_seat.step", "material": "steel"}},
        )
    ],
}
"""Scenes and changed keys of each, of what the Python scripts of examples/ do; side by side where there are two."""


def main(names: list[str]) -> None:
    """Write the pictures of ``names``, or of all examples."""
    for name, pieces in every_picture():
        if not names or name in names:
            write_picture(pieces(), PICTURES / f"{name}.png")


def every_picture() -> Iterator[tuple[str, Callable[[], list[Piece]]]]:
    """Yield the name of each example, and what makes its bodies."""
    for path in sorted(EXAMPLES.glob("*.toml")):
        yield path.stem, partial(scene_pieces, path)
    for name, scenes in PYTHON.items():
        yield name, partial(python_pieces, scenes)


def scene_pieces(path: Path) -> list[Piece]:
    """Return the bodies of a scene; of a study those of its scene, the striker in three places."""
    of_study = tomllib.loads(path.read_text(encoding="utf-8")).get("scene")
    if of_study is None:
        return bodies_of(load_scene(path))
    scene = load_scene(path.parent / of_study)
    ghosts = [striker_pieces(scene.reed, pose_of(scene, factor))[0] for factor in GHOSTS]
    return [*bodies_of(scene), *(replace(ghost, opacity=0.3) for ghost in ghosts)]


def python_pieces(scenes: list[tuple[str, dict[str, object]]]) -> list[Piece]:
    """Return the bodies of several scenes beside each other."""
    found: list[Piece] = []
    for number, (name, changed) in enumerate(scenes):
        scene = load_scene(EXAMPLES / f"{name}.toml", changed)
        aside = number * BESIDE * size_of(scene.reed) * np.array([0.0, 1.0, 0.0])
        found += [replace(piece, surface=piece.surface.translate(aside)) for piece in bodies_of(scene)]
    return found


def pose_of(scene: Scene, factor: float = 1.0, reach: float = 0.0) -> Pose:
    """Return how a striker is drawn: ``factor`` times the usual opening, over a face of radius ``reach`` [m]."""
    clamped = isinstance(scene.reed, Beam | ClampedPlate)
    opening = (BENT if reach else NEAR) if clamped else FLYING
    return Pose(factor * opening, ROLLED if scene.contact.tilt else 0.0, reach, scene.contact.at)


def bodies_of(scene: Scene) -> list[Piece]:
    """Return seat, reed, stopper, what presses the reed, and the cylinder of a compressor."""
    size = size_of(scene.reed)
    clamped = isinstance(scene.reed, Beam | ClampedPlate)
    pieces = target_pieces(scene.seat, size if clamped else 2.5 * size, cut=bool(scene.stress))
    striker = striker_pieces(scene.reed, pose_of(scene, reach=reach_of(pieces)))
    pieces += striker
    if scene.stopper is not None:
        at = scene.stopper.at
        along = 0.0 if at is None else at - size
        pieces += stop_pieces(scene.stopper.body, size, height_at(striker[0], along) + STOP * size, along)
    elif scene.load or getattr(scene.reed, "pressure", None):
        spread = [-0.3 * size, -0.15 * size, 0.0] if clamped else [-0.375 * size, 0.375 * size]
        spread = [0.0] if all(load.force is not None for load in scene.load) else spread
        pieces += [arrow(0.2 * size, height_at(striker[0], x) + 0.03 * size, x) for x in spread]
    for drive in scene.driven_by:
        if (bore := getattr(drive, "bore", None)) and (stroke := getattr(drive, "stroke", None)):
            pieces += cylinder_pieces(bore, stroke, -size / 2)
    return pieces


def height_at(piece: Piece, along: float) -> float:
    """Return the highest point of a striker near a place along it [m]."""
    points = piece.surface.points
    near = np.abs(points[:, 0] - along) <= np.abs(points[:, 0] - along).min() + 0.05 * np.ptp(points[:, 0])
    return float(points[near, 2].max())


def size_of(reed: Structure) -> float:
    """Return the largest extent of a striker as it is drawn [m]."""
    points = striker_pieces(reed, Pose())[0].surface.points
    return float(np.ptp(points, axis=0).max())


def write_picture(pieces: list[Piece], path: Path) -> None:
    """Write them as the camera sees them, in few colours."""
    extent = np.ptp(np.concatenate([piece.surface.points for piece in pieces]), axis=0)
    if extent[2] > TALL * extent[:2].max():
        pieces = [replace(piece, surface=piece.surface.rotate_y(90.0, point=(0, 0, 0))) for piece in pieces]
    plotter = new_plotter(load_pyvista(), SIZE)
    for piece in pieces:
        plotter.add_mesh(piece.surface, color=piece.colour, opacity=piece.opacity, **LIGHT)
        if piece.edges and piece.opacity > 0.5:
            lines = piece.surface.extract_feature_edges(35.0, manifold_edges=False, boundary_edges=True)
            plotter.add_mesh(lines, color="#3A4048", line_width=2.0, opacity=piece.opacity)
    aim(plotter, np.concatenate([piece.surface.points for piece in pieces]), 0.0, VIEW)
    plotter.camera.parallel_scale *= 1.06
    image = halved(shoot(plotter))
    plotter.close()
    path.parent.mkdir(exist_ok=True)
    with whole_file(path) as temporary:
        [few] = in_few_colours([image], OWN)
        few.save(temporary, "PNG", optimize=True)


if __name__ == "__main__":
    main(sys.argv[1:])
