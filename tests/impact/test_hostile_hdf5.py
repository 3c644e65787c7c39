"""HDF5 files made to bring other files' bytes in, to take memory, or to state what is none."""

import json
import tracemalloc

import h5py
import numpy as np
import pytest

import impact
from impact.files.hdf5_structure import USER_BLOCK
from impact.storage.hdf5 import StorageError, load_greens, load_results, save_greens, save_results
from seatfem.faces.cli import BAD_INPUT, run_command
from tests.fuzz.hdf5 import seal

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
        (external_storage, r"seat\.h5: values has its bytes in another file"),
        (external_link, r"seat\.h5: values is a ExternalLink to .*links are not followed"),
        (soft_link, r"seat\.h5: values is a SoftLink to '/static': links are not followed"),
        (virtual, r"seat\.h5: values is put together from other datasets \(virtual\)"),
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
    changed(seat, lambda file: file.create_group("a").__setitem__("again", file["a"]))
    assert load_greens(seat).ports == SEAT.ports  # each group is looked at once
    changed(seat, lambda file: [file["a"].create_group(str(n)) for n in range(20_001)])
    with pytest.raises(StorageError, match="more than 20000 objects"):
        load_greens(seat)


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


@pytest.mark.parametrize("make", [packed, one_chunk])
def test_more_than_the_file_has_room_for(seat, make):
    changed(seat, replaced(make))
    tracemalloc.start()
    with pytest.raises(StorageError, match=r"seat\.h5: values of .* claims 20\d\d MB in a file of .*at most"):
        load_greens(seat)
    assert tracemalloc.get_traced_memory()[1] < 32e6
    tracemalloc.stop()


def test_results_that_compress_well_are_read(tmp_path):
    """A long rest: the most that the program's own files claim for their size."""
    seat = impact.Body(impact.spring(stiffness=1e7))
    problem = impact.ContactProblem(impact.rigid_mass(mass=1e-3, velocity=-1e-9), seat, gap=1.0)
    result = impact.solve(problem, dt=1e-6, duration=0.5)
    save_results(tmp_path / "r.h5", {"wave": result}, {})
    assert len(load_results(tmp_path / "r.h5")["wave"].time) == len(result.time)


@pytest.mark.parametrize(
    ("key", "value", "message"),
    [
        ("valid_for_s", "long", "provenance valid_for_s is 'long': must be a number"),
        ("valid_for_s", [1, 2], r"provenance valid_for_s is \[1, 2\]: must be a number"),
        ("valid_for_s", True, "provenance valid_for_s is True: must be a number"),
        ("refinement", None, "provenance refinement is None: must be a number"),
    ],
)
def test_odd_provenance(seat, key, value, message):
    def change(file):
        file.attrs["provenance"] = json.dumps(json.loads(file.attrs["provenance"]) | {key: value})

    with pytest.raises(StorageError, match=rf"seat\.h5: damaged: {message}"):
        load_greens(changed(seat, change))


@pytest.mark.parametrize("key", ["error_mesh", "schema", "dt"])
def test_attributes_that_are_no_numbers(seat, key):
    with pytest.raises(StorageError, match=rf"seat\.h5: .*({key} is 'long'|'long')"):
        load_greens(changed(seat, lambda file: file.attrs.__setitem__(key, "long")))


@pytest.mark.parametrize("text", ["[" * 100_000, "1" * 10_000, "[]", '"a"', "{"])
def test_provenance_that_is_no_table(seat, text):
    with pytest.raises(StorageError, match=r"seat\.h5: .*damaged"):
        load_greens(changed(seat, lambda file: file.attrs.__setitem__("provenance", text)))


def test_values_of_another_type(seat):
    with pytest.raises(StorageError, match=r"values holds .*no real numbers"):
        load_greens(changed(seat, replaced(lambda file: file.__setitem__("values", [b"abc"]))))


@pytest.mark.slow
def test_a_scene_with_such_a_file_is_bad_input(seat, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with h5py.File(tmp_path / SECRET_FILE, "w", userblock_size=USER_BLOCK) as file:
        file["values"] = SECRET
    changed(seat, replaced(external_link))
    scene = tmp_path / "scene.toml"
    scene.write_text(
        '[seat]\nkind = "greens"\nfile = "seat.h5"\n[reed]\nkind = "rigid_mass"\nmass = "1 g"\nvelocity = "-1 m/s"\n'
        '[run]\nduration = "10 us"\n'
    )
    assert run_command(["run", str(scene), "-o", str(tmp_path / "out"), "--quiet"]) == BAD_INPUT
    assert "links are not followed" in capsys.readouterr().err
