"""Volumes, areas and rough numbers of elements against real meshes."""

from pathlib import Path

import pytest

from seatfem.structures.memory_need import MARGIN
from seatfem.structures.mesh.meshing import make_mesh
from seatfem.structures.mesh.plane_meshes import make_meridian
from seatfem.structures.mesh.spec import MeshSpec
from seatfem.structures.shapes import AnnularSeat, Bar, Block, ConicalSeat, Stopper, ValvePlate
from tests.steps import load_scene

EXAMPLES = Path(__file__).parents[2] / "examples"
SPEC = MeshSpec(size=2e-3, contact_size=0.7e-3)
BODIES = [
    (AnnularSeat(), 4), (AnnularSeat(lip_height=0.0, lip_edge_radius=0.0), 4), (ConicalSeat(), 4), (Stopper(), 4),
    (Stopper(dome_radius=30e-3), 4), (ValvePlate(ports=4, thickness=3e-3), 8), (ValvePlate(ports=3, layout="row"), 4),
    (Bar(30e-3, 5e-3, 5e-3), 4), (Block(20e-3, 20e-3, 8e-3, 3e-3, 3e-3), 4),
]  # fmt: skip
NAMES = ["annular", "flat", "conical", "stopper", "dome", "plate", "row", "bar", "block"]


@pytest.mark.slow(but="bar")
@pytest.mark.parametrize(("body", "parts"), BODIES, ids=NAMES)
def test_volumes_are_those_of_the_meshes(body, parts):
    """A body's volume is its mesh's to 1.5 %; four curved elements a circle are 1.3 % off."""
    assert parts * make_mesh(body, SPEC, sector=parts).quality.volume == pytest.approx(body.volume, rel=0.015)


@pytest.mark.slow
def test_a_mesh_is_roughly_counted_before_any_is_made():
    """Rough numbers of a large mesh are within the margin of what is refused."""
    for level, spec in (("3d", MeshSpec(0.9e-3, 0.3e-3)), ("axisymmetric", MeshSpec(0.15e-3, 0.03e-3))):
        seat = load_scene(EXAMPLES / "flapper_on_annular_seat.toml").seat
        real = make_mesh(seat.geometry(), spec) if level == "3d" else make_meridian(seat.geometry(), spec)
        rough = seat.rough_counts(spec, level)
        assert 1 / MARGIN < rough.elements / real.quality.elements < MARGIN
        assert 1 / MARGIN < rough.counts.dof / (3 if level == "3d" else 2) / real.quality.nodes < MARGIN
