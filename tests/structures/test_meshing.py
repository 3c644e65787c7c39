"""gmsh in its own process: meshes of every family, STEP and .msh files, and what happens when gmsh fails."""

import math
from pathlib import Path

import numpy as np
import pytest

from seatfem.structures import shapes
from seatfem.structures.mesh.meshing import content_hash, make_mesh
from tests.solids import MeshingError, MeshSpec, make_meridian

DEMO_SPEC = MeshSpec(size=1.6e-3, contact_size=0.6e-3)  # that of meshes/make_meshes.py
COARSE = MeshSpec(size=3e-3)


@pytest.mark.slow
def test_meshing_is_reproducible_and_hashed():
    first, second = (make_mesh(shapes.AnnularSeat(), DEMO_SPEC) for _ in range(2))
    assert np.array_equal(first.mesh.doflocs, second.mesh.doflocs)
    assert np.array_equal(first.mesh.t, second.mesh.t)
    assert first.provenance == second.provenance
    assert first.provenance.content_hash == content_hash(shapes.AnnularSeat(), DEMO_SPEC)
    assert first.provenance.content_hash != content_hash(shapes.AnnularSeat(thickness=7e-3), DEMO_SPEC)
    assert first.provenance.content_hash != content_hash(shapes.AnnularSeat(), MeshSpec(2e-3))


def test_missing_cad_file(tmp_path):
    with pytest.raises(FileNotFoundError, match=r"none.step: no such CAD file"):
        make_mesh(shapes.CadPart(tmp_path / "none.step"), COARSE)


FAKE_GMSH = """
import os, signal, time
def initialize(*args, **options): {act}
class option:
    setNumber = staticmethod(lambda name, value: None)
"""


def use_fake_gmsh(monkeypatch, folder: Path, source: str) -> None:
    (folder / "gmsh.py").write_text(source)
    monkeypatch.setenv("PYTHONPATH", str(folder))


@pytest.mark.slow
@pytest.mark.own_gmsh
def test_missing_system_library_names_the_mend(monkeypatch, tmp_path):
    use_fake_gmsh(monkeypatch, tmp_path, "raise OSError('libGLU.so.1: cannot open shared object file')")
    with pytest.raises(MeshingError, match=r"libGLU.so.1.*apt-get.*--no-install-recommends libglu1-mesa"):
        make_mesh(shapes.AnnularSeat(), COARSE)


@pytest.mark.slow
@pytest.mark.own_gmsh
def test_crash_is_an_error(monkeypatch, tmp_path):
    use_fake_gmsh(monkeypatch, tmp_path, FAKE_GMSH.format(act="os.kill(os.getpid(), signal.SIGSEGV)"))
    with pytest.raises(MeshingError, match=r"\(SIGSEGV\).*element size"):
        make_mesh(shapes.AnnularSeat(), COARSE)


CONE = shapes.ConicalSeat(contact_width=1e-3)
PLATE = shapes.ValvePlate(ports=3, pitch=10e-3)
ROW = shapes.ValvePlate(ports=2, layout="row", pitch=9e-3)
SECTOR_SPEC = MeshSpec(3e-3, 2e-3)


def exact(geometry) -> tuple[float, float, float]:
    """Return volume, contact area, fixed area."""
    if isinstance(geometry, shapes.Bar):
        section = geometry.width * geometry.height
        return section * geometry.length, section, section
    if isinstance(geometry, shapes.Block):
        section = geometry.width * geometry.depth
        return section * geometry.thickness, geometry.patch_width * geometry.patch_depth, section
    if isinstance(geometry, shapes.ValvePlate):
        land = math.pi * ((geometry.port_radius + geometry.land_width) ** 2 - geometry.port_radius**2)
        if geometry.layout == "circle":
            outer = geometry.pitch / math.sqrt(3) + geometry.port_radius + geometry.margin  # three ports
            whole, rim = math.pi * outer**2, math.pi * (outer**2 - (outer - geometry.clamp_width) ** 2)
        else:
            y = geometry.port_radius + geometry.margin
            x, c = geometry.pitch / 2 + y, geometry.clamp_width
            whole, rim = 4 * x * y, 4 * (x * y - (x - c) * (y - c))
        plan = whole - geometry.ports * math.pi * geometry.port_radius**2
        return plan * geometry.thickness, geometry.ports * land, rim
    profile = geometry.profile  # itself held against closed forms below
    return profile.volume, profile.area("contact"), profile.area("fixed")


BAR, BLOCK = shapes.Bar(8e-3, 3e-3, 2e-3), shapes.Block(12e-3, 10e-3, 6e-3, 2e-3, 3e-3)
CASES = [
    (shapes.AnnularSeat(lip_edge_radius=0.0), 6),
    (CONE, 1),
    (shapes.Stopper(dome_radius=20e-3), 5),
    (PLATE, 6),
    (ROW, 2),
    (BAR, 4),
    (BLOCK, 2),
]


@pytest.mark.slow(but="geometry5")
@pytest.mark.parametrize(("geometry", "sector"), CASES)
def test_mesh_is_the_closed_form(geometry, sector):
    seat = make_mesh(geometry, SECTOR_SPEC, sector=sector)
    volume, contact, fixed = (value / sector for value in exact(geometry))
    q = seat.quality
    assert q.cad_volume == pytest.approx(volume, rel=1e-9)
    assert q.cad_areas["contact"] == pytest.approx(contact, rel=1e-9)
    assert q.cad_areas["fixed"] == pytest.approx(fixed, rel=1e-9)
    # A quadratic arc of angle a with its middle node on the circle encloses the sector's area to a^4/480 of it: 2.5e-3
    # with six elements around the smallest circle, 3e-4 with ten around the others. Straight-sided solids are exact.
    flat = isinstance(geometry, shapes.Bar | shapes.Block)
    assert q.volume == pytest.approx(volume, rel=1e-12 if flat else 3e-4)
    assert q.areas["contact"] == pytest.approx(contact, rel=1e-12 if flat else 2.5e-3)
    assert q.areas["fixed"] == pytest.approx(fixed, rel=1e-12 if flat else 3e-4)
    assert q.min_scaled_jacobian > 0.1
    assert ("symmetry_0" in seat.mesh.boundaries) == (sector > 1)
    if sector > 1:
        for name, azimuth in (("symmetry_0", 0.0), ("symmetry_1", 2 * math.pi / sector)):
            x, y, _ = seat.mesh.p[:, seat.mesh.facets[:, seat.mesh.boundaries[name]]]
            assert np.allclose(y * math.cos(azimuth), x * math.sin(azimuth), rtol=0, atol=1e-12)
            assert np.all(x * math.cos(azimuth) + y * math.sin(azimuth) > -1e-12)
        # contact and symmetry planes share no facet, and each facet in a cut plane has its name
        named = np.concatenate([seat.mesh.boundaries["symmetry_0"], seat.mesh.boundaries["symmetry_1"]])
        x, y, _ = seat.mesh.p[:, seat.mesh.facets[:, np.setdiff1d(seat.mesh.boundary_facets(), named)]]
        assert len(np.unique(named)) == len(named)
        assert not np.any(np.all(np.abs(y) < 1e-9, axis=0) & np.all(x > -1e-9, axis=0))


def test_each_land_is_a_group_of_its_own():
    seat = make_mesh(PLATE, SECTOR_SPEC)
    lands = [seat.mesh.boundaries[f"land_{k}"] for k in (1, 2, 3)]
    assert np.array_equal(np.sort(np.concatenate(lands)), np.sort(seat.mesh.boundaries["contact"]))
    for (x, y), land in zip(PLATE.centres, lands, strict=True):
        points = seat.mesh.p[:, seat.mesh.facets[:, land]]
        radius = np.hypot(points[0] - x, points[1] - y)
        assert 3e-3 - 1e-9 < radius.min() < radius.max() < 4e-3 + 1e-9


@pytest.mark.parametrize(
    ("geometry", "sector", "message"),
    [
        (BAR, 3, r"sector = 3:.*2.*4.*sectors"),
        (BAR, 0, r"sector = 0: must be >= 1"),
        (PLATE, 4, r"sector = 4:.*ValvePlate.*3 ports"),
        (ROW, 3, r"ports in a row.*choose 2 or 4"),
    ],
)
def test_what_cannot_be_made(geometry, sector, message):
    with pytest.raises(shapes.GeometryError, match=message):
        make_mesh(geometry, SECTOR_SPEC, sector=sector)


FLAT = shapes.AnnularSeat(lip_height=0.0, lip_edge_radius=0.0)
FILLETED = shapes.AnnularSeat(lip_fillet=0.3e-3)
FAMILIES = [shapes.AnnularSeat(), FILLETED, FLAT, CONE, shapes.Stopper(), shapes.Stopper(dome_radius=20e-3)]


def meridian_areas(geometry) -> dict[str, float]:
    """Return the contact area of the ring, frustum or spherical cap by its formula, and the fixed area."""
    if isinstance(geometry, shapes.AnnularSeat):
        inner = geometry.bore_radius + geometry.lip_edge_radius
        outer = geometry.bore_radius + geometry.lip_width - geometry.lip_edge_radius
        return {"contact": math.pi * (outer**2 - inner**2), "fixed": math.pi * (12e-3**2 - 4e-3**2)}
    if isinstance(geometry, shapes.ConicalSeat):
        middle = geometry.bore_radius + geometry.face_width / 2 * math.sin(geometry.half_angle)
        return {"contact": 2 * math.pi * middle * 1e-3, "fixed": math.pi * (12e-3**2 - 4e-3**2)}
    contact = math.pi * geometry.contact_radius**2
    if geometry.dome_radius is not None:
        rise = geometry.dome_radius - math.sqrt(geometry.dome_radius**2 - geometry.contact_radius**2)
        contact = 2 * math.pi * geometry.dome_radius * rise
    return {"contact": contact, "fixed": math.pi * geometry.radius**2}


def meridian_volume(geometry) -> float:
    """Return the volume of plate, cylinder or ring, less the cone or the dome's spandrel."""
    if isinstance(geometry, shapes.ConicalSeat):
        depth, wide = geometry.face_width * math.cos(math.pi / 4), 4e-3 + geometry.face_width * math.sin(math.pi / 4)
        frustum = math.pi / 3 * depth * (wide**2 + wide * 4e-3 + 4e-3**2)
        return math.pi * (12e-3**2 - 4e-3**2) * 8e-3 - (frustum - math.pi * 4e-3**2 * depth)
    if geometry == FLAT:
        return math.pi * (12e-3**2 - 4e-3**2) * 8e-3
    if isinstance(geometry, shapes.AnnularSeat):
        r = geometry.lip_edge_radius
        spandrel, inset = r**2 * (1 - math.pi / 4), r * (10 - 3 * math.pi) / (12 - 3 * math.pi)
        sharp = math.pi * ((12e-3**2 - 4e-3**2) * 8e-3 + (5e-3**2 - 4e-3**2) * 0.5e-3)
        foot, off = geometry.lip_fillet**2 * (1 - math.pi / 4), geometry.lip_fillet * inset / r
        return sharp - 2 * math.pi * (spandrel * (4e-3 + 5e-3) - foot * (5e-3 + off))
    if geometry.dome_radius is None:
        return math.pi * geometry.radius**2 * geometry.thickness
    rise = geometry.thickness - geometry.top(geometry.radius)
    cap = math.pi * rise**2 / 3 * (3 * geometry.dome_radius - rise)
    return math.pi * geometry.radius**2 * geometry.top(geometry.radius) + cap


@pytest.mark.parametrize("geometry", FAMILIES, ids=str)
def test_meridian_is_the_closed_form(geometry):
    seat = make_meridian(geometry, MeshSpec(1e-3, 0.4e-3))
    # Lines are exact; the quarter arcs of the lip, one or two elements each, leave 1.1e-7 of the volume.
    assert seat.quality.volume == pytest.approx(meridian_volume(geometry), rel=3e-7)
    for name, area in meridian_areas(geometry).items():
        assert seat.quality.areas[name] == pytest.approx(area, rel=1e-9)
    assert seat.quality.min_scaled_jacobian > 0.3
    assert ("axis" in seat.mesh.boundaries) == isinstance(geometry, shapes.Stopper)
    if "axis" in seat.mesh.boundaries:
        assert np.all(seat.mesh.p[0, seat.mesh.facets[:, seat.mesh.boundaries["axis"]]] == 0.0)


def test_elements_grow_from_the_contact():
    mesh = make_meridian(CONE, MeshSpec(1.2e-3, 0.25e-3)).mesh
    ends = mesh.p[:, mesh.facets]
    length, middle = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=0), ends.mean(axis=1)
    centre = mesh.p[:, mesh.facets[:, mesh.boundaries["contact"]]].mean(axis=(1, 2))
    distance = np.hypot(*(middle - centre[:, None]))
    sizes = [length[(distance >= a) & (distance < b)].mean() for a, b in ((0, 8e-4), (2e-3, 3e-3), (5e-3, 9e-3))]
    assert sizes == sorted(sizes)
    assert 0.15e-3 < sizes[0] < 0.35e-3
    assert 0.8e-3 < sizes[-1] < 1.4e-3


@pytest.mark.parametrize(("curved", "order"), [(True, 4.0), (False, 2.0)])
def test_arcs_converge_at_order_four_when_curved(curved, order):
    # Area under a quadratic arc with its middle node on the circle: O(h^4); chords: O(h^2).
    dome = shapes.Stopper(radius=6e-3, thickness=5e-3, contact_radius=6e-3, dome_radius=6.5e-3)
    coarse, fine = (make_meridian(dome, MeshSpec(h, curved=curved)).quality for h in (2e-3, 1e-3))
    errors = [abs(q.volume / q.cad_volume - 1) for q in (coarse, fine)]
    assert math.log2(errors[0] / errors[1]) == pytest.approx(order, abs=0.6)


def test_what_is_not_revolved_has_no_meridian():
    with pytest.raises(shapes.GeometryError, match="Bar is no solid of revolution"):
        make_meridian(shapes.Bar(1e-2, 1e-3, 1e-3), MeshSpec(1e-3))


def test_profiles_are_checked():
    square = [(1e-3, 0.0), (2e-3, 0.0), (2e-3, 1e-3), (1e-3, 1e-3)]
    edges = [shapes.Edge(a, b) for a, b in zip(square, square[1:] + square[:1], strict=True)]
    assert shapes.Profile(tuple(edges)).volume == pytest.approx(math.pi * 3e-9, rel=1e-12)
    with pytest.raises(shapes.GeometryError, match="open at"):
        shapes.Profile(tuple(edges[:-1]))
    with pytest.raises(shapes.GeometryError, match="counter-clockwise"):
        shapes.Profile(tuple(shapes.Edge(e.end, e.start) for e in reversed(edges)))
    with pytest.raises(shapes.GeometryError, match="r < 0"):
        shapes.Profile((*edges[:-1], shapes.Edge(square[3], (-1e-3, 0.0)), shapes.Edge((-1e-3, 0.0), square[0])))
