"""Decks changed line by line: the same mesh and groups, a change that the format makes, or words; never another one."""

import re

import numpy as np
import pytest

from seatfem.structures.errors import MeshError
from seatfem.structures.formats.mesh_files import all_files, read_file, read_mesh
from tests.refusals import judge
from tests.structures import deck_texts

DECKS = {f"abaqus {name}": (".inp", text) for name, text in deck_texts.ABAQUS.items()}
DECKS |= {f"nastran {name}": (".bdf", text) for name, text in deck_texts.NASTRAN.items()}


def content(path):
    """What a deck says, by places and names alone: elements, groups, notes."""
    mesh = read_file(path)
    places = np.round(mesh.points, 9) + 0.0

    def as_set(rows):
        return frozenset(frozenset(map(tuple, places[np.atleast_1d(row)].tolist())) for row in rows)

    elements = [tuple(map(tuple, places[row].tolist())) for row in mesh.cells]
    groups = {f"{name} f": as_set(rows) for name, rows in mesh.surfaces.items()}
    groups |= {f"{name} n": as_set(rows) for name, rows in mesh.node_sets.items()}
    groups |= {f"{name} v": frozenset(elements[row] for row in rows) for name, rows in mesh.volumes.items()}
    return sorted(elements), {name: members for name, members in groups.items() if members}, mesh.notes


class Deck:
    """Files of a deck as lines, each with what it may change."""

    def __init__(self, name, folder):
        self.suffix, text = DECKS[name]
        self.head, *rows = text.split("\n")
        self.folder, self.lines, file = folder, [], f"deck{self.suffix}"
        for row in rows:
            if row.startswith("@"):
                file = row[1:]
            else:
                self.lines.append((file, *row.split("|", 1)))

    def content(self, at=None, *texts):
        """What the deck says, with a line replaced by others."""
        files = {}
        for k, (file, _, line) in enumerate(self.lines):
            files.setdefault(file, []).extend(texts if k == at else [line])
        for file, lines in files.items():
            path = self.folder / file
            path.parent.mkdir(exist_ok=True, parents=True)
            path.write_text("\n".join(lines) + "\n")
        return content(self.folder / f"deck{self.suffix}")

    def answer(self, at, *texts):
        """What it says, or ``None`` where it is refused in words that name what is refused and a remedy."""
        try:
            return self.content(at, *texts)
        except MeshError as error:
            judge(error)
            return None


@pytest.fixture(params=DECKS)
def deck(request, tmp_path):
    return Deck(request.param, tmp_path)


def test_a_deck_is_read_by_its_rules(deck):
    """Number and extent of the elements and the size of each group are those that the deck is written for."""
    elements, groups, _ = deck.content()
    count, extent, *sizes = deck.head.split("; ")
    assert len(elements) == int(count)
    assert np.ptp(np.concatenate(elements), axis=0) == pytest.approx([float(x) for x in extent.split()])
    for size in sizes:
        name, number, kind = re.fullmatch(r"(.*) (\d+)([fnv])", size).groups()
        assert len(groups[f"{name} {kind}"]) == int(number), (name, list(groups))


def allowed(mark, before, after):
    """Whether a line so marked may make this of the deck when it is taken away."""
    (elements, groups, _), (now, groups_now, _) = before, after
    if mark == "*":
        return True
    others = [name for name in {**groups, **groups_now} if name[:-2] not in mark[1:].split(",")]
    if mark == "e":
        fewer = len(now) == len(elements) - 1 and set(now) < set(elements)
        return fewer and all(groups_now.get(name, frozenset()) <= groups[name] for name in groups)
    return now == elements and all(groups.get(name) == groups_now.get(name) for name in others)


@pytest.mark.slow(but=("abaqus cae", "abaqus steps", "nastran free", "nastran labelled"))
def test_no_change_of_a_line_is_silent(deck):
    """A line taken away, written twice, or with a comma more changes what its mark allows, or the deck is refused."""
    before = deck.content()
    wrong = []
    for at, (_, mark, line) in enumerate(deck.lines):
        commas = [found.end() for found in re.finditer(",", line)] + [len(line)]
        changes = {"away": (), "twice": (line, line)} | {
            f"comma at {k}": (line[:k] + "," + line[k:],) for k in commas if line.strip()
        }
        for change, texts in changes.items():
            after = deck.answer(at, *texts)
            if after is not None and not allowed(mark if change == "away" else "", before, after):
                wrong.append((change, line))
    assert not wrong


@pytest.mark.slow(but=("abaqus cae", "abaqus steps", "nastran free", "nastran labelled"))
def test_what_is_not_known_is_refused_or_told(deck):
    """An unknown keyword, parameter or entry before any line, and a line of numbers on it, is refused, or passed over
    where it cannot matter: in a step, and then told; before the bulk data and after their end. So is an entry that
    states a unit or another default."""
    before = deck.content()
    wrong = []
    for at, (_, mark, line) in enumerate(deck.lines):
        head = re.split("[, ]", line)[0]
        unknown = "*FOO, BAR=1" if deck.suffix == ".inp" else "FOO,1,2,3"
        added = {"unknown": (unknown, line), "numbers": (line, "9,8.,7.,6.,5.")}
        if line.startswith("*") and not line.startswith("**"):
            added |= {"parameter": (line + ", FOO=1",), "joined": (line + ", 1, 2, 3",)}
        if deck.suffix == ".bdf":
            added |= {"default": ("GRDSET,,99", line), "unit": ("DTI,UNITS,1,KG,N,MM,S", line)}
            added |= {"name": (line.replace(head, head + "X", 1),)} if head.isalnum() else {}
        for change, texts in added.items():
            after = deck.answer(at, *texts)
            if after is not None and not allowed(mark if change == "unknown" else "", before, after):
                wrong.append((change, line))
            if change == "unknown" and deck.suffix == ".inp" and after is not None and "*FOO" not in "".join(after[2]):
                wrong.append(("not told", line))
    assert not wrong


REFUSED = [
    ("abaqus flat", "*ELEMENT, TYPE=C3D8R", "*ELEMENT, TYPE=C3D6", r"deck.inp:16: \*ELEMENT: TYPE=C3D6: is not read"),
    ("abaqus flat", "*ELEMENT, TYPE=C3D8R", "*ELEMENT, TYPE=C8D3R", r"deck.inp:16: \*ELEMENT: TYPE=C8D3R"),
    ("abaqus flat", "*ELEMENT, TYPE=C3D8R", "*NGEN\n1, 2\n*ELEMENT, TYPE=C3D8R", r"deck.inp:16: \*NGEN: .*write out"),
    ("abaqus flat", "*NODE", "*SYSTEM\n1.,0.,0.\n*NODE", r"deck.inp:3: \*SYSTEM: "),
    ("abaqus flat", "1, 0.0, 0.0, 0.0", "1, 0.0, zero, 0.0", "'zero' must be a number"),
    ("abaqus flat", "1, 0.0, 0.0, 0.0", "1, 0., 0., 0.\n1, 0., 0., 1.", "node 1 is there twice"),
    ("abaqus flat", "1, 2, 3", "1, 2, 99", r"node 99 is used .*\(1 such"),
    ("abaqus flat", "1, S2", "1, S7", r"deck.inp:24: \*SURFACE: 1, S7: .*S1 to S6"),
    ("abaqus flat", "1, S2", "Side, S2", "no ELSET 'Side'.*'All'"),
    ("abaqus flat", "*NSET, NSET=Base", "*NSET, NSET=Base, ELSET=All", r"deck.inp:19: \*NSET: ELSET: "),
    ("abaqus flat", "*NODE", "*NODE, SYSTEM=C", r"deck.inp:3: \*NODE: SYSTEM=C: .*rectangular"),
    ("abaqus placed", "PART=Seat", "PART=Reed", r"\*INSTANCE: PART='reed': .*'seat'"),
    ("abaqus placed", "1., 0., 1., 1., 0., 2., 90.", "1., 0., 1., 1., 0., 1., 90.", "two points .*move one"),
    ("abaqus placed", "1., 0., 1., 1., 0., 2., 90.", "1., 0., 1.", r"\*INSTANCE: needs a line of translation"),
    ("abaqus included", "mesh/nodes.inp", "../nodes.inp", r"deck.inp:2: includes '../nodes.inp'.*within .*folder"),
    ("abaqus included", "mesh/nodes.inp", "link.inp", "deck.inp:2: includes 'link.inp'.*a link is none"),
    ("nastran included", "held.dat", "link.dat", "deck.bdf:8: includes 'link.dat'.*a link is none"),
    ("nastran included", "mesh/nodes.bdf", "/etc/passwd", "deck.bdf:5: includes '/etc/passwd'.*within .*folder"),
    ("nastran free", "BEGIN BULK", "BEGIN SUPER=1", "deck.bdf:7: BEGIN SUPER=1: "),
    ("nastran free", "PSOLID,3,1", "CORD1R,9,1,2,3\nGRID,13,9,0.,0.,0.", "GRID: coordinate system 9 is no CORD2R"),
    ("nastran free", "PSOLID,3,1", "=,*(1),==", "deck.bdf:25: =: .*write out"),
    ("nastran free", "PSOLID,3,1", "CPENTA,8,3,1,2,3,5,6,7", r"deck.bdf:25: CPENTA: is not read.*CHEXA"),
    ("nastran free", "PSOLID,3,1", "CHEXA,2,3,5,9,10,6,8,12\n,11,7", "CHEXA: element 2 is there twice"),
    ("nastran free", "PLOAD4,9,1,1.+6,,,,3,8", "PLOAD4,9,1,1.+6,,,,3,7", "nodes 3 and 7 must name a face of element 1"),
    ("nastran free", "PLOAD4,9,1,1.+6,,,,3,8", "PLOAD4,9,7,1.+6,,,,3,8", "element 7 is not defined"),
    ("nastran rectangular", "CORD2R  7       0 ", "CORD2R  7       8 ", "coordinate system 8 .*stands in itself"),
    ("nastran rectangular", "+       0.      0.", "+       1.      0.", "CORD2R: must have three points .*move one"),
]


@pytest.mark.parametrize(("name", "old", "new", "words"), REFUSED)
def test_what_is_not_read_is_refused_by_name(tmp_path, name, old, new, words):
    """A refusal names the file, its line and the card or keyword, and what to do; no link is followed."""
    deck = Deck(name, tmp_path / "deck")
    for file in ("nodes.inp", "held.dat"):
        (tmp_path / file).write_text("*NODE\n" if file == "nodes.inp" else "SPC1,5,123,1,2,3,4\n")
        (tmp_path / "deck").mkdir(exist_ok=True)
        (tmp_path / "deck" / f"link{file[-4:]}").symlink_to(tmp_path / file)
    at = next(k for k, (_, _, line) in enumerate(deck.lines) if old in line)
    with pytest.raises(MeshError, match=words):
        deck.content(at, *deck.lines[at][2].replace(old, new).split("\n"))


@pytest.mark.parametrize("name", ["abaqus included", "abaqus input", "nastran included"])
def test_files_of_a_deck_are_known(tmp_path, name):
    """All files that a deck includes are among those by whose change it is read anew."""
    deck = Deck(name, tmp_path)
    deck.content()
    assert {path.relative_to(tmp_path).as_posix() for path in all_files(tmp_path / f"deck{deck.suffix}")} == {
        file for file, _, _ in deck.lines
    }


def test_what_steps_do_that_is_not_known_is_told(tmp_path):
    """The note on an unknown keyword of a step stands in the description of the mesh; other decks have none."""
    Deck("abaqus steps", tmp_path).content()
    told = read_mesh(tmp_path / "deck.inp", contact=None, fixed="Base", unit=1.0)
    assert "*ANEWOUTPUT" in str(told)
    Deck("abaqus flat", tmp_path).content()
    assert "not known" not in str(
        read_mesh(tmp_path / "deck.inp", contact="top", fixed="BASE", unit=1.0).provenance.notes
    )


def test_a_node_set_without_a_face_is_named(tmp_path):
    Deck("abaqus generated", tmp_path).content()
    with pytest.raises(MeshError, match=r"'Some'.*no whole face:.*'Some'"):
        read_mesh(tmp_path / "deck.inp", contact=None, fixed="Some", unit=1.0)
