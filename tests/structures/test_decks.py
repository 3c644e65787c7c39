"""Decks changed line by line: the same mesh and groups, a change that the format makes, or words; never another one."""

import re

import numpy as np
import pytest

from seatfem.structures.formats.mesh_files import read_file
from seatfem.structures.mesh.io import MeshError
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
            path.parent.mkdir(exist_ok=True)
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
    where it cannot matter: in a step, and then told; before the bulk data and after their end."""
    before = deck.content()
    wrong = []
    for at, (_, mark, line) in enumerate(deck.lines):
        head = re.split("[, ]", line)[0]
        added = {
            "unknown": ("*FOO, BAR=1" if deck.suffix == ".inp" else "FOO,1,2,3", line),
            "numbers": (line, "9,8.,7.,6.,5."),
        }
        if line.startswith("*") and not line.startswith("**"):
            added |= {"parameter": (line + ", FOO=1",), "joined": (line + ", 1, 2, 3",)}
        elif deck.suffix == ".bdf" and head.isalnum():
            added |= {"name": (line.replace(head, head + "X", 1),)}
        for change, texts in added.items():
            after = deck.answer(at, *texts)
            if after is not None and not allowed(mark if change == "unknown" else "", before, after):
                wrong.append((change, line))
            if change == "unknown" and deck.suffix == ".inp" and after is not None and "*FOO" not in "".join(after[2]):
                wrong.append(("not told", line))
    assert not wrong
