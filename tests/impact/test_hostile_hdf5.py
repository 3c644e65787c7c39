"""Sealed HDF5 files that claim more memory than they hold, or state what is none."""

import h5py
import numpy as np
import pytest

import impact
from impact.storage.hdf5 import StorageError, load_greens, save_greens
from tests.bounded import bounded
from tests.fuzz.mutations import seal

SEAT = impact.SampledGreens(np.linspace(0.0, 1e-6, 50), 1e-6, tail="zero")


@pytest.fixture
def seat(tmp_path):
    """Write a sound file."""
    save_greens(SEAT, tmp_path / "seat.h5")
    return tmp_path / "seat.h5"


def packed(file):
    """Write 2 GB of zeros in a few million bytes."""
    file.create_dataset("values", (1, 1, 1 << 28), "f8", chunks=(1, 1, 1 << 22), compression="gzip", fillvalue=1.0)
    file["values"][0, 0, : 1 << 24] = 0.0


VALUES = {
    "packed": (packed, "values claims 2.15 GB"),
    "text": (lambda file: file.__setitem__("values", [b"abc"]), "no real numbers"),
}
"""What stands in place of the dataset "values", and what is said of it."""


GROUPS = {
    f"provenance {text[:2]}": (lambda file, text=text: file.attrs.__setitem__("provenance", text), "damaged")
    for text in ("[" * 100_000, "1" * 10_000, "[]", '"a"', "{")
}
"""What is added to the file, and what is said of it."""


@pytest.mark.slow(but=("packed", "text"))
@pytest.mark.parametrize("name", [*VALUES, *GROUPS])
def test_what_a_sealed_file_may_not_hold(seat, name):
    """Memory is not taken for what a file claims."""
    change, message = {**VALUES, **GROUPS}[name]
    with h5py.File(seat, "r+") as file:
        if name in VALUES:
            del file["values"]
        change(file)
    seal(seat)
    with bounded(), pytest.raises(StorageError, match=rf"seat\.h5: .*{message}"):
        load_greens(seat)
