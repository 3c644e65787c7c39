"""Meshes that go out in another program's format and come back; what meshio is not let near."""

import base64
import subprocess
import sys
import zlib
from pathlib import Path

import pytest

from seatfem.structures.formats.mesh_files import read_file, read_mesh
from seatfem.structures.formats.mesh_writing import write_mesh
from seatfem.structures.mesh.io import MeshError

UNIT = 1e-2  # metres; the files of `write_mesh_files` are in centimetres
ALL = ("tet-1", "tet-2", "hex-1", "hex-2")
NAMED = {
    ".msh": ALL,
    ".vtu": ALL,
    ".vtk": ALL,
    ".e": ALL,
    ".exo": ALL,
    ".inp": ("tet-1", "tet-2", "hex-1"),
    ".med": ("tet-1", "tet-2", "hex-1"),
    ".xdmf": ("tet-1", "hex-1"),
}
NUMBERED = {
    ".avs": ("avsucd:material", ("tet-1", "hex-1")),
    ".mesh": ("medit:ref", ("tet-1", "hex-1")),
    ".vol": ("netgen:index", ("tet-1", "tet-2", "hex-1")),
}
BARE = {".cgns": ("tet-1",), ".h5m": ("tet-1",), ".xml": ("tet-1",), ".post": ALL, ".ele": ("tet-1",)}


@pytest.fixture(scope="module")
def seats(tmp_path_factory):
    folder = tmp_path_factory.mktemp("files")
    script = Path(__file__).with_name("write_mesh_files.py")
    subprocess.run([sys.executable, str(script), str(folder)], check=True, capture_output=True)
    return {name: read_mesh(folder / f"{name}-2.inp", unit=UNIT) for name in ALL}


def cases(formats):
    return [(suffix, name) for suffix, names in formats.items() for name in names]


def same(seat, back):
    # Some formats hold ten digits.
    assert (back.order, back.shape, back.quality.elements) == (seat.order, seat.shape, seat.quality.elements)
    assert back.quality.volume == pytest.approx(seat.quality.volume, rel=1e-8)
    for name in ("contact", "fixed"):
        assert back.quality.areas[name] == pytest.approx(seat.quality.areas[name], rel=1e-8)


@pytest.mark.parametrize(("suffix", "name"), cases(NAMED))
def test_names_and_curved_elements_come_back(seats, tmp_path, suffix, name):
    path = tmp_path / f"a{suffix}"
    write_mesh(seats[name], path, unit=1e-3)
    assert [file.name for file in tmp_path.iterdir()] == [path.name]
    back = read_mesh(path, unit=1e-3)
    same(seats[name], back)
    assert "steel" in back.mesh.subdomains or suffix in (".e", ".exo")


@pytest.mark.parametrize(
    ("suffix", "key", "name"), [(s, key, n) for s, (key, names) in NUMBERED.items() for n in names]
)
def test_numbers_of_groups_come_back(seats, tmp_path, suffix, key, name):
    path = tmp_path / f"a{suffix}"
    names = write_mesh(seats[name], path, unit=1e-3)
    contact, fixed = (f"{key} {1 + names.index(group)}" for group in ("contact", "fixed"))
    same(seats[name], read_mesh(path, unit=1e-3, contact=contact, fixed=fixed))


@pytest.mark.parametrize(("suffix", "name"), cases(BARE))
def test_formats_that_hold_the_elements_only(seats, tmp_path, suffix, name):
    path = tmp_path / f"a{suffix}"
    write_mesh(seats[name], path, unit=1e-3)
    assert len(read_file(path).cells) == seats[name].quality.elements


@pytest.mark.parametrize(
    ("suffix", "name"), [(".mesh", "tet-2"), (".tec", "tet-1"), (".h5m", "hex-1"), (".inp", "hex-2"), (".xml", "hex-1")]
)
def test_what_a_format_would_lose_is_refused(seats, tmp_path, suffix, name):
    with pytest.raises(MeshError, match=rf"a\{suffix}: "):
        write_mesh(seats[name], tmp_path / f"a{suffix}")
    assert list(tmp_path.iterdir()) == []


def test_what_meshio_loses_of_a_deck(tmp_path):
    """Why Abaqus and Nastran files have readers of their own: surfaces, and groups by property."""
    import meshio

    deck = tmp_path / "a.inp"
    deck.write_text(
        "*NODE\n1,0,0,0\n2,1,0,0\n3,0,1,0\n4,0,0,1\n*ELEMENT,TYPE=C3D4,ELSET=Steel\n1,1,2,3,4\n"
        "*SURFACE, NAME=contact\nSteel, S1\n*SURFACE, NAME=fixed\nSteel, S2\n"
    )
    lost = meshio.abaqus.read(deck)
    assert "contact" not in {*lost.cell_sets, *lost.point_sets, *lost.cell_data}
    assert {"contact", "fixed"} <= read_mesh(deck).mesh.boundaries.keys()


def test_bad_requests(seats, tmp_path):
    with pytest.raises(MeshError, match="no suffix: meshes are written as"):
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
        refused(tmp_path / "a.xdmf", item.format(name), "only a file in the same folder is read")
    refused(tmp_path / "a.xdmf", item.format("b").replace("HDF", "Binary"), "a file of raw bytes, which is not read")


def test_a_grid_that_unfolds(tmp_path):
    """4 GB of zeros, packed into 4 MB, for the reader's process to choke on."""
    block = zlib.compress(bytes(1 << 30), 9)
    head = b"".join(n.to_bytes(4, "little") for n in (4, 1 << 30, 1 << 30, *[len(block)] * 4))
    data = base64.b64encode(head).decode() + base64.b64encode(block * 4).decode()
    refused(
        tmp_path / "a.vtu",
        '<VTKFile type="UnstructuredGrid" version="0.1" byte_order="LittleEndian" header_type="UInt32" '
        'compressor="vtkZLibDataCompressor"><UnstructuredGrid><Piece NumberOfPoints="1" NumberOfCells="1"><Points>'
        f'<DataArray type="Float64" NumberOfComponents="3" format="binary">{data}</DataArray></Points>'
        "</Piece></UnstructuredGrid></VTKFile>",
        r"a\.vtu: not readable as a \.vtu file \(MemoryError",
    )
