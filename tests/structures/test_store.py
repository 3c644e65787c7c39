"""The store of Green's functions: found by content, whole or absent, damaged entries told."""

import os
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

import impact
from seatfem.structures.cache import Store, StoreError, content_key

KEY = content_key({"seat": "a"})
SEAT = impact.single_mode(frequency_hz=1e4, mass=0.01, damping_ratio=0.02)


def test_what_was_put_is_got(tmp_path: Path) -> None:
    store = Store(tmp_path / "new" / "folder")
    assert store.get(KEY) is None
    assert store.entries() == ()
    path = store.put(KEY, SEAT)
    assert path.name == f"{KEY}.h5"
    read = store.get(KEY)
    t = np.linspace(0, 1e-3, 50)
    assert np.array_equal(read.impulse_response(t), SEAT.impulse_response(t))
    assert [(entry.key, entry.size) for entry in store.entries()] == [(KEY, path.stat().st_size)]


@pytest.mark.slow
def test_writers_and_readers_at_once_never_meet_half_a_file(tmp_path: Path) -> None:
    problems: list[str] = []
    store = Store(tmp_path, problems.append)
    store.put(KEY, SEAT)

    def work(number: int) -> bool:
        if number % 2:
            store.put(KEY, SEAT)
        return store.get(KEY) is not None

    with ThreadPoolExecutor(4) as pool:
        assert all(pool.map(work, range(40)))
    assert problems == []
    assert [path.name for path in tmp_path.iterdir()] == [f"{KEY}.h5"]


def test_pruning_by_size(tmp_path: Path) -> None:
    store = Store(tmp_path)
    keys = [content_key({"seat": k}) for k in range(3)]
    for age, key in enumerate(keys):
        os.utime(store.put(key, SEAT), (1000.0 - age, 1000.0 - age))
    assert [entry.key for entry in store.entries()] == keys
    size = store.entries()[0].size
    assert [entry.key for entry in store.prune(most_bytes=2 * size)] == [keys[2]]
    assert store.get(keys[1]) is not None  # now the last used
    assert [entry.key for entry in store.prune(most_bytes=size)] == [keys[0]]
    (tmp_path / "notes.h5").write_text("not an entry")
    assert len(store.entries()) == 1


def test_the_key_is_of_the_content(tmp_path: Path) -> None:
    one, two = tmp_path / "one.step", tmp_path / "two.step"
    one.write_text("SOLID")
    two.write_text("SOLID")
    base = {"file": one, "size": 1.5, "points": np.arange(3.0), "list": [1, "a", None], "raw": b"x"}
    assert content_key(base) == content_key(dict(reversed(base.items())))
    assert content_key(base) == content_key(base | {"file": two})
    two.write_text("SOLID!")
    changes: list[dict[str, object]] = [
        {"file": two},
        {"size": 1.5000001},
        {"points": np.arange(3)},
        {"points": np.arange(3.0)[:, None]},
        {"list": [1, "a", "None"]},
        {"raw": b"y"},
        {"more": 1},
        {"size": np.float64(2.5)},
    ]
    keys = {content_key(base), *(content_key(base | change) for change in changes)}
    assert len(keys) == 1 + len(changes)
    with pytest.raises(TypeError, match="made of a set"):
        content_key({"a": {1}})


def test_what_is_refused(tmp_path: Path) -> None:
    with pytest.raises(StoreError, match=r"'\.\./escape'.*content"):
        Store(tmp_path).get("../escape")
    (tmp_path / "file").write_text("")
    with pytest.raises(StoreError, match=r"file:.*SEATFEM_STORE"):
        Store(tmp_path / "file").put(KEY, SEAT)
