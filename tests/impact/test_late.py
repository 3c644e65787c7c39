"""Modules that are executed when they are first used, in a package on disk."""

import importlib
import sys
from collections.abc import Iterator
from pathlib import Path
from threading import Thread
from types import ModuleType

import pytest

from impact.names import LateModule, load_late

SOURCES = {
    "__init__": "",
    "first": "from late_toy import second\nONE = 1\ndef two() -> int:\n    return second.TWO\n",
    "second": "from late_toy import first\nTWO = first.ONE + 1\n",
    "broken": "from pathlib import Path\nassert Path(__file__).with_name('mended').exists()\nVALUE = 3\n",
    "slow": "import time\nBEGUN = 1\ntime.sleep(0.2)\nENDED = 2\n",
}


@pytest.fixture
def package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """Yield the folder of a package whose modules are loaded late; nothing of it is known afterwards."""
    folder = tmp_path / "late_toy"
    folder.mkdir()
    for name, text in SOURCES.items():
        (folder / f"{name}.py").write_text(text, encoding="utf-8")
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.setattr(sys, "meta_path", sys.meta_path.copy())
    load_late("late_toy")
    yield folder
    for name in [name for name in sys.modules if name.partition(".")[0] == "late_toy"]:
        del sys.modules[name]


def late(name: str) -> ModuleType:
    """Return a module of the package as an import statement does."""
    return importlib.import_module(f"late_toy.{name}")


@pytest.mark.usefixtures("package")
def test_a_module_is_executed_when_something_of_it_is_used() -> None:
    """An import executes nothing, nor do names of Python's machinery; a name does, and the module is a plain one; a
    name that is set from outside is kept, also in a module that uses this one."""
    first = late("first")
    assert not hasattr(first, "__wrapped__")
    assert (type(first), "ONE" in vars(first)) == (LateModule, False)
    first.ONE = 10
    assert (first.ONE, first.two()) == (10, 11)
    assert type(first) is ModuleType
    with pytest.raises(AttributeError, match="no attribute 'THREE'"):
        _ = first.THREE


def test_a_module_that_fails_is_executed_again(package: Path) -> None:
    """What made it fail may be mended while the program runs."""
    broken = late("broken")
    with pytest.raises(AssertionError):
        _ = broken.VALUE
    (package / "mended").touch()
    assert broken.VALUE == 3


@pytest.mark.usefixtures("package")
def test_a_thread_waits_for_the_module_that_another_executes() -> None:
    """A name that is defined last is there for all who ask at the same time."""
    slow, values = late("slow"), []
    threads = [Thread(target=lambda: values.append(slow.ENDED)) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert values == [2] * 4
