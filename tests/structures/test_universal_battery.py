"""Universal files by the rules of their datasets, changed line by line: they mean the same or are refused."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import pyuff

from impact.measured.frf import FrequencyResponseError
from seatfem.structures.errors import MeshError
from seatfem.structures.formats.uff import UffError, read_modes_uff
from seatfem.structures.formats.uff_responses import read_frf_uff
from seatfem.structures.formats.universal import read_unv
from tests.mutated_lines import check_mutants, is_same
from tests.universal_files import (
    CONTOUR,
    EDGES,
    HEX,
    TET,
    H,
    columns,
    dataset,
    elements,
    function,
    groups,
    mode,
    nodes,
    system,
    units,
)

BASIC = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (0.0, 0.0, 0.0))
TEN = [*TET, *(tuple(np.mean([TET[a], TET[b]], axis=0)) for a, b in EDGES)]
SOLID, SKIN = (111, (1, 2, 3, 4)), (91, (1, 2, 3))
ONE_TET = elements(2412, SOLID, SKIN, (91, (1, 2, 4)))
LONE = nodes(2411, TET) + ONE_TET
SETS = {"contact": [(8, 2)], "fixed": [(7, 1), (7, 2), (7, 4)], "all": [(8, 1)]}
MESHES = {
    "tetrahedron": LONE + groups(2467, **SETS),
    "in mm": units(5, 1e3, 1e3) + LONE + groups(2477, **SETS),
    "in inches": units(7, 39.37007874, 0.224808943) + LONE + groups(2452, **SETS),
    "in units of its own": LONE + groups(2435, **SETS) + units(9, 123.0, offset=False),
    "of old nodes": nodes(15, TET) + ONE_TET + groups(2430, **SETS),
    "of double nodes": nodes(781, TET) + ONE_TET + groups(2432, **SETS),
    "of old elements": nodes(781, TET) + elements(780, SOLID, SKIN) + groups(2417, contact=[(8, 2)]),
    "in a named system": system(3, *BASIC) + nodes(2411, TET, 3) + ONE_TET + groups(2467, **SETS),
    "ten nodes": nodes(2411, TEN) + elements(2412, (118, [k + 1 for k in CONTOUR])) + groups(2467, all=[(8, 1)]),
    "brick": units(1, 1.0)
    + nodes(2411, HEX) + elements(2412, (115, range(1, 9)), (94, (1, 2, 3, 4))) + groups(2467, a=[(8, 2)]),
    "two bricks": nodes(2411, [*HEX, *((x, y, z + 1) for x, y, z in HEX[4:])])
    + elements(2412, (115, range(1, 9)), (115, range(5, 13))) + groups(2467, top=[(7, k) for k in range(9, 13)]),
    "with beams": nodes(2411, TET) + elements(2412, (21, (1, 2)), SOLID, (161, (4,))) + groups(2467, **SETS),
    "with results": dataset(151, "model", "", "us") + LONE + dataset(2414, "1", "stress") + groups(2467, **SETS),
    "with what is unknown": dataset(4711, "what") + LONE + groups(2467, **SETS),
    "of many groups": LONE + groups(2467, **{f"g{k}": [(8, 2)] for k in range(4)}) + groups(2477, more=[(7, 1)]),
}  # fmt: skip


def meaning(path: Path) -> Any:
    mesh = read_unv(path)
    return (mesh.unit, mesh.points, mesh.cells, dict(mesh.surfaces), dict(mesh.volumes), dict(mesh.node_sets))


def but_for_names(before: Any, after: Any) -> bool:
    """Return whether two meshes differ at most in the names of groups, which are free text."""
    pairs = [
        tuple(zip(*(each.values() for each in pair), strict=True)) for pair in zip(before[3:], after[3:], strict=True)
    ]
    return is_same(before[:3], after[:3]) and all(is_same(*values) for pair in pairs for values in pair)


@pytest.mark.parametrize("name", MESHES)
def test_a_mesh_changed_in_a_line_is_the_same_or_refused(name: str, tmp_path: Path) -> None:
    """Most lines cannot be missed, doubled or end in a comma."""
    same, refused = check_mutants(tmp_path / "a.unv", MESHES[name], meaning, (MeshError,), but_for_names)
    assert refused > 60
    assert same <= (21 if name == "with results" else 7)  # names, the offset of temperatures, what is left aside


CHANGES = [
    ("in mm", "         5units", "         7units", r"164: the factor of length is 1000, must be 39\.3701"),
    ("in mm", "  1.00000000000000000D+03", "  0.00000000000000000D+00", "164: the factor of length is 0"),
    ("in mm", "         5units", "        11units", "164: the code of units is '11', must be 1 to 10"),
    ("in a named system", columns(3, 0, 8), columns(3, 1, 8), "coordinate system 3,"),
    ("in a named system", f"{1.0:25.16E}".replace("E", "D"), f"{2.0:25.16E}".replace("E", "D"), "coordinate system 3,"),
    ("in a named system", columns(2, 3, 1), columns(2, 4, 1), "coordinate system 4,"),
    ("tetrahedron", columns(2, 1, 1, 11), columns(2, 7, 1, 11), "system 7,"),
    ("tetrahedron", columns(2, 1, 1, 11), columns(1, 1, 1, 11), "node 1 is there twice"),
    ("tetrahedron", columns(2, 91), columns(1, 91), "element 1 is there twice"),
    ("tetrahedron", columns(1, 111), columns(1, 211), "type 211, which is not known"),
    ("tetrahedron", columns(2, 91), columns(2, 112), "1 tetrahedra .*, 1 wedges"),
    ("tetrahedron", columns(1, 2, 3) + "\n", columns(1, 2, 9) + "\n", "node 9 is used and not defined"),
    ("tetrahedron", "  2467", "   752", "dataset 752: .*export dataset 2467"),
    ("with results", "  2414", "    71", "dataset 71: .*export dataset 2412"),
    ("tetrahedron", "0.0000000000000000D+00", "nan", "must be one of the lines of 3 numbers"),
]  # fmt: skip


def test_what_is_left_aside_is_told(tmp_path: Path) -> None:
    """Elements that are no solids, and datasets that are not known; not those of results."""
    for name, notes in (("with beams", 2), ("with what is unknown", 1), ("with results", 0)):
        (tmp_path / "a.unv").write_text(MESHES[name], encoding="utf-8")
        assert len(read_unv(tmp_path / "a.unv").notes) == notes


RESPONSES = {
    "in SI": units(1, 1.0) + function(),
    "by labels": function(),
    "in g": function(unit="g"),
    "in g by pound": function(unit="g", force="lbf"),
    "in mm by newton": units(10, 1e3) + function(unit="mm/s^2"),
    "in mm without labels": units(5, 1e3, 1e3) + function(unit="NONE", force="NONE"),
    "labelled by a ratio": function(unit="(m/s2)/N", force=""),
    "single": units(1, 1.0) + function(form=5),
    "uneven": function(even=0),
    "mobility": function(kind=11, unit="m/s"),
    "receptance": function(kind=8, unit="um"),
    "along -z": function(ends="1  -3"),
    "among others": dataset(151, "NONE") + units(1, 1.0) + nodes(15, TET) + function(ends="2   3") + function(),
}


def response(path: Path) -> Any:
    read = read_frf_uff(path, ports={"contact": (1, "+z")})
    return (read.frequency, np.round(read.receptance / np.abs(read.receptance).max(), 4), read.measured_as,
            round(float(np.log(np.abs(read.receptance).max())), 3))  # fmt: skip


@pytest.mark.parametrize("name", RESPONSES)
def test_a_response_changed_in_a_line_is_the_same_or_refused(name: str, tmp_path: Path) -> None:
    """A removed or doubled line of values is one too few or too many for the head."""
    same, refused = check_mutants(tmp_path / "a.uff", RESPONSES[name], response, (UffError, FrequencyResponseError))
    assert refused > 40
    assert same <= (45 if name == "among others" else 20)  # names, text behind the columns of an axis, another node


IN_58 = [
    ("in SI", columns(6, 10, 1), columns(6, 11, 1), "a line is missing at its end"),
    ("in SI", columns(6, 10, 1), columns(6, 9, 1), "one of the lines of 18 numbers"),
    ("in SI", columns(6, 10, 1), columns(6, 10, 0), "a line is missing at its end"),
    ("in SI", columns(6, 10, 1), columns(3, 10, 1), r"data type \(2, 4, 5, 6\)"),
    ("in SI", "        12    0", "        11    0", "'m/s.2/N' are no unit of mobility"),
    ("in SI", "        13    0", "         8    0", "data type 12 over 8"),
    ("in SI", "        18    0", "        17    0", "abscissa is of data type 17"),
    ("in SI", "Hz    ", "rpm   ", "abscissa .*'rpm', must be 18 in Hz"),
    ("in SI", "m/s^2 ", "g     ", "'g/N', which contradicts dataset 164 .*units.response, as 'g/N', or system"),
    ("in SI", "m/s^2 ", "mV    ", "'mV/N' are no unit of accelerance .*units.response"),
    ("in mm by newton", "mm/s^2 ", "m/s^2  ", "'m/s.2/N', which contradicts dataset 164"),
    ("by labels", "m/s^2 ", "NONE  ", "164 is missing, or there are no labels .*units.response"),
    ("in SI", "    4         0    1", "    1         0    1", "no frequency response"),
]  # fmt: skip


@pytest.mark.parametrize("order", ["<", ">"])
@pytest.mark.parametrize("form", [5, 6])
@pytest.mark.parametrize("after", [b"", b"\n", b"\r\n"])
def test_binary_responses(order: str, form: int, after: bytes, tmp_path: Path) -> None:
    """58b in both orders of bytes and precisions, also with a line of -1 among its values; cut ones are refused."""
    values = np.array([H.real, H.imag]).T.astype(f"{order}f{8 if form == 6 else 4}")
    if after:
        values[2] = np.frombuffer(b"\n    -1\n    -1\n..", values.dtype, 2 if form == 6 else 4)[-2:]
    head = function(form).splitlines()[2:13]
    start = f"    -1\n    58b{1 if order == '<' else 2:6}{2:6}{11:12}{values.nbytes // 2:12}{0:6}{0:6}{0:12}{0:12}\n"
    path = tmp_path / "b.uff"
    path.write_bytes((start + "\n".join(head) + "\n").encode() + values.tobytes() + after + b"    -1\n")
    read = read_frf_uff(path, ports={"contact": (1, "+z")})
    expected = values[:, 0].astype(float) + 1j * values[:, 1].astype(float)
    assert read.receptance[:, 0, 0] * read.per_receptance == pytest.approx(expected, rel=1e-12)
    if not after:  # by another reader
        assert pyuff.UFF(str(path)).read_sets()["data"] == pytest.approx(expected, rel=1e-12)
    path.write_bytes(path.read_bytes().replace(values.tobytes(), values.tobytes()[:-4]))
    with pytest.raises(UffError, match=r"b\.uff:\d+: "):
        read_frf_uff(path, ports={"contact": (1, "+z")})


MODES = {
    "in SI": units(1, 1.0) + mode(1, 900.0) + mode(2, 2600.0),
    "in mm": units(5, 1e3, 1e3) + mode(1, 900.0),
    "of modal masses": units(1, 1.0) + mode(1, 900.0, 0.5) + mode(2, 2600.0, 3.0),
    "with turns": units(1, 1.0) + mode(1, 900.0, width=6),
    "complex": units(1, 1.0) + mode(1, 900.0, form=5) + mode(2, 2600.0, form=5),
    "complex with turns": units(1, 1.0) + mode(1, 900.0, form=5, width=6),
    "hysteretic": units(1, 1.0) + mode(1, 900.0, ratios=(0.0, 0.04)),
    "with nodes": units(1, 1.0) + nodes(15, TET) + mode(1, 900.0),
    "with a head": dataset(151, "NONE") + units(1, 1.0) + mode(1, 900.0),
}


def shapes(path: Path) -> Any:
    read = read_modes_uff(path, ports={"contact": (5, "+z"), "other": (9, "-y")})
    return read.omega, read.zeta, read.shapes


@pytest.mark.parametrize("name", MODES)
def test_modes_changed_in_a_line_are_the_same_or_refused(name: str, tmp_path: Path) -> None:
    """No mode is lost by a line, and none read by the lines of another."""
    same, refused = check_mutants(tmp_path / "a.uff", MODES[name], shapes, (UffError,))
    assert refused > 40
    assert same <= (20 if name in ("with nodes", "with a head") else 14)


IN_55 = [
    ("in SI", columns(1, 2, 2, 8, 2, 3), columns(1, 2, 2, 8, 2, 4), "must be 3 or 6"),
    ("in SI", columns(2, 4, 0, 2), columns(2, 4, 0, 1), "mode 1 is there twice"),
    ("in SI", columns(2, 4, 0, 2), columns(2, 3, 0, 2), "3 numbers follow, must be 4"),
    ("in SI", "         9\n", "         5\n", "mode 1 has node 5 twice"),
    ("of modal masses", "  5.00000D-01", "  0.00000D+00", "mode 1 has the modal mass 0, .*modal_mass = 1"),
    ("complex", "  3.00000D-01  0.00000D+00", "  3.00000D-01  1.00000D-01", "mode 1 is complex"),
    ("in SI", "   164", "   151", "states no units .*state system"),
]  # fmt: skip


READ: dict[str, tuple[Mapping[str, str], Callable[[Path], Any]]] = {
    "unv": (MESHES, read_unv),
    "frf": (RESPONSES, response),
    "modes": (MODES, shapes),
}


@pytest.mark.parametrize(
    ("kind", "name", "old", "new", "words"),
    [(kind, *each) for kind, all_of in (("unv", CHANGES), ("frf", IN_58), ("modes", IN_55)) for each in all_of],
)
def test_what_would_change_an_answer_is_refused_by_name(
    kind: str, name: str, old: str, new: str, words: str, tmp_path: Path
) -> None:
    """Units, coordinate systems, counts, data types, widths, numbers that stand twice, kinds that are not read."""
    texts, read = READ[kind]
    assert old in texts[name]
    (tmp_path / "a.unv").write_text(texts[name].replace(old, new, 1), encoding="utf-8")
    with pytest.raises((MeshError, UffError), match=rf"a\.unv:.*({words})"):
        read(tmp_path / "a.unv")


def test_another_analysis_is_no_normal_mode(tmp_path: Path) -> None:
    text = MODES["in SI"].replace(columns(2, 2, 8), columns(3, 2, 8), 1)
    (tmp_path / "a.uff").write_text(text, encoding="utf-8")
    assert len(shapes(tmp_path / "a.uff")[0]) == 1
