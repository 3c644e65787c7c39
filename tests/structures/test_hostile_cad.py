"""STEP and BREP texts made to cost time, or to bring other files in."""

from pathlib import Path

import pytest

from seatfem.structures.shapes import GeometryError
from seatfem.structures.shapes.cad import check_readable, state_directly, stated_unit, step_face_names
from tests.bounded import bounded

MESHES = Path(__file__).parents[2] / "meshes"
HEAD, TAIL = "ISO-10303-21;\nHEADER;ENDSEC;DATA;\n", "\nENDSEC;\nEND-ISO-10303-21;"
SLOW = 3.0  # s for a text of a few hundred thousand bytes, where each is looked at a few times; squares take minutes


@pytest.mark.parametrize(
    "body",
    [
        "=(LENGTH_UNIT()" * 30_000,
        "#1=(LENGTH_UNIT( " * 30_000,
        "#1=( LENGTH_UNIT ( ) " * 20_000 + ";",
        "#1=ADVANCED_FACE('',(" * 20_000,
        "#1=CLOSED_SHELL('',(" * 20_000,
        "#1=CARTESIAN_POINT('',(" * 20_000,
        "#1=(GLOBAL_UNIT_ASSIGNED_CONTEXT((" * 20_000,
        "#1=(GLOBAL_UNIT_ASSIGNED_CONTEXT((#1,#1,#2)));#2=(CONVERSION_BASED_UNIT('',#3));" * 5_000,
        "CONVERSION_BASED_UNIT(" + " " * 400_000,
        "'" * 400_001,
        "/*" * 200_000,
        "\n" * 400_000,
        "#" * 400_000,
    ],
)
def test_a_step_text_is_read_in_one_pass(tmp_path, body):
    path = tmp_path / "a.step"
    path.write_text(HEAD + body + TAIL)
    with bounded(SLOW):
        check_readable(path)
        assert step_face_names(path) == []
        assert stated_unit(path) == 0
        state_directly(path)


def test_a_part_that_points_to_other_files(tmp_path):
    sound = (MESHES / "block.step").read_text()
    path = tmp_path / "a.step"
    path.write_text(sound.replace("DATA;", "DATA;\n#99999 = DOCUMENT_FILE('/etc/other.step','',$,#1,'',$);", 1))
    with pytest.raises(GeometryError, match="#99999 points"):
        check_readable(path)


def test_semicolons_and_comments_where_they_mean_nothing(tmp_path):
    sound = (MESHES / "block.step").read_text()
    path = tmp_path / "a.step"
    strange = "DATA;\n/* don't; #1=(LENGTH_UNIT()SI_UNIT(.KILO.,.METRE.)); */ #99999 = DOCUMENT('a;b','it''s','/*',#1);"
    path.write_text(sound.replace("DATA;", strange, 1))
    assert stated_unit(path) == stated_unit(MESHES / "block.step") == 1e-3
    assert step_face_names(path) == step_face_names(MESHES / "block.step")


def test_a_file_larger_than_is_read(tmp_path, monkeypatch):
    monkeypatch.setattr("seatfem.structures.shapes.cad.LIMIT", 1 << 20)
    path = tmp_path / "a.step"
    with path.open("wb") as file:
        file.truncate(3 << 20)
    with pytest.raises(GeometryError, match=r"a\.step:.*3 MB.*file.*1 MB"):
        check_readable(path)
