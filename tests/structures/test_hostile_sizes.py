"""Small files that stand for much: refused in words, within 10 s of the processor and 1 GiB, as command lines."""

import pytest

from tests.bounded import assert_refused, run_bounded

SOLID = "GRID,1,,0.,0.,0.\nGRID,2,,1.,0.,0.\nGRID,3,,0.,1.,0.\nGRID,4,,0.,0.,1.\nCTETRA,1,3,1,2,3,4\n"
DECK = "*NODE\n1,0,0,0\n2,1,0,0\n3,0,1,0\n4,0,0,1\n*ELEMENT,TYPE=C3D4\n1,1,2,3,4\n"
FILES = {
    "many.bdf": (
        SOLID + "".join(f"SPC1,{k},123,1,THRU,999999\n" for k in range(1, 301)),
        "many.bdf:11: SPC1: 1e+06 nodes, 6e+06",
    ),
    "one.bdf": (SOLID + "SPC1,1,123,1,THRU,999999\n" + "+,1,THRU,999999\n" * 300, "SPC1: 3.01e+08 nodes"),
    "full.bdf": (SOLID + "SPC1,1,123,1,THRU,4999999\n", "GRID 5 "),
    "sets.bdf": (SOLID + "".join(f"SPC1,{k},123,1,THRU,4\n" for k in range(20_000)), "must be at most 5000"),
    "parts.bdf": (SOLID + "".join(f"CTETRA,{k},{k},1,2,3,4\n" for k in range(9, 20_000)), "must be at most 5000"),
    "full.inp": (DECK + "*NSET, NSET=A, GENERATE\n1,5000000\n", "node 5 "),
    "sets.inp": (DECK + "".join(f"*NSET, NSET=N{k}\n1\n" for k in range(20_000)), "must be at most 5000"),
    "surfaces.inp": (
        DECK + "*ELSET, ELSET=E\n1\n" + "".join(f"*SURFACE, NAME=N{k}\nE, S1\n" for k in range(20_000)),
        "must be at most 5000",
    ),
    "nodes.inp": (
        DECK.replace("*ELEMENT", "".join(f"{k},0,0,{k}\n" for k in range(5, 4001)) + "*ELEMENT", 1)
        + "*NSET, NSET=N, GENERATE\n1,4000\n*SURFACE, NAME=S, TYPE=NODE\n"
        + "N\n" * 9000,
        "5e+06 together",
    ),
    "blanks.xdmf": ("<Xdmf>" + ">" + " " * 400_000, ".xdmf file"),
    "brackets.xdmf": ("<Xdmf>" + "> " * 200_000, ".xdmf file"),
    "late.xdmf": ("<?xml version='1.0'?>" + " " * 100_000 + "<!DOCTYPE x><Xdmf/>", "defines or includes entities"),
    "place.inp": (
        DECK.replace("*ELEMENT", "".join(f"{k},0,0,0\n" for k in range(5, 40_001)) + "*ELEMENT", 1)
        + "".join(f"{k},{k},{k + 1},{k + 2},{k + 3}\n" for k in range(5, 39_997)),
        "pairs of its 39999 nodes are nearer to each other than",
    ),
}
HEAD = "0\nSECTION\n2\nHEADER\n9\n$INSUNITS\n70\n4\n0\nENDSEC\n0\nSECTION\n2\nENTITIES\n"
LINE = "0\nLINE\n10\n{}\n20\n0\n11\n{}\n21\n0\n"
CIRCLE = "0\nCIRCLE\n10\n{}\n20\n{}\n40\n{}\n"
HOLES = [(3 * (k % 20) - 30, 3 * (k // 20) - 30) for k in range(400)]
DRAWINGS = {
    "lines.dxf": ("".join(LINE.format(k, k + 1) for k in range(4900)), "(4900, 0) mm"),
    "crowd.dxf": ("".join(LINE.format(k, k + 1) for k in range(50_000)), "more than 20000 entities"),
    "same.dxf": (LINE.format(0, 0) * 4900, "4898 points"),
    "long.dxf": ("0\nPOLYLINE\n" + "10\n0\n20\n0\n" * 400_000, "no LINE, ARC, CIRCLE"),
    "empty.dxf": ("0\nA\n" * 1_000_000, "more than 20000 entities"),
    "far.dxf": (LINE.format("1e300", "-1e300"), "a LINE beyond 1000 m"),
    "holes.dxf": (
        CIRCLE.format(0, 0, 60) + "".join(CIRCLE.format(x, y, 1) for x, y in HOLES),
        "28872: ",
    ),
    "unit.dxf": (None, "near line: 8"),
}
SHEET = """
[seat]
kind = "spring"
stiffness = "1e6 N/m"
[reed]
kind = "sheet"
file = "{}"
clamped = [["0 mm", "-7 mm"], ["0 mm", "7 mm"]]
contact_at = ["20 mm", "0 mm"]
thickness = "0.3 mm"
material = "steel"
damping_ratio = 0.02
release = {{ mode = 1, velocity = "-2 m/s" }}
[run]
duration = "10 us"
"""


@pytest.mark.slow
def test_drawings_that_stand_for_much(tmp_path):
    for name, (text, _) in DRAWINGS.items():
        head = HEAD if text is not None else HEAD.replace("70\n4", "70\n\u00b2")
        (tmp_path / name).write_text(f"{head}{text or CIRCLE.format(0, 0, 9)}0\nENDSEC\n0\nEOF\n", encoding="utf-8")
        (tmp_path / f"{name}.toml").write_text(SHEET.format(name))
    outcomes = run_bounded([["plan", f"{name}.toml"] for name in DRAWINGS], tmp_path)
    for outcome, (_, words) in zip(outcomes, DRAWINGS.values(), strict=True):
        assert_refused(outcome, words)


@pytest.mark.slow
def test_mesh_files_that_stand_for_much(tmp_path):
    for name, (text, _) in FILES.items():
        (tmp_path / name).write_text(text)
    outcomes = run_bounded([["faces", name] for name in FILES], tmp_path)
    for outcome, (_, words) in zip(outcomes, FILES.values(), strict=True):
        assert_refused(outcome, words)
