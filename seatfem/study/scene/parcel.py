"""A scene that leaves this computer: with all files that it names, under names that are safe anywhere."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, Final

from pydantic import BaseModel

from seatfem.jobs.desk import FILES
from seatfem.structures import formats, store
from seatfem.study.scene import load, problems
from seatfem.study.scene.strength import StrengthTable

_SUFFIX: Final = re.compile(r"(\.[A-Za-z0-9_]{1,8}){1,2}$")
_PLAIN: Final = re.compile(r"[A-Za-z0-9_][A-Za-z0-9_.-]{0,99}")


def packed(path: Path, changed: Mapping[str, Any]) -> tuple[str, dict[str, Any], dict[str, Path]]:
    """Return a changed scene for another computer: its place and changes there, and its files by their names.

    Files that a file is read with (decks that it includes, the HDF5 of an .xdmf, the curve of a strength) travel under
    their own names, which stand in it. Raises `SceneError` of what is wrong with the scene, and of such names that are
    not plain.
    """
    files = {"0/input.toml": path}
    renamed = dict(changed)
    for number, (key, file) in enumerate(_files(load.load_scene(path, changed).model_dump(by_alias=True)), start=1):
        suffix = _SUFFIX.search(file.name)
        name = f"{number}/input{suffix[0] if suffix else ''}"
        files[name] = file
        renamed[key] = f"{FILES}/{name}"
        for other in _with(file, strength=key.startswith("life.")):
            half = other.stem == file.stem and file.suffix.lower() in (".ele", ".node")
            inner = f"input{other.suffix}" if half else other.name
            if other.parent != file.parent or not _PLAIN.fullmatch(inner):
                text = (
                    f"{file} is read with {other}, which cannot travel to another computer: put it into the same "
                    "folder under a name of letters, digits and _.-"
                )
                raise problems.scene_error(key, text, path)
            files[f"{number}/{inner}"] = other
    return f"{FILES}/0/input.toml", renamed, files


def files_of(scene: BaseModel) -> set[Path]:
    """Return all files that a scene names, by their whole paths."""
    return {path for _, path in _files(scene.model_dump(by_alias=True))}


def _files(table: Any, key: str = "") -> Iterator[tuple[str, Path]]:
    """Yield the files by dotted key."""
    if isinstance(table, Path):
        yield key, table
    parts = table.items() if isinstance(table, Mapping) else enumerate(table) if isinstance(table, list | tuple) else ()
    for name, part in parts:
        yield from _files(part, f"{key}.{name}" if key else str(name))


def _with(file: Path, *, strength: bool) -> list[Path]:
    """Return the files that are read with it."""
    if strength:
        return [other for _, other in _files(load.load_table(file, StrengthTable).model_dump())]
    return [] if file.suffix.lower() == ".csv" else list(formats.meshio_files.all_files(file)[1:])  # loads all readers


def by_content(scene: BaseModel, known: dict[Path, object] | None = None) -> dict[str, Any]:
    """Return what a scene asks for, its title left out; in place of every file a hash of its content and of that of all
    files it is read with. ``known``: those by path, each of which is read once."""
    hashes = {} if known is None else known

    def hashed(asked: Any, key: str) -> Any:
        if isinstance(asked, Mapping):
            return {name: hashed(value, f"{key}{name}.") for name, value in asked.items()}
        if isinstance(asked, list | tuple):
            return [hashed(value, key) for value in asked]
        if not isinstance(asked, Path):
            return asked
        if asked not in hashes:
            hashes[asked] = store.content_key({"files": [asked, *_with(asked, strength=key.startswith("life."))]})
        return hashes[asked]

    content: dict[str, Any] = hashed(scene.model_dump(exclude={"title"}, exclude_unset=True), "")
    return content
