"""Files from outside, on their way into gmsh; used in the gmsh process only.

gmsh runs what it does not recognise as a script (`SystemCall`, `Merge`, `Printf > file`), and FILE.opt beside FILE.
"""

from __future__ import annotations

import re
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from types import MappingProxyType
from typing import Final

from impact.files.input_files import MB, opened_file
from seatfem.structures.shapes import GeometryError

LIMIT: Final = 2048 * MB
HEAD: Final = 400  # bytes
HEADS: Final[Mapping[str, tuple[re.Pattern[bytes], str]]] = MappingProxyType(
    {
        ".msh": (
            re.compile(rb"\$MeshFormat[ \t]*\r?\n[ \t]*[234](\.\d+)?[ \t]+[01][ \t]+8[ \t]*\r?\n"),
            "'$MeshFormat' and a line like '4.1 0 8' (gmsh, versions 2 to 4)",
        ),
        ".med": (re.compile(rb"\x89HDF\r\n\x1a\n"), "the mark of an HDF5 file"),
        ".step": (re.compile(rb"\s*ISO-10303-21\s*;"), "'ISO-10303-21;'"),
        ".brep": (re.compile(rb"\s*(DBRep_DrawableShape\s+)?CASCADE Topology"), "'CASCADE Topology'"),
    }
)
SAME: Final = MappingProxyType({".stp": ".step"})


@contextmanager
def handed_over(path: Path) -> Iterator[Path]:
    """Yield a copy of the file, under a plain name and alone in a private folder, once its first bytes are those of its
    format; what goes wrong with it is reported of the file itself. Raises `GeometryError` where they are not.
    """
    suffix = SAME.get(path.suffix.lower(), path.suffix.lower())
    if suffix not in HEADS:
        raise GeometryError(f"{path}: {suffix or 'no suffix'}: export it as one of {', '.join(HEADS)}")
    with tempfile.TemporaryDirectory(prefix="seatfem-") as folder:
        copy = Path(folder) / f"input{suffix}"
        with opened_file(path, LIMIT, GeometryError) as source, copy.open("xb") as target:
            while block := source.read(MB):
                target.write(block)
        with copy.open("rb") as file:
            head = file.read(HEAD)
        pattern, wanted = HEADS[suffix]
        if not pattern.match(head):
            raise GeometryError(
                f"{path}: is no {suffix} file; it begins with {head[:20]!r} instead of {wanted}. Export it again"
            )
        if suffix == ".med":
            from impact.files.hdf5_structure import check_structure  # here, for h5py takes its time

            check_structure(copy, GeometryError)
        try:
            yield copy
        except Exception as error:
            message = str(error).replace(str(copy), str(path))
            if isinstance(error, GeometryError):
                raise GeometryError(message, error.field) from error
            raise RuntimeError(message) from error
