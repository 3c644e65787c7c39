"""HDF5 files made to bring other files' bytes in, to take memory, or to state what is none."""

import time
import tracemalloc

import h5py
import numpy as np
import pytest

import impact
from impact.files.hdf5_structure import USER_BLOCK, can_be_opened
from impact.storage.hdf5 import StorageError, load_greens, save_greens
from tests.fuzz.mutations import seal

SEAT = impact.SampledGreens(np.linspace(0.0, 1e-6, 50), 1e-6, tail="zero")


@pytest.fixture
def seat(tmp_path):
    path = tmp_path / "seat.h5"
    save_greens(SEAT, path)
    return path


def changed(path, change):
    """The file after a change by someone who seals it again."""
    with h5py.File(path, "r+") as file:
        change(file)
    seal(path)
    return path


def replaced(make):
    def change(file):
        del file["values"]
        make(file)

    return change


SECRET = np.arange(50.0)


def external_storage(file):
    file.create_dataset("values", (1, 1, 50), "f8", external=[(str(SECRET_FILE), 0, 400)])


def external_link(file):
    file["values"] = h5py.ExternalLink(str(SECRET_FILE), "/values")


def soft_link(file):
    file["values"] = h5py.SoftLink("/static")


def virtual(file):
    layout = h5py.VirtualLayout((1, 1, 50), "f8")
    layout[0, 0] = h5py.VirtualSource(str(SECRET_FILE), "values", (50,))
    file.create_virtual_dataset("values", layout)


SECRET_FILE = "secret.h5"


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (external_storage, r"seat\.h5: values .*another file"),
        (external_link, r"seat\.h5: values .*ExternalLink"),
        (soft_link, r"seat\.h5: values .*SoftLink .*'/static'"),
        (virtual, r"seat\.h5: values .*\(virtual\)"),
    ],
)
def test_no_other_files_bytes_become_numbers(seat, tmp_path, monkeypatch, make, message):
    monkeypatch.chdir(tmp_path)
    with h5py.File(tmp_path / SECRET_FILE, "w") as file:
        file["values"] = SECRET
    changed(seat, replaced(make))
    with pytest.raises(StorageError, match=message):
        load_greens(seat)


@pytest.mark.slow
def test_groups_that_hold_themselves_and_crowds(seat):
    changed(seat, lambda file: [file.create_group(f"a/{n}") for n in range(20_001)])
    with pytest.raises(StorageError, match="more than 20000 objects"):
        load_greens(seat)


@pytest.mark.parametrize("of", ["/", "a"])
def test_groups_of_two_names(seat, of):
    changed(seat, lambda file: file.create_group("a").__setitem__("again", file[of]))
    with pytest.raises(StorageError, match=r"seat\.h5: a/again"):
        load_greens(seat)


def copied_into(group, file):
    for name, value in file.attrs.items():
        group.attrs[name] = value
    file.copy("values", group)


def parts_of_parts(file):
    """60 parts of 60 parts of 60 parts, by links to three groups."""
    below = file.create_group("leaf")
    copied_into(below, file)
    for level in (file.create_group("one"), file.create_group("two"), file):
        level.attrs["kind"] = "sum"
        parts = level.create_group("parts")
        for n in range(60):
            parts[str(n)] = below
        below = level


def test_parts_that_are_links(seat, tmp_path):
    changed(seat, parts_of_parts)
    assert seat.stat().st_size < 40_000
    with pytest.raises(StorageError, match="is a group with another name"):
        load_greens(seat)


def crowd_of_parts(file):
    leaf = file.create_group("leaf")
    copied_into(leaf, file)
    file.attrs["kind"] = "sum"
    for n in range(1001):
        file.copy("leaf", f"parts/{n}")


@pytest.mark.slow
def test_sums_of_a_crowd_of_parts(seat):
    changed(seat, crowd_of_parts)
    with pytest.raises(StorageError, match=r"seat\.h5: .*1003 parts .*1000"):
        load_greens(seat)


def at_one_place(path, name, count, length):
    """An attribute of ``count`` texts that all lie at one place: their descriptors in the file are made the same."""
    with h5py.File(path, "r+") as file:
        file.attrs.create(name, ["x" * length, *["a"] * (count - 1)], dtype=h5py.string_dtype())
    data = bytearray(path.read_bytes())
    first = next(
        at
        for at in range(len(data) - 32)
        if data[at : at + 4] == length.to_bytes(4, "little") and data[at + 16 : at + 20] == b"\1\0\0\0"
    )
    data[first : first + 16 * count] = data[first : first + 16] * count
    path.write_bytes(data)
    with h5py.File(path) as file:
        assert file.attrs.get_id(name).shape == (count,)


@pytest.mark.slow
@pytest.mark.parametrize("sealed", [True, False])
@pytest.mark.parametrize("name", ["more", "provenance"])
def test_texts_at_one_place(seat, sealed, name):
    """450 MB from a file of 0.3 MB; without a seal it is tried in another process first."""
    at_one_place(seat, name, 1500, 300_000)
    if sealed:
        seal(seat)
    else:
        seat.write_bytes(seat.read_bytes()[USER_BLOCK:])
    tracemalloc.start()
    with pytest.raises(StorageError, match=rf"seat\.h5:.*'{name}'.*64 MB"):
        load_greens(seat)
    assert tracemalloc.get_traced_memory()[1] < 32e6
    tracemalloc.stop()


@pytest.mark.slow
def test_the_trial_of_a_file_takes_little(seat, tmp_path, monkeypatch):
    """What stands in for HDF5 takes memory without end: the trial ends at its limit, and the caller is told."""
    (tmp_path / "h5py.py").write_text("Dataset = Group = None\ndef File(*_):\n    return bytearray(8 << 30)\n")
    (tmp_path / "numpy.py").write_text("")
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    start = time.monotonic()
    assert can_be_opened(seat)  # it ended by an error, not by a crash
    assert time.monotonic() - start < 20


def test_groups_nested_without_end(seat):
    changed(seat, lambda file: file.create_group("/".join("a" * 40)))
    with pytest.raises(StorageError, match="nested more than 32 deep"):
        load_greens(seat)


def packed(file):
    """2 GB of zeros in a few million bytes."""
    file.create_dataset("values", (1, 1, 1 << 28), "f8", chunks=(1, 1, 1 << 22), compression="gzip", fillvalue=1.0)
    file["values"][0, 0, : 1 << 24] = 0.0


def one_chunk(file):
    """A chunk far larger than the dataset that it belongs to."""
    file.create_dataset("values", (1, 1, 8), "f8", chunks=(1, 1, 1 << 28), maxshape=(1, 1, None), compression="gzip")


@pytest.mark.slow(but="one_chunk")
@pytest.mark.parametrize("make", [packed, one_chunk])
def test_more_than_the_file_has_room_for(seat, make):
    changed(seat, replaced(make))
    tracemalloc.start()
    with pytest.raises(StorageError, match=r"seat\.h5: values .*20\d\d MB .*at most"):
        load_greens(seat)
    assert tracemalloc.get_traced_memory()[1] < 32e6
    tracemalloc.stop()


@pytest.mark.parametrize("text", ["[" * 100_000, "1" * 10_000, "[]", '"a"', "{"])
def test_provenance_that_is_no_table(seat, text):
    with pytest.raises(StorageError, match=r"seat\.h5: .*damaged"):
        load_greens(changed(seat, lambda file: file.attrs.__setitem__("provenance", text)))
