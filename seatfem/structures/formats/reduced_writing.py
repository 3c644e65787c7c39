"""Reduced models for other programs: M, C, K of the modal coordinates, and state space, for Python and MATLAB."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import partial
from pathlib import Path
from typing import Any, Final

import numpy as np
from scipy import io, sparse

from impact.files.atomic import whole_file, write_whole
from impact.greens.base import GreensFunction
from impact.greens.state_space import state_space

README: Final = """\
A reduced model of the seat, written by seatfem export --to reduced. SI units throughout; {count} port(s): {ports}.
F [N] and u [m] of a port are the force on its patch and its mean displacement, positive along the outward normal.

reduced.npz, reduced.mat hold the same arrays.

State space, exact:      x' = A x + B F,  u = C x + D F;  g(t) = C exp(A t) B + D delta(t)  [m/(N s)]
    A ({s}, {s}), B ({s}, {p}), C ({p}, {s}), D ({p}, {p}) [m/N]; states, in order:
{states}
{second}
error_reduction, error_mesh: relative errors of g after a Hann pulse of the band, as estimated; NaN: not known.
valid_for: until when g is known [s].
"""
SECOND: Final = """\
Second order:            M q'' + Cq q' + K q = phi' F,  u = phi q + what is left over, below
    M, Cq, K ({m}, {m}), phi ({p}, {m}) [1/sqrt(kg)]: mass-normalised modal coordinates q [m sqrt(kg)].
    Left over: sum_r a_r a_r' exp(-rate_r t) + c delta(t), with residual_shapes a ({r}, {p}) [sqrt(m/(N s))],
    residual_rates ({r},) [1/s] and residual_compliance c ({p}, {p}) [m/N], which is D.
    mass.mtx, damping.mtx, stiffness.mtx, {files}: the same for kind = "matrices" of a scene, with
    first_dof = 1 and greens.bandwidth above all modes.
"""


def write_reduced(greens: GreensFunction, folder: Path) -> Iterator[Path]:
    """Write reduced.npz, reduced.mat and README.txt; of modal functions matrices for ``kind = "matrices"``, too.

    Raises:
        GreensFunctionError: a function that is no finite sum of poles.
        OutputError: ``folder`` cannot be written to.
    """
    space, modal = state_space(greens), greens.modal
    arrays: dict[str, Any] = {name: getattr(space, name) for name in "ABCD"}
    known = greens.error_estimate
    arrays |= {f"error_{n}": np.nan if (e := getattr(known, n)) is None else e for n in ("reduction", "mesh")}
    arrays |= {"valid_for": greens.valid_for, "ports": np.array(space.ports), "states": np.array(space.states)}
    second: dict[str, Any] = {}
    if modal is not None:
        w, rest = modal.omega, modal.residual
        second = {"M": np.eye(len(w)), "Cq": np.diag(2 * modal.zeta * w), "K": np.diag(w**2), "phi": modal.shapes.T}
        arrays |= second | {f"residual_{name}": getattr(rest, name) for name in ("shapes", "rates", "compliance")}
    named = {name: np.asarray(value) for name, value in arrays.items()}
    plain = {name: value.astype(object) if value.dtype.kind == "U" else value for name, value in named.items()}
    saves = {
        "reduced.npz": partial(np.savez, **arrays),
        "reduced.mat": partial(io.savemat, mdict=plain, oned_as="column"),
    }
    for name, save in saves.items():
        with whole_file(folder / name) as temporary, temporary.open("wb") as file:
            save(file)
        yield folder / name
    files = [f"{port}.csv" for port in _file_names(space.ports)]
    if second:
        for name, key in (("mass", "M"), ("damping", "Cq"), ("stiffness", "K")):
            with whole_file(folder / f"{name}.mtx") as temporary, temporary.open("wb") as out:
                io.mmwrite(out, sparse.coo_array(second[key]), symmetry="symmetric", precision=17)
            yield folder / f"{name}.mtx"
        for name, weights in zip(files, second["phi"], strict=True):
            rows = "".join(f"{k},{weight!r}\n" for k, weight in enumerate(weights.tolist(), start=1))
            write_whole(folder / name, f"dof,weight\n{rows}".encode())
            yield folder / name
    write_whole(folder / "README.txt", _readme(space.states, space.ports, second, arrays, files).encode())
    yield folder / "README.txt"


def _file_names(ports: tuple[str, ...]) -> Iterator[str]:
    """Return file names of ports, whose names may hold what paths must not."""
    plain = ["".join(c if c.isalnum() or c in "-_" else "_" for c in port) for port in ports]
    return (name if plain.count(name) == 1 else f"{name}_{k}" for k, name in enumerate(plain, start=1))


def _readme(
    states: tuple[str, ...], ports: tuple[str, ...], second: Any, arrays: Mapping[str, Any], files: list[str]
) -> str:
    s, p = len(states), len(ports)
    words = "\n".join(f"    {k:5d}  {state}" for k, state in enumerate(states, start=1))
    listed = ", ".join(files[:4]) + (", ..." if p > 4 else "")
    r = len(arrays["residual_rates"]) if second else 0
    more = SECOND.format(m=len(second["M"]), p=p, r=r, files=listed) if second else ""
    return README.format(count=p, ports=", ".join(ports), s=s, p=p, states=words, second=more)
