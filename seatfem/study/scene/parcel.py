"""A scene with all its files, under portable names, to be sent to another computer; hashes of a scene's content."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, Final

from pydantic import BaseModel

from seatfem.jobs.crew import FILES
from seatfem.structures import cache
from seatfem.structures.formats import mesh_files
from seatfem.study.scene import load, problems, tables
from seatfem.study.scene.wings import tables_in_files

_SUFFIX: Final = re.compile(r"(\.[A-Za-z0-9_]{1,8}){1,2}$")
_PLAIN: Final = re.compile(r"[A-Za-z0-9_][A-Za-z0-9_.-]{0,99}")


def packed(path: Path, changed: Mapping[str, Any]) -> tuple[str, dict[str, Any], dict[str, Path]]:
    """Return a changed scene for another computer: its path and changes there, and its files by their paths there.

    Files to which a file refers (included decks, the HDF5 of an .xdmf, the curve of a strength) keep their names.
    Raises `SceneError` for errors of the scene, and if such a name is not portable.
    """
    files = {"0/input.toml": path}
    renamed = dict(changed)
    for number, (key, file) in enumerate(_files(load.load_scene(path, changed).model_dump(by_alias=True)), start=1):
        suffix = _SUFFIX.search(file.name)
        name = f"{number}/input{suffix[0] if suffix else ''}"
        files[name] = file
        renamed[key] = f"{FILES}/{name}"
        for other in _with(file, key):
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
    """Return the absolute paths of all files that a scene names; a copy may have bodies of kinds its type lacks."""
    return {path for _, path in _files(scene.model_dump(by_alias=True, warnings=False))}


def _files(table: Any, key: str = "") -> Iterator[tuple[str, Path]]:
    """Yield pairs of dotted key and file."""
    if isinstance(table, Path):
        yield key, table
    parts = table.items() if isinstance(table, Mapping) else enumerate(table) if isinstance(table, list | tuple) else ()
    for name, part in parts:
        yield from _files(part, f"{key}.{name}" if key else str(name))


def _with(file: Path, key: str) -> list[Path]:
    """Return the files to which the file of a ``key`` refers."""
    if (table := tables_in_files().get(key)) is not None:
        return [other for _, other in _files(tables.load_table(file, table).model_dump())]
    return [] if file.suffix.lower() == ".csv" else list(mesh_files.all_files(file)[1:])  # slow


def by_content(scene: BaseModel, known: dict[Path, object] | None = None) -> dict[str, Any]:
    """Return the keys of a scene that are set, except the title, with each file replaced by a hash of its content and
    that of the files to which it refers. ``known``: hashes by path, extended here."""
    hashes = {} if known is None else known

    def hashed(asked: Any, key: str) -> Any:
        if isinstance(asked, Mapping):
            return {name: hashed(value, f"{key}{name}.") for name, value in asked.items()}
        if isinstance(asked, list | tuple):
            return [hashed(value, key) for value in asked]
        if not isinstance(asked, Path):
            return asked
        if asked not in hashes:
            hashes[asked] = cache.content_key({"files": [asked, *_with(asked, key.rstrip("."))]})
        return hashes[asked]

    content: dict[str, Any] = hashed(scene.model_dump(exclude={"title"}, exclude_unset=True, warnings=False), "")
    return content
