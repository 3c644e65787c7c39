"""Meshes that go out in another program's format and come back; what meshio is not let near."""

import base64
import re
import zlib
from pathlib import Path

import pytest

from seatfem.structures.errors import MeshError
from seatfem.structures.formats.mesh_files import read_file, read_mesh
from seatfem.structures.formats.writing import WRITTEN, write_mesh

UNIT = 1e-2  # metres; the files of `write_mesh_files` are in centimetres
ALL = ("tet-1", "tet-2", "hex-1", "hex-2")
SOLID = ("tet-1", "tet-2", "hex-1")
FIRST = ("tet-1", "hex-1")
TET = ("tet-1",)
# What comes back, and what groups are called: by their names, by a word before their numbers, not at all.
HELD = {
    ".msh": (ALL, "named"),
    ".inp": (SOLID, "named"),
    ".med": (SOLID, "named"),
    ".vtu": (ALL, "named"),
    ".vtk": (ALL, "named"),
    ".xdmf": (FIRST, "named"),
    ".e": (ALL, "named"),
    ".bdf": (SOLID, "PID"),
    ".avs": (FIRST, "avsucd:material"),
    ".mesh": (FIRST, "medit:ref"),
    ".meshb": (FIRST, "medit:ref"),
    ".vol": (SOLID, "netgen:index"),
    ".post": (ALL, ""),
    ".mdpa": (ALL, ""),
    ".cgns": (TET, ""),
    ".h5m": (TET, ""),
    ".xml": (TET, ""),
    ".ele": (TET, ""),
    ".tec": (("hex-1",), ""),
}
ALIKE = {".xmf": ".xdmf", ".exo": ".e", ".ex2": ".e", ".nas": ".bdf", ".dat": ".bdf", ".fem": ".bdf", ".dato": ".post"}


@pytest.fixture(scope="module")
def seats(written_meshes):
    return {name: read_mesh(written_meshes / f"{name}-2.inp", unit=UNIT) for name in ALL}


def same(seat, back):
    # Some formats hold ten digits.
    assert (back.order, back.shape, back.quality.elements) == (seat.order, seat.shape, seat.quality.elements)
    assert back.quality.volume == pytest.approx(seat.quality.volume, rel=1e-8)
    for name in ("contact", "fixed"):
        assert back.quality.areas[name] == pytest.approx(seat.quality.areas[name], rel=1e-8)


CASES = [
    *((suffix, name) for suffix, (names, _) in HELD.items() for name in names),
    *((suffix, HELD[other][0][0]) for suffix, other in ALIKE.items()),
]


@pytest.mark.usefixtures("read_by_one_process")
@pytest.mark.parametrize(("suffix", "name"), CASES)
def test_a_mesh_comes_back(seats, tmp_path, suffix, name):
    """Elements, curved where they were; groups under their names, or numbered in the order that is told."""
    path, (_, groups) = tmp_path / f"a{suffix}", HELD[ALIKE.get(suffix, suffix)]
    names = write_mesh(seats[name], path, unit=1e-3)
    assert len(list(tmp_path.iterdir())) == (2 if suffix == ".ele" else 1)
    if not groups:
        back = read_file(path)
        assert len(back.cells) == seats[name].quality.elements
        assert not back.surfaces
        return
    asked = ("contact", "fixed")
    told = asked if groups == "named" else [f"{groups} {1 + names.index(group)}" for group in asked]
    back = read_mesh(path, unit=1e-3, contact=told[0], fixed=told[1])
    same(seats[name], back)
    volume = "steel" if groups == "named" else f"{groups} {1 + names.index('steel')}"
    assert volume in back.mesh.subdomains or HELD[suffix if suffix in HELD else ALIKE[suffix]] is HELD[".e"]


REFUSED = [(suffix, name) for suffix, (names, _) in HELD.items() for name in ALL if name not in names]


@pytest.mark.slow(but=".ele-hex-1")
@pytest.mark.parametrize(("suffix", "name"), [*REFUSED, (".su2", "tet-1")])
def test_what_a_format_would_lose_is_refused(seats, tmp_path, suffix, name):
    with pytest.raises(MeshError, match=rf"a\{suffix}: "):
        write_mesh(seats[name], tmp_path / f"a{suffix}")
    assert list(tmp_path.iterdir()) == []


def test_every_format_that_is_claimed_is_tested():
    """The page's table, what is written, and the table of these tests are one."""
    assert {*HELD, *ALIKE} == {*WRITTEN}
    text = (
        (Path(__file__).parents[2] / "docs" / "mesh_formats.md").read_text(encoding="utf-8").partition("## Readers")[0]
    )
    rows = [[cell.strip() for cell in row.split("|")[1:-1]] for row in text.splitlines() if row.startswith("| .")]
    told = {suffix: row for row in rows for suffix in re.findall(r"\.\w+", row[0].partition("and Fluent")[0])}
    assert {suffix for suffix, row in told.items() if row[2] != "no"} == {*WRITTEN}
    for suffix in WRITTEN:
        names, groups = HELD[ALIKE.get(suffix, suffix)]
        assert told[suffix][2] == ", ".join(names), suffix
        assert told[suffix][3].startswith(groups if groups else "none"), suffix


def test_nastran_holds_small_coordinates_and_says_the_names(seats, tmp_path):
    """Fields of 16 characters, in which meshio has no room for -1.23456789012E-9; every element has a property."""
    path = tmp_path / "a.bdf"
    names = write_mesh(seats["tet-2"], path, unit=1.0)
    lines = path.read_text().splitlines()
    assert lines[: len(names)] == [f"$ PID {number}: {name}" for number, name in enumerate(names, start=1)]
    cards = [line for line in lines if line.startswith(("CTETRA", "CTRIA3"))]
    assert {line[:8] for line in cards} == {"CTETRA  ", "CTRIA3  "}
    assert all(int(line[16:24]) > 0 for line in cards)
    assert all(len(line) <= 80 for line in lines)
    same(
        seats["tet-2"],
        read_mesh(path, contact=f"PID {1 + names.index('contact')}", fixed=f"PID {1 + names.index('fixed')}"),
    )


def test_bad_requests(seats, tmp_path):
    with pytest.raises(MeshError, match="no suffix: choose one of"):
        write_mesh(seats["tet-1"], tmp_path / "a")
    with pytest.raises(MeshError, match="unit = -1: must be > 0"):
        write_mesh(seats["tet-1"], tmp_path / "a.vtu", unit=-1.0)
    (tmp_path / "a.stl").write_text("solid a\n")
    with pytest.raises(MeshError, match="surfaces only"):
        read_mesh(tmp_path / "a.stl")


def refused(path, text, message):
    path.write_text(text)
    with pytest.raises(MeshError, match=message):
        read_mesh(path)


def test_xml_that_brings_more_in(tmp_path):
    entity = '<?xml version="1.0"?><!DOCTYPE a [<!ENTITY b SYSTEM "/etc/passwd">]><VTKFile>&b;</VTKFile>'
    refused(tmp_path / "a.vtu", entity, "defines or includes entities")
    refused(tmp_path / "a.xdmf", entity, "defines or includes entities")
    item = '<Xdmf Version="3.0"><Domain><Grid><DataItem Format="HDF">{}:/x</DataItem></Grid></Domain></Xdmf>'
    for name in ("/etc/secret.h5", "../secret.h5", "sub/secret.h5", "..", "input.xdmf"):
        refused(tmp_path / "a.xdmf", item.format(name), "put it into the same folder")
    refused(tmp_path / "a.xdmf", item.format("b").replace("HDF", "Binary"), "raw bytes")


@pytest.mark.slow
def test_a_grid_that_unfolds(tmp_path):
    """4 GB of zeros, packed into 4 MB, for the reader's process to choke on."""
    block = zlib.compress(bytes(1 << 26), 9)
    head = b"".join(n.to_bytes(4, "little") for n in (64, 1 << 26, 1 << 26, *[len(block)] * 64))
    data = base64.b64encode(head).decode() + base64.b64encode(block * 64).decode()
    refused(
        tmp_path / "a.vtu",
        '<VTKFile type="UnstructuredGrid" version="0.1" byte_order="LittleEndian" header_type="UInt32" '
        'compressor="vtkZLibDataCompressor"><UnstructuredGrid><Piece NumberOfPoints="1" NumberOfCells="1"><Points>'
        f'<DataArray type="Float64" NumberOfComponents="3" format="binary">{data}</DataArray></Points>'
        "</Piece></UnstructuredGrid></VTKFile>",
        r"a\.vtu: .*\(MemoryError",
    )
