"""Universal files (UFF): modes of dataset 55, and writing of dataset 58."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, Literal, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from impact.files.safe_files import MB, write_whole
from impact.greens import base, modal
from impact.notices import SeatfemError
from seatfem.structures.formats.universal import SYSTEMS, UNSTATED, Dataset, Units, read_datasets, read_units

Direction = Literal["+x", "-x", "+y", "-y", "+z", "-z"]
Place = tuple[int, Direction]
"""Node number, and direction of the outward normal of the struck face."""
System = Literal["SI", "mm-N-s", "inch-lbf-s"]
UNITS = {"SI": SYSTEMS[1], "mm-N-s": SYSTEMS[10], "inch-lbf-s": SYSTEMS[7]}
LIMIT = 256 * MB
CODES = {"+x": 1, "-x": -1, "+y": 2, "-y": -2, "+z": 3, "-z": -3}
FRF, _NORMAL_MODE = 4, 2
NAMES = 5  # lines of text at the beginning of datasets 55 and 58


class UffError(SeatfemError, ValueError):
    """Error of a universal file that cannot be used; the message names file, line, dataset and remedy."""


@dataclass(frozen=True)
class _Mode:
    """Dataset 55 of a normal mode; ``shape``: values of three directions at each node."""

    dataset: Dataset
    number: int
    frequency: float
    mass: float
    damping: float
    shape: Mapping[int, NDArray[Any]]

    def displacement(self, place: Place) -> float:
        """Return the component of the shape along a direction at a node."""
        node, code = place[0], CODES[place[1]]
        if node not in self.shape:
            numbers = f"{len(self.shape)} from {min(self.shape, default=0)} to {max(self.shape, default=0)}"
            raise self.dataset.fail(f"mode {self.number} has no node {node}; it has {numbers}")
        value = self.shape[node][abs(code) - 1]
        if abs(np.imag(value)) > 1e-6 * abs(value):
            raise self.dataset.fail(f"mode {self.number} is complex: export normal modes, or fit its FRFs")
        return float(np.real(value) * np.sign(code))


def read_modes_uff(
    path: str | os.PathLike[str],
    *,
    ports: Mapping[str, Place | Sequence[Place]],
    system: System | None = None,
    damping_ratio: float | None = None,
    modal_mass: float = 0.0,
    compliance: base.Array | float = 0.0,
) -> modal.ModalGreens:
    """Return normal modes of datasets 55 as a Green's function.

    w = 2 pi f, zeta = viscous ratio + half the hysteretic, shapes divided by the root of the modal mass. The file lacks
    the response of higher modes: give its static ``compliance``, or none is added.

    Args:
        ports: node and direction by name; several places are averaged.
        system: units of the file, one of `UNITS`, in place of those of dataset 164.
        damping_ratio: replaces the damping in the file.
        modal_mass: replaces the modal mass in the file, in its unit of mass (1 for mass-normalised shapes), if not 0.
        compliance: static compliance of all modes above the last, scalar or (p, p) [m/N], a massless spring.

    Raises:
        UffError: no such file, no normal modes, no units, a node that is missing, a modal mass that is not positive,
            complex shapes.
    """
    file, (sets, stated) = Path(path), read_sets(Path(path), 55, system)
    modes = sorted((mode for each in sets if (mode := _mode(each)) is not None), key=lambda mode: mode.frequency)
    if not modes:
        raise UffError(f"{file}: no normal modes (dataset 55, analysis type 2) in it; export them")
    if stated == UNSTATED:
        raise UffError(f"{file}: states no units (dataset 164); state system, one of {', '.join(UNITS)}")
    counts = Counter(mode.number for mode in modes)
    for mode in modes:
        if counts[mode.number] > 1:
            raise mode.dataset.fail(f"mode {mode.number} is there twice; remove one")
        if not (modal_mass or mode.mass) > 0:
            raise mode.dataset.fail(
                f"mode {mode.number} has the modal mass {mode.mass:g}, must be positive; state modal_mass = 1 if its "
                "shapes are mass-normalised"
            )
    masses = np.array([modal_mass or mode.mass for mode in modes])
    places = {name: cast("Sequence[Place]", [at] if isinstance(at[0], int) else at) for name, at in ports.items()}
    shapes = [[np.mean([*map(mode.displacement, port)]) for port in places.values()] for mode in modes]
    omega = np.array([2 * np.pi * mode.frequency for mode in modes])
    zeta = np.array([mode.damping if damping_ratio is None else damping_ratio for mode in modes])
    kilograms = masses * stated.newton / stated.metre
    residual = modal.Residual.spring(compliance) if np.any(compliance) else modal.Residual.none(len(ports))
    port_texts = {name: str(port) for name, port in places.items()}
    origin = {"kind": "modes", "file": file.name, "modes": len(modes), "ports": port_texts}
    return modal.ModalGreens(omega, zeta, shapes / np.sqrt(kilograms)[:, None], residual, tuple(ports), origin=origin)


def read_sets(path: Path, kind: int, system: System | None) -> tuple[list[Dataset], Units]:
    """Return the datasets of a kind, and the units by ``system``, or else by dataset 164, if it is there."""
    if not path.exists():
        raise UffError(f"{path}: no such file; check the path")
    if system is not None and system not in UNITS:
        raise UffError(f"system {system!r} is unknown; choose from {', '.join(UNITS)}")
    sets, others = list[Dataset](), set[int]()
    units = UNSTATED if system is None else UNITS[system]
    for dataset in read_datasets(path, LIMIT, UffError):
        others.add(dataset.number)
        sets += [dataset] if dataset.number == kind else []
        if dataset.number == 164 and system is None:
            units = read_units(dataset, units)
    if not sets:
        raise UffError(f"{path}: no dataset {kind} in it; it holds {sorted(others) or 'nothing'}")
    return sets, units


def _mode(dataset: Dataset) -> _Mode | None:
    """Return the normal mode in dataset 55; ``None`` of another analysis."""
    dataset.at = NAMES
    _, analysis, _, _, form, width = dataset.integers(6)
    if analysis != _NORMAL_MODE:
        return None
    if form not in (2, 5) or width not in (3, 6):
        raise dataset.fail(f"{width} values of data type {form} at a node, must be 3 or 6 of type 2 or 5: export it so")
    _, reals, _, number = dataset.integers(4)
    if reals != 4:
        raise dataset.fail(f"{reals} numbers follow, must be 4: frequency, modal mass, two ratios of damping")
    frequency, mass, viscous, hysteretic = dataset.reals(4)
    if min(frequency, viscous, hysteretic) < 0:
        raise dataset.fail(f"mode {number}: frequency and damping must be 0 or more")
    shape: dict[int, NDArray[Any]] = {}
    while dataset.has_more:
        (node,) = dataset.integers(1)
        if node in shape:
            raise dataset.fail(f"mode {number} has node {node} twice; remove one")
        values = np.array(dataset.reals(width if form == 2 else 2 * width))
        shape[node] = values[:3] if form == 2 else values[:6:2] + 1j * values[1:6:2]
    dataset.at = 0  # what is said later is said of its beginning
    return _Mode(dataset, number, frequency, mass, viscous + hysteretic / 2, shape)


_ID_LINES: Final = ["NONE"] * NAMES


def write_receptance_uff(greens: base.GreensFunction, frequency: ArrayLike, path: str | os.PathLike[str]) -> None:
    """Write the receptances G_ij(2 pi i f) [m/N] of all ports in SI units; port k is node k + 1, direction +z.

    Args:
        frequency: at least two evenly spaced frequencies (n,) [Hz].

    Raises:
        UffError: frequencies that are not evenly spaced.
        GreensFunctionError: a representation whose transform is not known in closed form.
        OutputError: ``path`` cannot be written.
    """
    f = np.asarray(frequency, dtype=np.float64)
    if f.ndim != 1 or len(f) < 2 or not np.allclose(np.diff(f), f[1] - f[0], rtol=1e-6) or f[1] <= f[0]:
        raise UffError("frequency: give at least two frequencies in even, rising steps")
    values = greens.transfer(np.asarray(2j * np.pi * f, dtype=np.complex128))
    labels = ((18, "Frequency", "Hz"), (8, "Receptance", "m"), (13, "Force", "N"), (0, "", ""))
    axes = [f"{kind:10}{0:5}{0:5}{0:5} {label:<20} {unit:<20}" for kind, label, unit in labels]
    sets = []
    for i, j in zip(*np.tril_indices(len(greens.ports)), strict=True):
        ends = "".join(f" {greens.ports[k][:10]:<10}{k + 1:10}{CODES['+z']:4}" for k in (i, j))
        form = f"{6:10}{len(f):10}{1:10}{f[0]:13.5e}{f[1] - f[0]:13.5e}{0.0:13.5e}"
        numbers = [f"{x:20.11e}" for x in values[:, i, j].copy().view(float)]
        rows = ["".join(numbers[k : k + 4]) for k in range(0, len(numbers), 4)]
        sets.append((58, [*_ID_LINES, f"{FRF:5}{0:10}{0:5}{0:10}{ends}", form, *axes, *rows]))
    _write(sets, path)


def write_modes_uff(
    points: base.Array, shapes: base.Array, frequency: base.Array, modal_mass: base.Array, path: str | os.PathLike[str]
) -> None:
    """Write normal modes in SI units, undamped: nodes (dataset 15) and shapes (dataset 55, analysis type 2).

    Args:
        points: positions (n, 3) of the nodes 1 to n [m].
        shapes: displacements (m, n, 3).
        frequency, modal_mass: frequencies (m,) [Hz], and modal masses (m,) for these shapes [kg].

    Raises:
        OutputError: ``path`` cannot be written.
    """
    nodes = [f"{k:10}{0:10}{0:10}{1:10}{_in_columns(point)}" for k, point in enumerate(points, start=1)]
    head = "".join(f"{number:10}" for number in (1, _NORMAL_MODE, 2, 8, 2, 3))
    sets = [(15, nodes)]
    for k, (shape, f, mass) in enumerate(zip(shapes, frequency, modal_mass, strict=True), start=1):
        places = [line for n, each in enumerate(shape, start=1) for line in (f"{n:10}", _in_columns(each))]
        values = _in_columns((f, mass, 0.0, 0.0))
        sets.append((55, [*_ID_LINES, head, f"{2:10}{4:10}{0:10}{k:10}", values, *places]))
    _write(sets, path)


def _in_columns(numbers: Iterable[float]) -> str:
    return "".join(f"{number:13.5e}" for number in numbers)


def _write(sets: Sequence[tuple[int, list[str]]], path: str | os.PathLike[str]) -> None:
    """Write datasets, each by its number and lines, behind one that states SI units."""
    one, zero = "  1.00000000000000000D+00", "  2.73150000000000000D+02"
    units = (164, [f"{1:10}{'SI: Meter (newton)':<20}{2:10}", 3 * one, zero])
    text = "".join(f"    -1\n{number:6}\n" + "\n".join(lines) + "\n    -1\n" for number, lines in (units, *sets))
    write_whole(path, text.encode("ascii", errors="replace"))
