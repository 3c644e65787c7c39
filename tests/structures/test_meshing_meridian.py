"""Half sections of solids of revolution: exact volumes and areas, grading, orders of convergence."""

import math

import numpy as np
import pytest

from seatfem.structures.mesh.plane_meshes import make_meridian
from seatfem.structures.mesh.spec import MeshSpec
from seatfem.structures.shapes import AnnularSeat, Bar, ConicalSeat, Edge, GeometryError, Profile, Stopper

FLAT = AnnularSeat(lip_height=0.0, lip_edge_radius=0.0)
CONE = ConicalSeat(contact_width=1e-3)
FILLETED = AnnularSeat(lip_fillet=0.3e-3)
FAMILIES = [AnnularSeat(), FILLETED, FLAT, CONE, Stopper(), Stopper(dome_radius=20e-3)]


def exact(geometry) -> dict[str, float]:
    """Return the contact area of the ring, frustum or spherical cap by its formula, and the fixed area."""
    if isinstance(geometry, AnnularSeat):
        inner = geometry.bore_radius + geometry.lip_edge_radius
        outer = geometry.bore_radius + geometry.lip_width - geometry.lip_edge_radius
        return {"contact": math.pi * (outer**2 - inner**2), "fixed": math.pi * (12e-3**2 - 4e-3**2)}
    if isinstance(geometry, ConicalSeat):
        middle = geometry.bore_radius + geometry.face_width / 2 * math.sin(geometry.half_angle)
        return {"contact": 2 * math.pi * middle * 1e-3, "fixed": math.pi * (12e-3**2 - 4e-3**2)}
    contact = math.pi * geometry.contact_radius**2
    if geometry.dome_radius is not None:
        rise = geometry.dome_radius - math.sqrt(geometry.dome_radius**2 - geometry.contact_radius**2)
        contact = 2 * math.pi * geometry.dome_radius * rise
    return {"contact": contact, "fixed": math.pi * geometry.radius**2}


def volume(geometry) -> float:
    """Return the volume of plate, cylinder or ring, less the cone or the dome's spandrel."""
    if isinstance(geometry, ConicalSeat):
        depth, wide = geometry.face_width * math.cos(math.pi / 4), 4e-3 + geometry.face_width * math.sin(math.pi / 4)
        frustum = math.pi / 3 * depth * (wide**2 + wide * 4e-3 + 4e-3**2)
        return math.pi * (12e-3**2 - 4e-3**2) * 8e-3 - (frustum - math.pi * 4e-3**2 * depth)
    if geometry == FLAT:
        return math.pi * (12e-3**2 - 4e-3**2) * 8e-3
    if isinstance(geometry, AnnularSeat):
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
def test_mesh_is_the_closed_form(geometry):
    seat = make_meridian(geometry, MeshSpec(1e-3, 0.4e-3))
    # Lines are exact; the quarter arcs of the lip, one or two elements each, leave 1.1e-7 of the volume.
    assert seat.quality.volume == pytest.approx(volume(geometry), rel=3e-7)
    for name, area in exact(geometry).items():
        assert seat.quality.areas[name] == pytest.approx(area, rel=1e-9)
    assert seat.quality.min_scaled_jacobian > 0.3
    assert ("axis" in seat.mesh.boundaries) == isinstance(geometry, Stopper)
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
    dome = Stopper(radius=6e-3, thickness=5e-3, contact_radius=6e-3, dome_radius=6.5e-3)
    coarse, fine = (make_meridian(dome, MeshSpec(h, curved=curved)).quality for h in (2e-3, 1e-3))
    errors = [abs(q.volume / q.cad_volume - 1) for q in (coarse, fine)]
    assert math.log2(errors[0] / errors[1]) == pytest.approx(order, abs=0.6)


def test_what_is_not_revolved_has_no_meridian():
    with pytest.raises(GeometryError, match="Bar is no solid of revolution"):
        make_meridian(Bar(1e-2, 1e-3, 1e-3), MeshSpec(1e-3))


def test_profiles_are_checked():
    square = [(1e-3, 0.0), (2e-3, 0.0), (2e-3, 1e-3), (1e-3, 1e-3)]
    edges = [Edge(a, b) for a, b in zip(square, square[1:] + square[:1], strict=True)]
    assert Profile(tuple(edges)).volume == pytest.approx(math.pi * 3e-9, rel=1e-12)
    with pytest.raises(GeometryError, match="open at"):
        Profile(tuple(edges[:-1]))
    with pytest.raises(GeometryError, match="counter-clockwise"):
        Profile(tuple(Edge(e.end, e.start) for e in reversed(edges)))
    with pytest.raises(GeometryError, match="r < 0"):
        Profile((*edges[:-1], Edge(square[3], (-1e-3, 0.0)), Edge((-1e-3, 0.0), square[0])))


@pytest.mark.parametrize(
    ("spec", "values", "message"),
    [
        (ConicalSeat, {"half_angle": 45.0}, r"ConicalSeat.half_angle = 45:.*0.*pi/2"),
        (ConicalSeat, {"contact_width": 3e-3}, r"contact_width = 3 mm:.*<= 2 mm"),
        (ConicalSeat, {"thickness": 1e-3}, r"thickness = 1 mm:.*> 1.4142 mm"),
        (ConicalSeat, {"outer_radius": 5e-3}, r"outer_radius = 5 mm:.*> 5.4142 mm"),
        (Stopper, {"contact_radius": 7e-3}, r"contact_radius = 7 mm:.*<= 6 mm"),
        (Stopper, {"dome_radius": 5e-3}, r"dome_radius = 5 mm:.*> 6 mm"),
        (Stopper, {"dome_radius": 6.1e-3, "thickness": 1e-3}, r"thickness = 1 mm:.*> 5 mm"),
        (AnnularSeat, {"lip_height": 0.0}, r"lip_edge_radius = 0.1 mm:.*< 0 mm"),
        (AnnularSeat, {"lip_height": -1e-3}, r"lip_height = -1 mm"),
        (AnnularSeat, {"lip_fillet": 0.4e-3}, r"lip_fillet = 0.4 mm:.*< 0.4 mm \(lip_height"),
        (AnnularSeat, {"lip_fillet": 0.3e-3, "outer_radius": 5.2e-3}, r"< 0.2 mm \(the"),
        (AnnularSeat, {"lip_fillet": -1e-4}, r"lip_fillet = -0.1 mm"),
    ],
)
def test_bad_values_name_field_value_and_limit(spec, values, message):
    with pytest.raises(GeometryError, match=message):
        spec(**values)
