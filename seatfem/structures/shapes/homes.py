"""Where a family of shapes from elsewhere is at home, so that the gmsh process finds its class, too."""

from __future__ import annotations

import hashlib
import sys
from importlib.util import module_from_spec, spec_from_file_location
from operator import attrgetter
from pathlib import Path
from types import ModuleType
from typing import Any, Final

from seatfem.structures.errors import GeometryError

_ELSEWHERE: Final = "seatfem_shapes_of_"


def home_of(spec: type[Any]) -> list[str]:
    """Return file and name of a class from elsewhere.

    Raises:
        GeometryError: no other process can find it: it is in no file, in a function, or its file is only being read
            for its shapes.
    """
    file, name = getattr(sys.modules.get(spec.__module__), "__file__", None), spec.__qualname__
    if not file:
        raise GeometryError(f"the shape {name} is in no file, where gmsh's process could find it: write it into one")
    if "<locals>" in name:
        raise GeometryError(f"{file}: the shape {name} is made by a function; define it at the top of the file")
    if spec.__module__.startswith(_ELSEWHERE):
        raise GeometryError(
            f"{file} is read for its shape {name}, and would mesh it meanwhile: put what it does, besides defining, "
            'under if __name__ == "__main__":'
        )
    return [str(Path(file).resolve()), name]


def at_home(file: str, name: str) -> type[Any]:
    """Return the class of that name in that file, which is run once, whatever else its module is called elsewhere."""
    private = _ELSEWHERE + hashlib.sha256(file.encode()).hexdigest()[:16]
    kind: type[Any] = attrgetter(name)(sys.modules.get(private) or _run(file, private))
    return kind


def _run(file: str, name: str) -> ModuleType:
    """Return a file as a module of this name; what it imports from its own folder is found there, after all else."""
    spec = spec_from_file_location(name, file)
    assert spec is not None
    assert spec.loader is not None
    sys.modules[name] = module = module_from_spec(spec)
    sys.path.append(str(Path(file).parent))
    try:
        spec.loader.exec_module(module)
    finally:
        sys.path.pop()
    return module
