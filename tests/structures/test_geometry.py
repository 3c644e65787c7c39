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


@pytest.mark.parametrize(
    ("entities", "unit"),
    [
        ("#1 = ( LENGTH_UNIT() NAMED_UNIT(*) SI_UNIT(.MILLI.,.METRE.) );", 1e-3),
        ("#1=(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT($,.METRE.));", 1.0),
        (
            "#1=(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT(.MILLI.,.METRE.));\n"
            "#3=(CONVERSION_BASED_UNIT('INCH',#2)LENGTH_UNIT()NAMED_UNIT(#4));",
            0.0254,
        ),
    ],
)
def test_step_states_its_unit(tmp_path, entities, unit):
    path = tmp_path / "a.step"
    path.write_text(f"#9=(NAMED_UNIT(*)PLANE_ANGLE_UNIT()SI_UNIT($,.RADIAN.));\n{entities}\n")
    assert stated_unit(path) == unit
