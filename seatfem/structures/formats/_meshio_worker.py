"""meshio in a separate process, with limited memory and time; started by `mesh_files` only."""

import json
from typing import Any, Final

import numpy as np

from seatfem.jobs.processes import answers_to_parent, limit_process, lines_from_parent

MEMORY: Final = 1 << 30  # memory for any file [bytes]
PER_BYTE: Final = 60  # additional memory per byte of the file [bytes]
SECONDS: Final = 10  # processor time for any file [s]
SIZE_A_SECOND: Final = 1 << 18  # size of the file per additional second [bytes]


def plain(mesh: Any) -> tuple[dict[str, np.ndarray[Any, Any]], dict[str, Any]]:
    """Return the arrays and names that a seat needs: nodes, cells, and their groups."""
    out: dict[str, np.ndarray[Any, Any]] = {"points": np.asarray(mesh.points, dtype=float)}
    names: dict[str, Any] = {"types": [], "cell_data": [], "cell_sets": [], "point_sets": [], "point_data": []}
    for k, block in enumerate(mesh.cells):
        names["types"].append(block.type)
        out[f"cells {k}"] = np.asarray(block.data) if block.type[:4] != "poly" else np.zeros((len(block.data), 0), int)
    for name, parts in mesh.cell_data.items():
        arrays = [_flat(part) for part in parts]
        if all(part.dtype.kind in "iubf" and part.ndim == 1 for part in arrays):
            out |= {f"cell_data {len(names['cell_data'])} {k}": part for k, part in enumerate(arrays)}
            names["cell_data"].append(name)
    for name, parts in mesh.cell_sets.items():
        arrays = [np.asarray([] if part is None else part, dtype=np.int64) for part in parts]
        out |= {f"cell_sets {len(names['cell_sets'])} {k}": part for k, part in enumerate(arrays)}
        names["cell_sets"].append(name)
    for kind, groups in (("point_sets", mesh.point_sets), ("point_data", mesh.point_data)):
        for name, values in groups.items():
            array = _flat(values)
            if array.ndim == 1 and array.dtype.kind in "iubf":
                out[f"{kind} {len(names[kind])}"] = array
                names[kind].append(name)
    return out, names


def _flat(values: Any) -> np.ndarray[Any, Any]:
    array = np.asarray(values)
    return array[:, 0] if array.ndim == 2 and array.shape[1] == 1 else array


def answer(line: str) -> str:
    """Return the names of the arrays in the file of a job, which are written to another file; or the error."""
    job = json.loads(line)
    limit_process(memory=MEMORY + PER_BYTE * job["size"], seconds=SECONDS + job["size"] // SIZE_A_SECOND)
    try:
        import meshio

        arrays, reply = plain(meshio.read(job["file"], file_format=job["format"]))
        np.savez(job["arrays"], **arrays)  # type: ignore[arg-type]
    except (Exception, SystemExit) as error:  # meshio raises any error, and may call sys.exit
        reply = {"error": f"{type(error).__name__}: {error}"[:2000]}
    return json.dumps(reply)


if __name__ == "__main__":
    answers = answers_to_parent()
    for line in lines_from_parent():
        print(answer(line), file=answers, flush=True)
