"""Geometry specs, face selectors, and their plain-data form: nothing here starts gmsh."""

import math
from dataclasses import replace

import pytest

from seatfem.structures import shapes
from seatfem.structures.mesh.spec import MeshSpec
from seatfem.structures.shapes.cad import stated_unit

REED = shapes.Flapper(8e-3, 2e-3, 6e-3, 15e-3, 16e-3, 0.3e-3)
RING, THIN = shapes.RingPlate(20e-3, 10e-3, 0.5e-3), shapes.Disc(20e-3, 0.04e-3)
BLOCK = dict.fromkeys(("width", "depth", "thickness", "patch_depth"), 1.0)
SLOT = {"slot_width": 1e-3, "slot_length": 8e-3}


@pytest.mark.parametrize(
    ("spec", "values", "message"),
    [
        (shapes.AnnularSeat, {"bore_radius": -4e-3}, r"AnnularSeat.bore_radius = -4 mm:.*finite.*> 0"),
        (shapes.AnnularSeat, {"thickness": math.nan}, r"AnnularSeat.thickness = nan"),
        (shapes.AnnularSeat, {"outer_radius": 5e-3}, r"outer_radius = 5 mm:.*> 5 mm \(bore_radius \+ lip_width"),
        (shapes.AnnularSeat, {"lip_edge_radius": 0.5e-3, "lip_height": 1e-3}, r"lip_edge_radius = 0.5 mm:.*< 0.5 mm"),
        (shapes.AnnularSeat, {"lip_edge_radius": 0.3e-3, "lip_height": 0.2e-3}, r"< 0.2 mm \(the lip_height\)"),
        (shapes.AnnularSeat, {"lip_edge_radius": -1e-4}, r"lip_edge_radius = -0.1 mm"),
        (shapes.AnnularSeat, {"lip_height": -1e-3}, r"lip_height = -1 mm"),
        (shapes.AnnularSeat, {"lip_fillet": 0.4e-3}, r"lip_fillet = 0.4 mm:.*< 0.4 mm \(lip_height"),
        (shapes.AnnularSeat, {"lip_fillet": 0.3e-3, "outer_radius": 5.2e-3}, r"< 0.2 mm \(the"),
        (shapes.Bar, {"length": 1.0, "width": 0.0, "height": 1.0}, r"Bar.width = 0 mm"),
        (shapes.Block, BLOCK | {"patch_width": 2.0}, r"<= 1000 mm"),
        (shapes.ConicalSeat, {"half_angle": 45.0}, r"ConicalSeat.half_angle = 45:.*0.*pi/2"),
        (shapes.ConicalSeat, {"contact_width": 3e-3}, r"contact_width = 3 mm:.*<= 2 mm"),
        (shapes.ConicalSeat, {"thickness": 1e-3}, r"thickness = 1 mm:.*> 1.4142 mm"),
        (shapes.ConicalSeat, {"outer_radius": 5e-3}, r"outer_radius = 5 mm:.*> 5.4142 mm"),
        (shapes.Stopper, {"contact_radius": 7e-3}, r"contact_radius = 7 mm:.*<= 6 mm"),
        (shapes.Stopper, {"dome_radius": 5e-3}, r"dome_radius = 5 mm:.*> 6 mm"),
        (shapes.Stopper, {"dome_radius": 6.1e-3, "thickness": 1e-3}, r"thickness = 1 mm:.*> 5 mm"),
        (shapes.ValvePlate, {"pitch": 7e-3}, r"ValvePlate.pitch = 7 mm:.*> 8 mm"),
        (shapes.ValvePlate, {"ports": 0}, r"ValvePlate.ports = 0:.*>= 1"),
        (shapes.ValvePlate, {"clamp_width": 5e-3}, r"clamp_width = 5 mm:.*< 5 mm"),
        (shapes.ValvePlate, {"land_width": 6e-3, "ports": 1}, r"land_width = 6 mm:.*< 5 mm"),
        (shapes.ValvePlate, {"layout": "grid"}, r"layout = 'grid'"),
        (RING, {"inner_diameter": 20e-3}, r"RingPlate.inner_diameter = 20 mm:.*< 20 mm \(outer_diameter"),
        (RING, {"thickness": 5e-3}, r"RingPlate.thickness = 5 mm:.*< 5 mm \(the"),
        (THIN, {"thickness": 10e-3}, r"Disc.thickness = 10 mm:.*< 10 mm \(half"),
        (REED, {"thickness": 6e-3}, r"Flapper.thickness = 6 mm:.*< 6 mm \(neck_width"),
        (REED, {"slot_width": 1e-3}, r"Flapper.slot_length = None: slot_width"),
        (REED, {"slot_length": 1e-3}, r"Flapper.slot_width = None: slot_length"),
        (REED, SLOT | {"slot_width": 5.4e-3}, r"Flapper.slot_width = 5.4 mm:.*< 5.4 mm \(neck"),
        (REED, SLOT | {"slot_length": 13e-3}, r"Flapper.slot_length = 13 mm:.*< 13 mm \(neck_length"),
        (REED, SLOT | {"slot_length": 1e-3}, r"Flapper.slot_length = 1 mm:.*> 1 mm \(slot_width"),
        (REED, {"hole_diameter": 15.4e-3}, r"Flapper.hole_diameter = 15.4 mm:.*< 15.4 mm \(paddle_diameter"),
        (shapes.CadPart, {"path": "seat.igs"}, r"seat.igs:.*CAD.*'.igs'"),
        (shapes.CadPart, {"path": "seat.brep"}, r"states no unit"),
        (shapes.CadPart, {"path": "seat.step", "unit": -1.0}, r"CadPart.unit = -1"),
        (shapes.PlaneFace, {"normal": (0.0, 0.0, 0.0), "offset": 0.0}, r"must not be zero"),
        (shapes.ColourFace, {"colour": (256, 0, 0, 255)}, r"four numbers from 0 to 255"),
        (MeshSpec, {"size": 0.0}, r"MeshSpec.size = 0"),
        (MeshSpec, {"size": 1e-3, "contact_size": 2e-3}, r"contact_size = 2 mm:.*<= size = 1 mm"),
        (MeshSpec, {"size": 1e-3, "order": 3}, r"order = 3: must be 1 or 2"),
    ],
)
def test_bad_values_name_field_value_and_limit(spec, values, message):
    with pytest.raises(shapes.GeometryError, match=message):
        spec(**values) if isinstance(spec, type) else replace(spec, **values)


MM = "#1=(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT(.MILLI.,.METRE.));"
CONTEXT = "#8=(GEOMETRIC_REPRESENTATION_CONTEXT(3)GLOBAL_UNIT_ASSIGNED_CONTEXT((#9,#3))REPRESENTATION_CONTEXT('',''));"


def converted(name: str, factor: str, of: str = "#1", number: str = "#3") -> str:
    return (
        f"{number}=(CONVERSION_BASED_UNIT('{name}',{number}2)LENGTH_UNIT()NAMED_UNIT(#4));\n"
        f"{number}2=LENGTH_MEASURE_WITH_UNIT(LENGTH_MEASURE({factor}),{of});\n"
    )


@pytest.mark.parametrize(
    ("entities", "unit"),
    [
        (CONTEXT + "#3 = ( LENGTH_UNIT() NAMED_UNIT(*) SI_UNIT(.MILLI.,.METRE.) );", 1e-3),
        (CONTEXT + "#3=(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT($,.METRE.));", 1.0),
        (CONTEXT + MM + converted("INCH", "25.4"), 0.0254),
        (MM + converted("METRE", "1.E3") + CONTEXT, 1.0),
        (CONTEXT + MM + converted("FOOT", "12.", "#5") + converted("an inch", "2.54E+1", number="#5"), 0.3048),
        (CONTEXT + MM + "#3=(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT(.CENTI.,.METRE.));", 1e-2),
        (MM + converted("INCH", "25.4") + CONTEXT.replace(",#3", ""), 0.0),
    ],
)
def test_step_states_its_unit(tmp_path, entities, unit):
    """The unit is what the context assigns, whatever it is called, by way of several multiples; none is 0 here."""
    path = tmp_path / "a.step"
    path.write_text(f"#9=(NAMED_UNIT(*)PLANE_ANGLE_UNIT()SI_UNIT($,.RADIAN.));\n{entities}\n")
    assert stated_unit(path) == pytest.approx(unit, rel=1e-14)


@pytest.mark.parametrize("of", ["#3", "#77", "#9"])
@pytest.mark.parametrize("factor", ["1.", "1.E999"])
def test_a_step_unit_that_leads_nowhere_is_named(tmp_path, of, factor):
    path = tmp_path / "a.step"
    angle = "#9=(NAMED_UNIT(*)PLANE_ANGLE_UNIT()SI_UNIT($,.RADIAN.));"
    path.write_text(f"{angle}\n{CONTEXT}{converted('X', factor, of)}\n")
    with pytest.raises(shapes.GeometryError, match=r"a\.step: #3 .*export"):
        stated_unit(path)


def test_a_second_lip_has_the_volume_of_its_rings() -> None:
    """Plate, two lips and less the annular port between them, by the radii of each."""
    seat = shapes.AnnularSeat(
        bore_radius=7e-3, lip_width=1e-3, lip_height=0.5e-3, lip_edge_radius=0.0, second_lip_radius=12e-3,
        second_lip_width=2e-3, port_depth=1e-3, outer_radius=16e-3, thickness=6e-3,
    )  # fmt: skip
    rings = ((7e-3, 16e-3, 6e-3), (7e-3, 8e-3, 0.5e-3), (12e-3, 14e-3, 0.5e-3), (8e-3, 12e-3, -1e-3))
    assert seat.volume == pytest.approx(sum(math.pi * (b**2 - a**2) * h for a, b, h in rings), rel=1e-12)
    radii = [radius for ring in seat.profile.rings("contact") for radius in ring]
    assert radii == pytest.approx([7e-3, 8e-3, 12e-3, 14e-3], rel=1e-12)
