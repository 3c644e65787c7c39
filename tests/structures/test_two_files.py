"""Two bodies from files, a seat and a striker, are each read once."""

import pytest

from seatfem.structures.estimates import costs
from seatfem.structures.kinds import from_files, measured


@pytest.mark.parametrize("read", [measured._read, from_files._read, costs._sizes_of])
def test_one_body_does_not_put_out_the_other(read) -> None:
    assert read.cache_parameters()["maxsize"] >= 2
