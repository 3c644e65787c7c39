"""This finds the verbs, and the kinds of files beside scenes, that the files `*_verbs.py` of this folder add.

A file that is removed, with the packages that it runs, takes its verbs and files with it.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from pkgutil import iter_modules
from typing import Any, ClassVar

from impact.names import import_now


def all_verbs() -> Iterator[Callable[..., int]]:
    """Yield the verbs of the program: the `VERBS` of each file."""
    for module in iter_modules([str(Path(__file__).parent)]):
        if module.name.endswith("_verbs"):
            yield from import_now(f"{__package__}.{module.name}").VERBS


class FileKind(ABC):
    """A kind of TOML file beside scenes, for `init` and `plan`: a subclass, whose docstring says what it is."""

    name: ClassVar[str]
    """Word for it after `seatfem init`."""
    table: ClassVar[str]
    """Name of a table that only such files have."""
    schema_file: ClassVar[str]
    """File name of its JSON schema."""

    @abstractmethod
    def template(self, file: str) -> str:
        """Return the text of a file to begin with; ``file``: its name in comments."""

    @abstractmethod
    def schema(self) -> Mapping[str, Any]:
        """Return its JSON schema."""

    @abstractmethod
    def expected_cost(self, path: Path, *, as_json: bool) -> str:
        """Return what the computation of a file would take, in one line or as JSON."""


def file_kinds() -> tuple[FileKind, ...]:
    """Return all kinds of files beside scenes."""
    return tuple(each() for each in FileKind.__subclasses__())
