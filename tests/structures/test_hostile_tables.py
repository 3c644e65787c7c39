"""Decks, matrices and tables made to cost time or memory."""

import gzip
import io
import pickle
import zipfile

import numpy as np
import pytest
from scipy import sparse

from impact.bodies.time_series import TimeSeriesError, read_time_series
from impact.measured.frf import FrequencyResponseError, read_frf, read_impulse_response
from seatfem.structures.formats.decks import Deck, with_included
from seatfem.structures.formats.matrices import read_matrices
from seatfem.structures.formats.uff import UffError, read_modes_uff
from seatfem.structures.formats.uff_responses import read_frf_uff
from tests.bounded import assert_refused, bounded
from tests.solids import MeshError, read_mesh
from tests.steps import GreensFunctionError, ModelError
from tests.universal_files import function

DECK = "*NODE\n1,0,0,0\n2,1,0,0\n3,0,1,0\n4,0,0,1\n*ELEMENT,TYPE=C3D4\n1,1,2,3,4\n"
BULK = "GRID,1,,0.,0.,0.\nGRID,2,,1.,0.,0.\nGRID,3,,0.,1.,0.\nGRID,4,,0.,0.,1.\nCTETRA,1,3,1,2,3,4\n"


def refused(path, text, message):
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    with bounded(), pytest.raises(MeshError, match=message):
        read_mesh(path)


def test_files_that_include_files_that_include_files(tmp_path):
    """Eight files with 14 inclusions each, which would be 14^8 readings, are refused."""
    for level in range(8):
        (tmp_path / f"{level}.inp").write_text(f"*INCLUDE, INPUT={level + 1}.inp\n" * 14)
    (tmp_path / "8.inp").write_text(DECK)
    with pytest.raises(MeshError, match="200 other files"):
        read_mesh(tmp_path / "0.inp")
    assert len(with_included(tmp_path / "0.inp")) == 9


def test_a_deck_as_large_as_its_files_together(tmp_path, monkeypatch):
    monkeypatch.setattr(Deck.__init__, "__defaults__", (200, 3000))
    (tmp_path / "part.inp").write_text("** " + "x" * 1000)
    deck = "*INCLUDE, INPUT=part.inp\n" * 3
    refused(tmp_path / "a.inp", deck, r"part\.inp: .* MB; .*up to")


@pytest.mark.parametrize(
    ("name", "lines", "message"),
    [
        ("a.inp", "*NSET, NSET=A, GENERATE\n1,400000000\n", r"a\.inp:8: \*NSET: 4e\+08 members.*2e\+05"),
        (
            "a.inp",
            "*ELSET, ELSET=E, GENERATE\n1,5000\n*SURFACE, NAME=S\n" + "E,S1\n" * 1000,
            r"\*SURFACE: 5000 members, 2\.05e\+05",
        ),
        (
            "a.inp",
            "*PART, NAME=P\n*NSET, NSET=A\n"
            + "1\n" * 5000
            + "*END PART\n"
            + "".join(f"*INSTANCE, NAME=I{k}, PART=P\n*END INSTANCE\n" for k in range(90)),
            r"a\.inp:\d+: \*INSTANCE: 2\d+ lines .*at most 2e\+05",
        ),
        ("a.inp", "*NSET" + ",\n" * 200_000, r"a\.inp:8: .*4096"),
        ("a.inp", "*ELEMENT, TYPE=C3D4\n" + "9" * 30 + ",1,2,3,4\n", r"a\.inp:8: .*9{30}"),
        ("a.bdf", "INCLUDE 'a\n" * 200_000, r"a\.bdf:1: .*4096|within the deck's folder"),
        ("a.bdf", "".join(f"SPC1,{k},123,1,THRU,90000\n" for k in range(900)), r"SPC1: has .*2e\+03 are the most"),
        (
            "a.bdf",
            "".join(f"CORD2R,{k},{k + 1},0.,0.,0.,0.,0.,1.\n,1.,0.,0.\n" for k in range(1, 5000)) + "GRID,5,1\n",
            "GRID: coordinate system 1 ",
        ),
    ],
)
def test_decks_that_stand_for_much(tmp_path, monkeypatch, name, lines, message):
    """Sets, repeated parts, endless lines and systems in each other are refused within bounds of time and memory."""
    monkeypatch.setattr("seatfem.structures.formats.abaqus.MOST_MEMBERS", 200_000)
    monkeypatch.setattr("seatfem.structures.formats.nastran_mesh.MOST_HELD", 2_000)
    refused(tmp_path / name, (DECK if name == "a.inp" else BULK) + lines, message)


FACES = {
    "sets.bdf": (BULK + "".join(f"SPC1,{k},123,1,THRU,4\n" for k in range(20_000)), "must be at most 5000"),
    "full.inp": (DECK + "*NSET, NSET=A, GENERATE\n1,5000000\n", "node 5 "),
    "nodes.inp": (
        DECK.replace("*ELEMENT", "".join(f"{k},0,0,{k}\n" for k in range(5, 4001)) + "*ELEMENT", 1)
        + "*NSET, NSET=N, GENERATE\n1,4000\n*SURFACE, NAME=S, TYPE=NODE\n"
        + "N\n" * 9000,
        "must be at most 5e+06",
    ),
    "blanks.xdmf": ("<Xdmf>" + ">" + " " * 400_000, ".xdmf file"),
    "place.inp": (
        DECK.replace("*ELEMENT", "".join(f"{k},0,0,0\n" for k in range(5, 40_001)) + "*ELEMENT", 1)
        + "".join(f"{k},{k},{k + 1},{k + 2},{k + 3}\n" for k in range(5, 39_997)),
        "pairs of its 39999 nodes are nearer to each other than",
    ),
    "promise.unv": (
        "    -1\n  2412\n" + f"{1:10}{111:10}{1:10}{1:10}{1:10}{400000000:10}\n         1\n    -1\n",
        "400000000 nodes: must be 4",
    ),
}


@pytest.mark.slow(but=("full.inp", "late.xdmf", "promise.unv"))
@pytest.mark.parametrize("name", FACES)
def test_small_mesh_files_that_stand_for_much(tmp_path, capfd, name):
    text, words = FACES[name]
    (tmp_path / name).write_text(text)
    assert_refused(["faces", str(tmp_path / name)], capfd, words)


def test_a_binary_response_of_promises(tmp_path):
    head = function().splitlines()[2:13]
    head[6] = head[6].replace(f"{10:10}", f"{10**8:10}")
    path = tmp_path / "a.uff"
    path.write_text("    -1\n    58b     1     2          11           0\n" + "\n".join(head) + "\n    -1\n")
    with bounded(), pytest.raises(UffError, match=r"a\.uff:\d+: dataset 58: has no end"):
        read_frf_uff(path, ports={"contact": (1, "+z")})


M3 = "%%MatrixMarket matrix coordinate real general\n"


def matrix_refused(tmp_path, name, data, message):
    path = tmp_path / name
    path.write_bytes(data)
    with bounded(), pytest.raises(ModelError, match=message):
        read_matrices(path, path, ports={"contact": {0: 1.0}})


def npy(shape, body=b"", dtype="<f8"):
    head = io.BytesIO()
    np.lib.format.write_array_header_1_0(head, {"descr": dtype, "fortran_order": False, "shape": shape})
    return head.getvalue() + body


def zipped(**members):
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as out:
        for name, data in members.items():
            out.writestr(f"{name}.npy", data)
    return file.getvalue()


@pytest.mark.slow
def test_matrices_that_unfold(tmp_path, monkeypatch):
    monkeypatch.setattr("seatfem.structures.formats.matrices.FREE", 1 << 20)
    zeros = zipped(data=npy((1 << 20,), bytes(1 << 23)))
    matrix_refused(tmp_path, "K.npz", zeros, r"K\.npz: .*8 MB .* MB; .*1 MB")
    text = (M3 + "9 9 99999999\n" + "1 1 1\n" * 1_000_000).encode()
    matrix_refused(tmp_path, "K.mtx.gz", gzip.compress(text, 9), r"K\.mtx\.gz: .*1 MB, 20 times .*unpack")


def packed(outside=1):
    """Bytes of a matrix, with a column far outside."""
    buffer, matrix = io.BytesIO(), sparse.csr_array(np.eye(6) + 1.0)
    matrix.indices[4] *= outside
    sparse.save_npz(buffer, matrix)
    return buffer.getvalue()


TWO = M3.encode() + b"2 2 2\n1 1 1.0"


@pytest.mark.parametrize(
    ("name", "data", "message"),
    [
        ("K.npy", npy((50_000, 50_000)), r"1\.\d+e\+04 MB, .*0\.000\d+ MB"),
        ("K.npz", zipped(data=npy((1 << 30,)), indices=npy((1,))), "8192 MB"),
        ("K.npy", npy((2, 2), pickle.dumps([1]), "|O"), "numbers, not Python objects"),
        ("K.mtx", (M3 + "9 9 900000000\n1 1 1\n").encode(), "900000000 entries, .*9 x 9"),
        ("K.mtx", b"%%MatrixMarket matrix array real general\n90000 90000\n1\n", "it has 3 words; "),
        ("K.mtx", (M3 + "%" + "x" * 5_000_000 + "\n1 1 1\n1 1 1\n").encode(), "at most 65536 characters"),
        ("K.mtx.gz", gzip.compress(b"\0" * 5_000_000), "at most 65536 characters"),
        ("K.mtx", TWO + b"D-3\n2 2 1.0\n", "matrix"),
        ("K.mtx", TWO + b"\n2 2 1.00000\0\0\0\0001\n", "matrix"),
        ("K.mtx", M3.encode() + b"1000000000 1000000000 1\n1 1 1.0\n", "matrix"),
        ("K.mtx.gz", gzip.compress(TWO + b"\n2 2 1.0\n", mtime=0)[:-12], "matrix"),
        ("K.npz", packed(10**6), "matrix"),
        ("K.npy", b"\x93NUMPY\x01\x00\x76\x00{'descr': (((" + b" " * 110, "matrix"),
    ],
)  # fmt: skip
def test_matrices_that_claim_or_are_broken(tmp_path, name, data, message):
    """Some crash the libraries that read them, unless they are looked at first."""
    matrix_refused(tmp_path, name, data, message)


@pytest.mark.parametrize("text", ["," * 1_000_000, "time [s],force [N]\n" + ",".join("1" * 100) + "\n"])
def test_tables_of_many_columns(tmp_path, text):
    path = tmp_path / "p.csv"
    path.write_text(text)
    with pytest.raises(TimeSeriesError, match=r"p\.csv, line \d: \d+ columns, .*64"):
        read_time_series(path, "force")


def test_tables_of_many_lines(tmp_path, monkeypatch):
    monkeypatch.setattr("impact.files.csv_table.MOST_LINES", 1000)
    path = tmp_path / "p.csv"
    path.write_text("time [s],force [N]\n" + "1,1\n" * 2000)
    with pytest.raises(TimeSeriesError, match=r"p\.csv, line 1001: 2 columns, 1001 lines"):
        read_time_series(path, "force")


@pytest.mark.parametrize(
    ("read", "error"),
    [
        (lambda path: read_time_series(path, "force"), TimeSeriesError),
        (read_impulse_response, GreensFunctionError),
        (read_frf, FrequencyResponseError),
        (lambda path: read_modes_uff(path, ports={"contact": (1, "+z")}), UffError),
    ],
)
def test_records_from_devices(tmp_path, read, error):
    path = tmp_path / "a.csv"
    path.symlink_to("/dev/zero")
    with pytest.raises(error, match=r"a\.csv: .*device"):
        read(path)
    with pytest.raises((TimeSeriesError, FrequencyResponseError, ValueError), match="no such file"):
        read(tmp_path / "none.csv")
