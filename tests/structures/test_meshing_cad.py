"""CAD files: units, selectors, regions, what cannot be read, and the ladder of remedies."""

import json
import math
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from seatfem.structures.mesh._gmsh_solid import LADDER, Rung, retry_with_healing
from seatfem.structures.shapes import CadPart, ConeFace, GeometryError, NamedFace, PlaneFace, PointFace, Region, encode
from tests.solids import MeshingError, MeshSpec, inspect_geometry, make_mesh

MESHES = Path(__file__).resolve().parents[2] / "meshes"
COARSE = MeshSpec(6e-3, 4e-3)
UP, DOWN = (0.0, 0.0, 1.0), (0.0, 0.0, -1.0)
INSERT = MESHES / "insert_seat.step"
GREY, ORANGE = (128, 128, 128, 255), (255, 170, 0, 255)


def ring(outer: float, inner: float) -> float:
    return math.pi * (outer**2 - inner**2)


BORE, PLATE = 4e-3, ring(12e-3, 4e-3)
# contact and clamped areas, from the files' own parameters
KIDNEY = math.radians(150) * 4.5e-3  # length of the line that the port lies about
FILES = {
    "annular_seat": (ring(4.9e-3, 4.1e-3), PLATE),
    "flat_seat": (ring(5e-3, 4e-3), PLATE),
    "conical_seat": (2 * math.pi * (BORE + math.sqrt(0.5) * 1e-3) * 1e-3, PLATE),
    "valve_plate": (6 * ring(4e-3, 3e-3), ring(18e-3, 16e-3)),
    "reed_plate": (3 * ring(4e-3, 3e-3), 36e-3 * 16e-3 - 32e-3 * 12e-3),
    "stopper": (ring(2e-3, 0), ring(6e-3, 0)),
    "domed_stopper": (2 * math.pi * 20e-3 * (20e-3 - math.sqrt(20e-3**2 - 2e-3**2)), ring(6e-3, 0)),
    "bar": (9e-6, 9e-6),
    "block": (6e-6, 320e-6),
    "valve_body": (ring(10e-3, 4e-3), ring(20e-3, 4e-3) - 4 * ring(2.25e-3, 0)),
    "insert_seat": (ring(8e-3, 4e-3), PLATE),
    "slot_seat": (1e-3 * (10e-3 + math.pi * 6e-3), 720e-6 - (5e-3 * 5e-3 + ring(2.5e-3, 0))),
    "retainer": (200e-3 * math.asin(30 / 200) * 10e-3, 300e-6),
    "kidney_seat": (2 * KIDNEY * 1e-3 + math.pi * 3.4e-6, 720e-6 - (KIDNEY * 2.4e-3 + ring(1.2e-3, 0))),
}


@pytest.mark.slow(but="bar")
@pytest.mark.parametrize("name", FILES)
def test_every_file_is_meshed_by_its_colours(name):
    seat = make_mesh(CadPart(MESHES / f"{name}.step"), COARSE)
    contact, fixed = FILES[name]
    assert seat.quality.cad_areas["contact"] == pytest.approx(contact, rel=1e-6)
    assert seat.quality.cad_areas["fixed"] == pytest.approx(fixed, rel=1e-6)
    assert seat.quality.volume == pytest.approx(seat.quality.cad_volume, rel=0.02)
    assert seat.quality.min_scaled_jacobian > 0.0
    assert seat.provenance.notes == ()


UNIT = "#452 = ( LENGTH_UNIT() NAMED_UNIT(*) SI_UNIT(.MILLI.,.METRE.) );"
MULTIPLE = "{} = ( CONVERSION_BASED_UNIT('{}',{}0)LENGTH_UNIT()NAMED_UNIT(#1) );{}0 = {};"
MEASURE = "LENGTH_MEASURE_WITH_UNIT(LENGTH_MEASURE({}),{})"
COMPLEX = "(LENGTH_MEASURE_WITH_UNIT()MEASURE_WITH_UNIT(LENGTH_MEASURE({}),{}))"


@pytest.mark.parametrize(
    ("units", "unit", "factor"),
    [
        (MULTIPLE.format("#452", "METRE", "#452", "#452", MEASURE.format("2.", "#901")), None, 2),
        (MULTIPLE.format("#452", "X", "#452", "#452", COMPLEX.format("2.", "#901")), None, 2),
        (
            MULTIPLE.format("#452", "X", "#452", "#452", MEASURE.format("2.", "#900"))
            + MULTIPLE.format("#900", "Y", "#900", "#900", MEASURE.format("1.5", "#901")),
            None,
            3,
        ),
        ("#452 = ( NAMED_UNIT(*) PLANE_ANGLE_UNIT() SI_UNIT($,.RADIAN.) );", 5e-3, 5),
    ],
)
def test_lengths_are_read_in_the_unit_that_is_stated(tmp_path, units, unit, factor):
    """The kernel reads multiples, and multiples of multiples, as what they are; `unit` counts where none is stated."""
    text, path = (MESHES / "block.step").read_text(), tmp_path / "a.step"
    assert UNIT in text
    path.write_text(text.replace(UNIT, units + UNIT.replace("#452", "#901")))
    sides, plain = (inspect_geometry(CadPart(*each)).shape.extent for each in ((path, unit), (MESHES / "block.step",)))
    np.testing.assert_allclose(sides, factor * plain, rtol=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize(
    "regions",
    [(Region("body", colour=GREY), Region("ring", colour=ORANGE)), (Region("ring", order=2), Region("body", order=1))],
)
def test_solids_become_conformal_regions(regions):
    seat = make_mesh(CadPart(INSERT, regions=regions), MeshSpec(3e-3))
    mesh = seat.mesh
    volumes = dict.fromkeys(("body", "ring"), 0.0)
    corners = mesh.p[:, mesh.t]
    edges = corners[:, 1:] - corners[:, :1]
    each = np.abs(np.linalg.det(np.moveaxis(edges, (0, 1, 2), (2, 1, 0)))) / 6
    for name in volumes:
        volumes[name] = float(each[mesh.subdomains[name]].sum())
    exact = {"ring": ring(8e-3, 4e-3) * 3e-3, "body": PLATE * 9e-3 - ring(8e-3, 4e-3) * 3e-3}
    assert volumes == pytest.approx(exact, rel=0.06)  # straight elements: chords of the circles
    assert seat.quality.cad_volume == pytest.approx(PLATE * 9e-3, rel=1e-9)
    assert len(mesh.subdomains["body"]) + len(mesh.subdomains["ring"]) == mesh.nelements
    # conformal: the interface is inside, so the outer surface is that of one ring of 24 x 8 x 9 mm
    hollow = 2 * PLATE + 2 * math.pi * (12e-3 + 4e-3) * 9e-3
    a, b, c = np.moveaxis(mesh.p[:, mesh.facets[:, mesh.boundary_facets()]], 1, 0)
    outer = np.linalg.norm(np.cross((b - a).T, (c - a).T), axis=1).sum() / 2
    assert outer == pytest.approx(hollow, rel=0.06)


@pytest.mark.slow
def test_regions_that_are_not_there_list_what_is():
    with pytest.raises(GeometryError, match=r"'ring' \(colour \(1, 2, 3, 255\)\)") as caught:
        make_mesh(CadPart(INSERT, regions=(Region("ring", colour=(1, 2, 3, 255)),)), COARSE)
    assert "solid 2: name" in str(caught.value)
    assert str(ORANGE) in str(caught.value)
    with pytest.raises(GeometryError, match=r"'b'.*another"):
        make_mesh(CadPart(INSERT, regions=(Region("a", order=1), Region("b", colour=GREY))), COARSE)


BODY = MESHES / "valve_body.step"


def body_areas(**faces) -> dict[str, float]:
    return dict(make_mesh(CadPart(BODY, **faces), COARSE).quality.cad_areas)


def test_cone_selector():
    part = CadPart(MESHES / "conical_seat.step", contact=ConeFace(math.pi / 4, radius_max=4.5e-3))
    area = math.pi * (2 * BORE + 0.5e-3 * math.sqrt(0.5)) * 0.5e-3
    assert make_mesh(part, COARSE).quality.cad_areas["contact"] == pytest.approx(area, rel=1e-9)


@pytest.mark.slow
def test_point_on_an_edge_is_ambiguous():
    with pytest.raises(GeometryError, match=r"'contact'.*2 faces"):
        body_areas(contact=PointFace((10e-3, 0.0, 14e-3)))
    with pytest.raises(GeometryError, match=r"'contact' \(face.*\(50, 0, 0\) mm\)"):
        body_areas(contact=PointFace((50e-3, 0.0, 0.0)))


@pytest.mark.slow
def test_face_names(tmp_path):
    with pytest.raises(GeometryError, match=r"names.*export") as caught:
        body_areas(contact=NamedFace("SEAT"))
    assert "half angle" not in str(caught.value)
    assert "Cylinder" in str(caught.value)
    named = tmp_path / "named.step"
    text = (MESHES / "bar.step").read_text()
    shell = text[text.index("CLOSED_SHELL") :].split("(")[2].split(")")[0].split(",")
    for k, face in enumerate(shell, 1):
        text = text.replace(f"{face} = ADVANCED_FACE(''", f"{face} = ADVANCED_FACE('FACE_{k}'")
    named.write_text(text)
    areas = []
    for k in range(1, 7):
        try:
            areas.append(make_mesh(CadPart(named, contact=NamedFace(f"FACE_{k}")), COARSE).quality.cad_areas["contact"])
        except GeometryError as error:
            assert "both 'contact' and 'fixed'" in str(error)  # noqa: PT017 - the clamped end, once
    assert sorted(areas) == pytest.approx([9e-6, *[90e-6] * 4], rel=1e-9)


@pytest.mark.slow
def test_sector_of_a_part_keeps_its_colours():
    quarter = make_mesh(CadPart(BODY), COARSE, sector=4).quality
    assert quarter.cad_areas["contact"] == pytest.approx(ring(10e-3, 4e-3) / 4, rel=1e-9)
    with pytest.raises(GeometryError, match=r"sector = 3:.*y = 0.*1/3.*0\.\d+"):
        make_mesh(CadPart(BODY), COARSE, sector=3)


@pytest.mark.slow
def test_unit_against_header_and_size():
    with pytest.raises(GeometryError) as caught:
        make_mesh(CadPart(BODY, unit=1.0), COARSE)
    message = str(caught.value)
    for part in (
        "states 0.001 m per unit",
        "says 1;",
        "40 x 40 x 14 mm by the file",
        "4e+04 x 4e+04",
        "Leave unit out",
    ):
        assert part in message
    with pytest.raises(GeometryError, match=r"4e\+04 .*0\.001 m.*40 x 40 x 14 mm"):
        make_mesh(CadPart(BODY, unit=1.0, overrule=True), COARSE)
    with pytest.raises(GeometryError, match=r"0\.04 x 0\.04 x 0\.014 mm.*1e-06 m"):
        make_mesh(CadPart(BODY, unit=1e-6, overrule=True), COARSE)


@pytest.mark.parametrize(
    ("name", "text", "message"),
    [
        ("a.step", "", "is empty"),
        ("a.step", "solid cube\nfacet", r"STEP.*'solid cube"),
        ("a.stp", "ISO-10303-21;\nHEADER;", "is cut off"),
        ("a.brep", "ISO-10303-21;", "is no BREP file"),
    ],
)
def test_unreadable_files_are_named(tmp_path, name, text, message):
    path = tmp_path / name
    path.write_text(text)
    with pytest.raises((GeometryError, MeshingError), match=rf"{name}: .*{message}"):
        make_mesh(CadPart(path, unit=1e-3), COARSE)


@pytest.mark.slow
def test_brep_file(tmp_path):
    path = tmp_path / "box.brep"
    script = (
        "import gmsh, sys; gmsh.initialize([], False); gmsh.option.setNumber('General.Terminal', 0); "
        "gmsh.model.occ.addBox(0, 0, 0, 10, 5, 4); gmsh.model.occ.synchronize(); gmsh.write(sys.argv[1])"
    )
    subprocess.run([sys.executable, "-c", script, str(path)], check=True, stdout=subprocess.DEVNULL)
    part = CadPart(path, unit=1e-3, contact=PlaneFace(UP, 4e-3), fixed=PlaneFace(DOWN, 0.0))
    assert make_mesh(part, COARSE).quality.volume == pytest.approx(200e-9, rel=1e-12)


@pytest.mark.slow
def test_a_contradictory_surface_is_named_with_its_place(tmp_path):
    path = tmp_path / "bad.step"
    text = (MESHES / "annular_seat.step").read_text()
    spoiled = re.sub(r"(CYLINDRICAL_SURFACE\('',#\d+),12\.\)", r"\1,14.)", text)  # the edges stay at 12 mm
    assert spoiled != text
    path.write_text(spoiled)
    with pytest.raises(MeshingError) as caught:
        make_mesh(CadPart(path), COARSE)
    message = str(caught.value)
    assert re.search(r"bad\.step: .*check and heal it; .*surface 2 \(Cylinder\): .*2 mm .*\(", message)
    for rung in LADDER:
        assert f"{rung.name}: surface 2" in message


HEALING = """
import gmsh, json, sys
from seatfem.structures.mesh._gmsh_solid import build
from seatfem.structures.mesh._gmsh_worker import OPTIONS
from seatfem.structures.shapes import decode
gmsh.initialize([], readConfigFiles=False, interruptible=False)
for option, value in OPTIONS.items():
    gmsh.option.setNumber(option, value)
tags = build(gmsh, decode(json.loads(sys.argv[1])), sectors=1, heal=True)
named = {gmsh.model.getPhysicalName(3, group): group for _, group in gmsh.model.getPhysicalGroups(3)}
regions = {name: gmsh.model.getEntitiesForPhysicalGroup(3, group) for name, group in named.items()}
mass = gmsh.model.occ.getMass
areas = {name: sum(mass(2, tag) for tag in faces) for name, faces in tags.items()}
volumes = {name: sum(mass(3, tag) for tag in solids) for name, solids in regions.items()}
open(sys.argv[2], "w").write(json.dumps([areas, volumes, len(gmsh.model.getEntities(2))]))
"""


@pytest.mark.slow
def test_healing_keeps_colours_and_regions(tmp_path):
    part = CadPart(INSERT, regions=(Region("ring", colour=ORANGE), Region("body", colour=GREY)))
    record = tmp_path / "found.json"
    command = [sys.executable, "-c", HEALING, json.dumps(encode(part)), str(record)]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL, cwd=MESHES.parent)
    areas, volumes, faces = json.loads(record.read_text())
    assert areas == pytest.approx({"contact": 1e6 * ring(8e-3, 4e-3), "fixed": 1e6 * PLATE}, rel=1e-6)
    inset = 1e6 * ring(8e-3, 4e-3) * 3  # mm^3
    assert volumes == pytest.approx({"ring": inset, "body": 1e6 * PLATE * 9 - inset}, rel=1e-6)
    assert faces == 8  # four around the ring, six around the body, two of them shared


def test_the_ladder_reports_every_rung():
    tried = []

    def attempt(rung: Rung) -> None:
        tried.append(rung)
        if not rung.heal:
            raise RuntimeError("overlapping facets")

    notes = retry_with_healing("seat.step", LADDER, attempt, lambda: "surface 7 about (1, 2, 3) mm")
    assert tried == list(LADDER[:2])
    assert notes == [
        "not meshed as it is: overlapping facets (surface 7 about (1, 2, 3) mm)",
        "meshed with shapes healed",
    ]
