"""Reading and checking of a scene file, with messages for files of other kinds."""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path
from typing import Any, Final, Literal

from pydantic import create_model

from impact.quantities import brief_value
from seatfem.fields import absent, field_of, one_of
from seatfem.structures.formats import mesh_files
from seatfem.structures.kinds import Structure, kinds_of
from seatfem.study.scene.contact import OWN_LAWS, Contact, stopper_of
from seatfem.study.scene.laws import ContactLaw, laws
from seatfem.study.scene.measures import all_measures
from seatfem.study.scene.models import BODIES, Scene
from seatfem.study.scene.problems import Problem, SceneError, scene_error
from seatfem.study.scene.run import OWN_MEASURES, Accuracy
from seatfem.study.scene.tables import UNCHANGED, is_text, load_as, path_from, read_toml
from seatfem.study.scene.wings import WingTable, tables_of_wings

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
    if suffix in mesh_files.CAD:
        return f"is a CAD part, no scene (TOML); {_PARTS.format(file=path.name, kind='cad')}"
    if suffix in (*mesh_files.BY_GMSH, *mesh_files.READERS):
        return f"is a mesh, no scene (TOML); {_PARTS.format(file=path.name, kind='mesh')}"
    if suffix in mesh_files.SURFACES_ONLY:
        return "is a surface, no scene (TOML); a solid is needed: a STEP file (`seatfem init cad`), or a mesh of one"
    return ""


AnyScene = Scene | Path | str
"""A scene, the path of its file, or its text: a string of several lines."""
TEXT: Final = Path("text of the scene")
"""Name that stands in messages in place of a file."""


def take_scene(given: AnyScene, changed: Mapping[str, object] = UNCHANGED) -> Scene:
    """Return a scene given in any form. Raises `SceneError` as `load_scene`, and where a `Scene` is to be changed."""
    if not isinstance(given, Scene):
        return load_scene(given, changed)
    if changed:
        words = (
            f"{brief_value(changed)} changes keys of a file; give the path of the scene, or load_scene(path, changed)"
        )
        raise scene_error("changed", words)
    return given


def load_scene(path: Path | str, changed: Mapping[str, object] | None = None) -> Scene:
    """Read a scene file (TOML, up to 1 MB), or a scene as text, a string of several lines. Paths in it are relative to
    its folder, those in a text to the current one.

    ``changed``: values by dotted keys that replace those of the file, in the same form; None removes a key.

    Raises `SceneError` with all errors: a part, a mesh, a table in place of a scene, an unreadable file,
    TOML syntax, unknown or missing keys, wrong units, values out of range, and keys that contradict each other.
    """
    if is_text(path):
        file, text = TEXT, path
    elif why := no_scene(file := path_from(path)):
        raise SceneError((Problem(file, 0, "", why),))
    else:
        text = read_toml(file)
    return load_as(text, file, lambda data: scene_of(kinds_of(kinds_named(data))), changed or UNCHANGED)


def kinds_named(data: Mapping[str, Any]) -> set[str]:
    """Return the names of the kinds of the bodies of a scene; none, for all, unless each body has one."""
    bodies = [data.get(role) for role in (*BODIES, *{"stopper"} & data.keys())]
    named = [body["kind"] for body in bodies if isinstance(body, dict) and isinstance(body.get("kind"), str)]
    return set(named) if len(named) == len(bodies) else set()


def scene_of(kinds: tuple[type[Structure], ...] = ()) -> type[Scene]:
    """Return the type of scenes with bodies of these kinds, by default all, and with all contact laws and measures."""
    return _scene_of(kinds or kinds_of(), laws(), tuple(all_measures()), tables_of_wings())


@lru_cache
def _scene_of(
    kinds: tuple[type[Structure], ...],
    laws: tuple[type[ContactLaw], ...],
    measures: tuple[str, ...],
    wings: tuple[type[WingTable], ...],
) -> type[Scene]:
    fields: Any = {name: (one_of(kinds), field_of(Scene, name)) for name in BODIES}
    fields["stopper"] = (stopper_of(kinds, laws) | None, field_of(Scene, "stopper"))
    if laws != OWN_LAWS:
        law: Any = {"law": (one_of(laws), field_of(Contact, "law"))}
        fields["contact"] = (create_model("Contact", __base__=Contact, **law), field_of(Scene, "contact"))
    if measures != OWN_MEASURES:
        names: Any = {"measures": (tuple[Literal[measures], ...], field_of(Accuracy, "measures"))}  # type: ignore[valid-type]
        accuracy = create_model("Accuracy", __base__=Accuracy, __doc__=Accuracy.__doc__, **names)
        fields["accuracy"] = (accuracy, field_of(Scene, "accuracy"))
    fields |= {each.table: (each | None, absent(each.description)) for each in wings}
    return create_model("Scene", __base__=Scene, __doc__=Scene.__doc__, **fields)
