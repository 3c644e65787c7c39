"""Reading and checking of a scene file, with messages for files of other kinds."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Callable, Mapping
from copy import deepcopy
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import Any, Final, Literal

from pydantic import ValidationError, create_model

from impact.files.safe_files import MB, read_text
from seatfem.fields import AnyTable, field_of, one_of
from seatfem.structures import formats
from seatfem.structures.kinds import Structure, kinds_of
from seatfem.study.scene.contact import OWN_LAWS, Contact, stopper_of
from seatfem.study.scene.laws import ContactLaw, laws
from seatfem.study.scene.measures import all_measures
from seatfem.study.scene.models import BODIES, Scene
from seatfem.study.scene.problems import KeyPath, Problem, SceneError, explain, key_lines, line_of, scene_error, single
from seatfem.study.scene.run import OWN_MEASURES, Accuracy

SCENE: Final = (".toml", "")
_PARTS: Final = (
    "`seatfem faces {file}` shows its faces; `seatfem init {kind}` writes a scene, in which seat.file names it"
)
_OTHERS: Final = {
    ".dxf": (
        "a drawing",
        "`seatfem init sheet` writes a scene, in which reed.file = {file!r} may replace reed.outline",
    ),
    ".csv": (
        "a table",
        "in a scene it may be the course of a load, pressure = {{ file = {file!r} }} in [[load]], or with "
        "`seatfem init frf` a measured response",
    ),
    ".uff": ("a universal file", "`seatfem init modes` or `init frf` writes a scene, in which seat.file names it"),
    ".mtx": (
        "a matrix",
        "`seatfem init matrices` writes a scene, in which seat.mass and seat.stiffness name such files",
    ),
    ".h5": ("a result", "`seatfem report` and `seatfem view` take its folder; `seatfem init greens` a seat of a run"),
    ".json": ("a table of results", "the folder that it is in has scene.toml: run that"),
}
_ALIKE: Final = {".58": ".uff", ".npz": ".mtx", ".npy": ".mtx", ".hdf5": ".h5"}


def no_scene(path: Path) -> str:
    """Return the reason why a file of this name is no scene, with a remedy; "" if it may be one, or does not exist."""
    suffix = path.suffix.lower()
    if path.is_dir() and suffix != ".toml":
        return "cannot be read: is a folder, no scene (TOML); `seatfem report` and `seatfem view` take folders of runs"
    if suffix in SCENE or not path.exists():
        return ""
    if (known := _ALIKE.get(suffix, suffix)) in _OTHERS:
        what, remedy = _OTHERS[known]
        return f"is {what}, no scene (TOML); {remedy.format(file=path.name)}"
    if suffix in formats.mesh_files.CAD:
        return f"is a CAD part, no scene (TOML); {_PARTS.format(file=path.name, kind='cad')}"
    if suffix in (*formats.mesh_files.BY_GMSH, *formats.mesh_files.READERS):
        return f"is a mesh, no scene (TOML); {_PARTS.format(file=path.name, kind='mesh')}"
    if suffix in formats.mesh_files.SURFACES_ONLY:
        return "is a surface, no scene (TOML); a solid is needed: a STEP file (`seatfem init cad`), or a mesh of one"
    return ""


LIMIT: Final = 1 * MB  # largest file
DEEPEST: Final = 32  # most parts of a dotted key
_DEEP_KEY: Final = re.compile(r"""(?<![\w"'-])(?:(?:"[^"\n]*+"|'[^'\n]*+'|[\w-]++)[ \t]*+\.[ \t]*+){32}""")
"""Dotted key of more than `DEEPEST` parts, for which reading takes the square of their number."""


class _Unreadable(ValueError):
    """Error of a file that cannot be read as text."""


def load_scene(path: Path | str, changed: Mapping[str, object] | None = None) -> Scene:
    """Read a scene file (TOML, up to 1 MB). Paths in it are relative to its folder.

    ``changed``: values by dotted keys that replace those of the file, in the same form; None removes a key.

    Raises `SceneError` with all errors: a part, a mesh, a table in place of a scene, an unreadable file,
    TOML syntax, unknown or missing keys, wrong units, values out of range, and keys that contradict each other.
    """
    if why := no_scene(Path(path)):
        raise SceneError((Problem(Path(path), 0, "", why),))
    return _load(Path(path), lambda data: scene_of(kinds_of(kinds_named(data))), changed)


def load_table(path: Path | str, model: type[AnyTable]) -> AnyTable:
    """Read a TOML file of up to 1 MB that holds the keys of a table; errors as `load_scene`."""
    return _load(Path(path), lambda _: model, None)


def _load(
    path: Path, model_of: Callable[[dict[str, Any]], type[AnyTable]], changed: Mapping[str, object] | None
) -> AnyTable:
    text = _read(path)
    data = _parse(text, path)
    for key, value in (changed or {}).items():
        _change(data, key, value, path)
    model = model_of(data)
    try:
        return model.model_validate(data, context={"folder": path.parent})
    except ValidationError as error:
        raise SceneError(explain(error, model, data, path, _lines(text))) from None


def kinds_named(data: Mapping[str, Any]) -> set[str]:
    """Return the names of the kinds of the bodies of a scene; none, for all, unless each body has one."""
    bodies = [data.get(role) for role in (*BODIES, *{"stopper"} & data.keys())]
    named = [body["kind"] for body in bodies if isinstance(body, dict) and isinstance(body.get("kind"), str)]
    return set(named) if len(named) == len(bodies) else set()


def has_table(path: Path, name: str) -> bool:
    """Return whether a file is TOML with a table of this name."""
    try:
        return isinstance(_parse(_read(path), path).get(name), dict)
    except SceneError:
        return False


def scene_of(kinds: tuple[type[Structure], ...] = ()) -> type[Scene]:
    """Return the type of scenes with bodies of these kinds, by default all, and with all contact laws and measures."""
    return _scene_of(kinds or kinds_of(), laws(), tuple(all_measures()))


@lru_cache
def _scene_of(
    kinds: tuple[type[Structure], ...], laws: tuple[type[ContactLaw], ...], measures: tuple[str, ...]
) -> type[Scene]:
    fields: Any = {name: (one_of(kinds), field_of(Scene, name)) for name in BODIES}
    fields["stopper"] = (stopper_of(kinds, laws) | None, field_of(Scene, "stopper"))
    if laws != OWN_LAWS:
        law: Any = {"law": (one_of(laws), field_of(Contact, "law"))}
        fields["contact"] = (create_model("Contact", __base__=Contact, **law), field_of(Scene, "contact"))
    if measures != OWN_MEASURES:
        names: Any = {"measures": (tuple[Literal[measures], ...], field_of(Accuracy, "measures"))}  # type: ignore[valid-type]
        fields["accuracy"] = (create_model("Accuracy", __base__=Accuracy, **names), field_of(Scene, "accuracy"))
    return create_model("Scene", __base__=Scene, __doc__=Scene.__doc__, **fields)


def located(error: SceneError, path: Path | None) -> SceneError:
    """Return the error with the scene's file, if it is known, and the lines of the keys."""
    if path is None or all(problem.file for problem in error.problems):
        return error
    lines = _lines(_read(path))
    found = (each if each.file else replace(each, file=path, line=line_of(each.path, lines)) for each in error.problems)
    return SceneError(tuple(sorted(found, key=lambda problem: problem.line)))


def _read(path: Path) -> str:
    try:
        return read_text(path, LIMIT, _Unreadable)
    except (OSError, _Unreadable) as error:
        raise scene_error("", f"cannot be read: {str(error).removeprefix(f'{path}: ')}", path) from None
    except UnicodeDecodeError as error:
        words = f"is not UTF-8 text (byte {error.start}), as TOML files are; save it so"
        raise scene_error("", words, path) from None


def _parse(text: str, path: Path) -> dict[str, Any]:
    if deep_key := _DEEP_KEY.search(text):
        line = text.count("\n", 0, deep_key.start()) + 1
        raise scene_error("", f"a key of more than {DEEPEST} parts; use at most four", path, line)
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        place = re.search(r"\(at line (\d+), column (\d+)\)", str(error))
        line = int(place[1]) if place else text.count("\n") + 1
        message = re.sub(r"\s*\(at .*\)$", "", str(error))
        column = f" (column {place[2]})" if place else " (end of file)"
        raise scene_error("", f"TOML syntax: {message}{column}; mend the line", path, line) from None
    except RecursionError:
        raise scene_error("", "tables or arrays are nested too deeply; use at most four levels", path) from None
    except ValueError as error:  # a whole number of thousands of digits, a date that does not exist
        raise scene_error("", f"TOML: {error}; mend it", path) from None


def _change(data: dict[str, Any], key: str, value: object, path: Path) -> None:
    """Set or remove one value in the data of a file; missing tables are added."""
    *tables, last = key.split(".")
    place: Any = data
    for name in tables:
        if value is None and isinstance(place, dict) and name not in place:
            return
        known = isinstance(place, list) and name.isdecimal() and int(name) < len(place)
        place = place[int(name)] if known else place.setdefault(name, {}) if isinstance(place, dict) else None
    if not isinstance(place, dict):
        words = "there is no table with such a key; choose another (a list counts its tables from 0)"
        raise scene_error(key, words, path)
    if value is None:
        place.pop(last, None)
    else:
        place[last] = deepcopy(value)


def _lines(text: str) -> dict[KeyPath, int]:
    """Return the line of each key; none if the nesting is too deep for the reader."""
    try:
        return {single(path): line for path, line in key_lines(text).items()}
    except RecursionError:
        return {}
