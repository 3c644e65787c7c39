"""Geometry specs, face selectors, and their plain-data form: nothing here starts gmsh."""

import math

import pytest

from seatfem.structures.shapes import AnnularSeat, Bar, Block, CadPart, ColourFace, GeometryError, PlaneFace
from seatfem.structures.shapes.cad import stated_unit


@pytest.mark.parametrize(
    ("spec", "values", "message"),
    [
        (AnnularSeat, {"bore_radius": -4e-3}, r"AnnularSeat.bore_radius = -4 mm:.*finite.*> 0"),
        (AnnularSeat, {"thickness": math.nan}, r"AnnularSeat.thickness = nan"),
        (AnnularSeat, {"outer_radius": 5e-3}, r"outer_radius = 5 mm:.*> 5 mm \(bore_radius \+ lip_width"),
        (AnnularSeat, {"lip_edge_radius": 0.5e-3, "lip_height": 1e-3}, r"lip_edge_radius = 0.5 mm:.*< 0.5 mm"),
        (AnnularSeat, {"lip_edge_radius": 0.3e-3, "lip_height": 0.2e-3}, r"< 0.2 mm \(the lip_height\)"),
        (AnnularSeat, {"lip_edge_radius": -1e-4}, r"lip_edge_radius = -0.1 mm"),
        (Bar, {"length": 1.0, "width": 0.0, "height": 1.0}, r"Bar.width = 0 mm"),
        (
            Block,
            dict.fromkeys(("width", "depth", "thickness", "patch_depth"), 1.0) | {"patch_width": 2.0},
            r"<= 1000 mm",
        ),
        (CadPart, {"path": "seat.igs"}, r"seat.igs:.*CAD.*'.igs'"),
        (CadPart, {"path": "seat.brep"}, r"states no unit"),
        (CadPart, {"path": "seat.step", "unit": -1.0}, r"CadPart.unit = -1"),
        (PlaneFace, {"normal": (0.0, 0.0, 0.0), "offset": 0.0}, r"must not be zero"),
        (ColourFace, {"colour": (256, 0, 0, 255)}, r"four numbers from 0 to 255"),
    ],
)
def test_bad_values_name_field_value_and_limit(spec, values, message):
    with pytest.raises(GeometryError, match=message):
        spec(**values)


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
    with pytest.raises(GeometryError, match=r"a\.step: #3 .*export"):
        stated_unit(path)


def test_a_second_lip_has_the_volume_of_its_rings() -> None:
    """Plate, two lips and less the annular port between them, by the radii of each."""
    seat = AnnularSeat(
        bore_radius=7e-3, lip_width=1e-3, lip_height=0.5e-3, lip_edge_radius=0.0, second_lip_radius=12e-3,
        second_lip_width=2e-3, port_depth=1e-3, outer_radius=16e-3, thickness=6e-3,
    )  # fmt: skip
    rings = ((7e-3, 16e-3, 6e-3), (7e-3, 8e-3, 0.5e-3), (12e-3, 14e-3, 0.5e-3), (8e-3, 12e-3, -1e-3))
    assert seat.volume == pytest.approx(sum(math.pi * (b**2 - a**2) * h for a, b, h in rings), rel=1e-12)
    radii = [radius for ring in seat.profile.rings("contact") for radius in ring]
    assert radii == pytest.approx([7e-3, 8e-3, 12e-3, 14e-3], rel=1e-12)
