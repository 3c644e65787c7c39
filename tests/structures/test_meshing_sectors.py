"""Solids and their equal sectors: against closed forms."""

import math

import numpy as np
import pytest

from seatfem.structures.mesh.meshing import make_mesh
from seatfem.structures.mesh.spec import MeshSpec
from seatfem.structures.shapes import AnnularSeat, Bar, Block, ConicalSeat, GeometryError, Stopper, ValvePlate

CONE = ConicalSeat(contact_width=1e-3)
SHARP = AnnularSeat(lip_edge_radius=0.0)
DOME = Stopper(dome_radius=20e-3)
PLATE = ValvePlate(ports=3, pitch=10e-3)
ROW = ValvePlate(ports=2, layout="row", pitch=9e-3)
SPEC = MeshSpec(3e-3, 2e-3)


def exact(geometry) -> tuple[float, float, float]:
    """Return volume, contact area, fixed area."""
    if isinstance(geometry, Bar):
        section = geometry.width * geometry.height
        return section * geometry.length, section, section
    if isinstance(geometry, Block):
        section = geometry.width * geometry.depth
        return section * geometry.thickness, geometry.patch_width * geometry.patch_depth, section
    if isinstance(geometry, ValvePlate):
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
    profile = geometry.profile  # itself held against closed forms in test_meshing_meridian
    return profile.volume, profile.area("contact"), profile.area("fixed")


BAR, BLOCK = Bar(8e-3, 3e-3, 2e-3), Block(12e-3, 10e-3, 6e-3, 2e-3, 3e-3)
CASES = [(SHARP, 6), (CONE, 1), (DOME, 5), (PLATE, 6), (ROW, 2), (BAR, 4), (BLOCK, 2)]


@pytest.mark.slow(but="geometry5")
@pytest.mark.parametrize(("geometry", "sector"), CASES)
def test_mesh_is_the_closed_form(geometry, sector):
    seat = make_mesh(geometry, SPEC, sector=sector)
    volume, contact, fixed = (value / sector for value in exact(geometry))
    q = seat.quality
    assert q.cad_volume == pytest.approx(volume, rel=1e-9)
    assert q.cad_areas["contact"] == pytest.approx(contact, rel=1e-9)
    assert q.cad_areas["fixed"] == pytest.approx(fixed, rel=1e-9)
    # A quadratic arc of angle a with its middle node on the circle encloses the sector's area to a^4/480 of it: 2.5e-3
    # with six elements around the smallest circle, 3e-4 with ten around the others. Straight-sided solids are exact.
    flat = isinstance(geometry, Bar | Block)
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
        assert closed(seat.mesh)


def closed(mesh) -> bool:
    """Return whether contact and symmetry planes share no facet, and each facet in a cut plane has its name."""
    named = np.concatenate([mesh.boundaries["symmetry_0"], mesh.boundaries["symmetry_1"]])
    others = np.setdiff1d(mesh.boundary_facets(), named)
    x, y, _ = mesh.p[:, mesh.facets[:, others]]
    in_plane = np.all(np.abs(y) < 1e-9, axis=0) & np.all(x > -1e-9, axis=0)
    return len(np.unique(named)) == len(named) and not np.any(in_plane)


def test_each_land_is_a_group_of_its_own():
    seat = make_mesh(PLATE, SPEC)
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
    with pytest.raises(GeometryError, match=message):
        make_mesh(geometry, SPEC, sector=sector)


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"pitch": 7e-3}, r"ValvePlate.pitch = 7 mm:.*> 8 mm"),
        ({"ports": 0}, r"ValvePlate.ports = 0:.*>= 1"),
        ({"clamp_width": 5e-3}, r"clamp_width = 5 mm:.*< 5 mm"),
        ({"land_width": 6e-3, "ports": 1}, r"land_width = 6 mm:.*< 5 mm"),
        ({"layout": "grid"}, r"layout = 'grid'"),
    ],
)
def test_bad_plates(values, message):
    with pytest.raises(GeometryError, match=message):
        ValvePlate(**values)
