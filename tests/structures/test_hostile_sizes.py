"""Small files that stand for much: refused in words, within 10 s of the processor and 1 GiB, as command lines."""

import pytest

from tests.bounded import assert_refused, run_bounded

SOLID = "GRID,1,,0.,0.,0.\nGRID,2,,1.,0.,0.\nGRID,3,,0.,1.,0.\nGRID,4,,0.,0.,1.\nCTETRA,1,3,1,2,3,4\n"
DECK = "*NODE\n1,0,0,0\n2,1,0,0\n3,0,1,0\n4,0,0,1\n*ELEMENT,TYPE=C3D4\n1,1,2,3,4\n"
FILES = {
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


@pytest.mark.slow
def test_mesh_files_that_stand_for_much(tmp_path):
    for name, (text, _) in FILES.items():
        (tmp_path / name).write_text(text)
    outcomes = run_bounded([["faces", name] for name in FILES], tmp_path)
    for outcome, (_, words) in zip(outcomes, FILES.values(), strict=True):
        assert_refused(outcome, words)
