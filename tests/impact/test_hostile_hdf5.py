"""HDF5 files made to bring other files' bytes in, to take memory, or to state what is none."""

import time

import h5py
import numpy as np
import pytest

import impact
from impact.files.hdf5_structure import USER_BLOCK, can_be_opened
from impact.storage.hdf5 import StorageError, load_greens, save_greens
from tests.bounded import bounded
from tests.fuzz.mutations import seal

SEAT = impact.SampledGreens(np.linspace(0.0, 1e-6, 50), 1e-6, tail="zero")
SECRET_FILE = "secret.h5"


@pytest.fixture
def seat(tmp_path, monkeypatch):
    """A sound file, beside one with what nobody is to read, which is the current folder's."""
    monkeypatch.chdir(tmp_path)
    with h5py.File(SECRET_FILE, "w") as file:
        file["values"] = np.arange(50.0)
    save_greens(SEAT, tmp_path / "seat.h5")
    return tmp_path / "seat.h5"


def virtual(file):
    layout = h5py.VirtualLayout((1, 1, 50), "f8")
    layout[0, 0] = h5py.VirtualSource(SECRET_FILE, "values", (50,))
    file.create_virtual_dataset("values", layout)


def packed(file):
    """Write 2 GB of zeros in a few million bytes."""
    file.create_dataset("values", (1, 1, 1 << 28), "f8", chunks=(1, 1, 1 << 22), compression="gzip", fillvalue=1.0)
    file["values"][0, 0, : 1 << 24] = 0.0


def one_chunk(file):
    """Write a chunk far larger than the dataset that it belongs to."""
    file.create_dataset("values", (1, 1, 8), "f8", chunks=(1, 1, 1 << 28), maxshape=(1, 1, None), compression="gzip")


VALUES = {
    "storage": (
        lambda file: file.create_dataset("values", (1, 1, 50), "f8", external=[(SECRET_FILE, 0, 400)]),
        "another file",
    ),
    "link": (lambda file: file.__setitem__("values", h5py.ExternalLink(SECRET_FILE, "/values")), "ExternalLink"),
    "soft": (lambda file: file.__setitem__("values", h5py.SoftLink("/static")), r"SoftLink .*'/static'"),
    "virtual": (virtual, r"\(virtual\)"),
    "packed": (packed, r"20\d\d MB .*at most"),
    "one_chunk": (one_chunk, r"20\d\d MB .*at most"),
    "text": (lambda file: file.__setitem__("values", [b"abc"]), "no real numbers"),
}
"""What stands in place of the dataset "values", and what is said of it."""


def part(group, file):
    for name, value in file.attrs.items():
        group.attrs[name] = value
    file.copy("values", group)


def parts_of_parts(file):
    """Write 60 parts of 60 parts of 60 parts, by links to three groups."""
    below = file.create_group("leaf")
    part(below, file)
    for level in (file.create_group("one"), file.create_group("two"), file):
        level.attrs["kind"] = "sum"
        parts = level.create_group("parts")
        for n in range(60):
            parts[str(n)] = below
        below = level


def crowd_of_parts(file):
    part(file.create_group("leaf"), file)
    file.attrs["kind"] = "sum"
    for n in range(1001):
        file.copy("leaf", f"parts/{n}")


GROUPS = {
    "nested": (lambda file: file.create_group("/".join("a" * 40)), "nested more than 32 deep"),
    "itself": (lambda file: file.create_group("a").__setitem__("again", file["/"]), "a/again"),
    "twice": (lambda file: file.create_group("a").__setitem__("again", file["a"]), "a/again"),
    "links": (parts_of_parts, "is a group with another name"),
    "crowd": (lambda file: [file.create_group(f"a/{n}") for n in range(20_001)], "more than 20000 objects"),
    "parts": (crowd_of_parts, "1003 parts .*1000"),
} | {
    f"provenance {text[:2]}": (lambda file, text=text: file.attrs.__setitem__("provenance", text), "damaged")
    for text in ("[" * 100_000, "1" * 10_000, "[]", '"a"', "{")
}
"""What is added to the file, and what is said of it."""


@pytest.mark.slow(but=("storage", "link", "soft", "virtual", "one_chunk", "nested", "itself", "links"))
@pytest.mark.parametrize("name", [*VALUES, *GROUPS])
def test_what_a_sealed_file_may_not_hold(seat, name):
    """No other file's bytes become numbers, and memory is not taken for what a file claims."""
    change, message = {**VALUES, **GROUPS}[name]
    with h5py.File(seat, "r+") as file:
        if name in VALUES:
            del file["values"]
        change(file)
    seal(seat)
    with bounded(), pytest.raises(StorageError, match=rf"seat\.h5: .*{message}"):
        load_greens(seat)


@pytest.mark.slow
@pytest.mark.parametrize("sealed", [True, False])
@pytest.mark.parametrize("name", ["more", "provenance"])
def test_texts_at_one_place(seat, sealed, name):
    """1,500 texts of an attribute lie at one place: 450 MB from 0.3 MB; without a seal another process tries first."""
    count, length = 1500, 300_000
    with h5py.File(seat, "r+") as file:
        file.attrs.create(name, ["x" * length, *["a"] * (count - 1)], dtype=h5py.string_dtype())
    data = bytearray(seat.read_bytes())
    size, one = length.to_bytes(4, "little"), b"\1\0\0\0"
    first = next(at for at in range(len(data) - 32) if data[at : at + 4] == size and data[at + 16 : at + 20] == one)
    data[first : first + 16 * count] = data[first : first + 16] * count
    seat.write_bytes(data if sealed else data[USER_BLOCK:])
    if sealed:
        seal(seat)
    with bounded(), pytest.raises(StorageError, match=rf"seat\.h5:.*'{name}'.*64 MB"):
        load_greens(seat)


@pytest.mark.slow
def test_the_trial_of_a_file_takes_little(seat, tmp_path, monkeypatch):
    """What stands in for HDF5 takes memory without end: the trial ends at its limit, and the caller is told."""
    (tmp_path / "h5py.py").write_text("Dataset = Group = None\ndef File(*_):\n    return bytearray(8 << 30)\n")
    (tmp_path / "numpy.py").write_text("")
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    start = time.monotonic()
    assert can_be_opened(seat)  # it ended by an error, not by a crash
    assert time.monotonic() - start < 20
