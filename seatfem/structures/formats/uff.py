"""Universal files (UFF): modes of dataset 55, frequency and impulse responses of dataset 58."""

from __future__ import annotations

import math
import os
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, Literal, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from impact.bodies.time_series import NOTHING_STATED, SECONDS, Stated
from impact.files.csv_table import normal_unit, real
from impact.files.safe_files import MB, write_whole
from impact.greens import base, modal
from impact.greens.sampled import SampledGreens, Tail
from impact.measured.frf import HERTZ, FrequencyResponse, Kind, receptance, response_units
from seatfem.structures.formats.universal import SIZES, SYSTEMS, UNSTATED, Dataset, Units, read_datasets, read_units

Direction = Literal["+x", "-x", "+y", "-y", "+z", "-z"]
Place = tuple[int, Direction]
"""Node number, and direction of the outward normal of the struck face."""
System = Literal["SI", "mm-N-s", "inch-lbf-s"]
UNITS = {"SI": SYSTEMS[1], "mm-N-s": SYSTEMS[10], "inch-lbf-s": SYSTEMS[7]}
LIMIT = 256 * MB
_CODES = {"+x": 1, "-x": -1, "+y": 2, "-y": -2, "+z": 3, "-z": -3}
_ORDINATES: dict[int, Kind] = {8: "receptance", 11: "mobility", 12: "accelerance"}
_FORCES = (9, 13)
_TIME_RESPONSE, _FRF, _NORMAL_MODE = 1, 4, 2
_ABSCISSAE = {_FRF: (18, "frequency", HERTZ), _TIME_RESPONSE: (17, "time", SECONDS)}
_NAMES = 5  # lines of text at the beginning of datasets 55 and 58


class UffError(ValueError):
    """Error of a universal file that cannot be used; the message names file, line, dataset and remedy."""


@dataclass(frozen=True)
class _Function:
    """Dataset 58: function type, nodes and directions of response and reference, values (n,) over ``x``, and data type
    and unit of the axes, "" where none is stated."""

    dataset: Dataset
    type: int
    ends: tuple[tuple[int, int], tuple[int, int]]
    axes: list[tuple[int, str]]
    x: base.Array
    values: NDArray[Any]


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
        node, code = place[0], _CODES[place[1]]
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
    file, (sets, stated) = Path(path), _read(Path(path), 55, system)
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


def read_frf_uff(
    path: str | os.PathLike[str],
    *,
    ports: Mapping[str, Place],
    system: System | None = None,
    units: Stated = NOTHING_STATED,
    quantity: Kind | None = None,
) -> FrequencyResponse:
    """Return frequency responses of datasets 58 between the given ports, as receptance.

    They are receptance, mobility or accelerance by the ordinate's data type (8, 11 or 12) over a force (9 or 13). One
    of G_ij and G_ji is enough; every G_ii is needed. A direction opposite to the port's changes the sign. Their unit is
    that of dataset 164, or of the labels of the axes ("m/s^2" over "N"), which must not contradict each other.

    Args:
        system: units of the file, one of `UNITS`, in place of those that it states.
        units: units of "response" (as "g/N") and "frequency" as in `impact.read_frf`, in place of the file's.
        quantity: measured quantity, where the data type leaves it open (0, 1).

    Raises:
        UffError: no such file, no units or several, a response that is missing, ambiguous or of another quantity.
        FrequencyResponseError: errors of `FrequencyResponse`.
    """
    frequency, values, kind, scale = _responses(Path(path), ports, _FRF, system, units, quantity)
    origin = {"file": Path(path).name, "read_as": f"{kind}, values in {scale:.6g} {next(iter(response_units(kind)))}"}
    return receptance(frequency, values, kind, port_names=tuple(ports), origin=origin)


def read_impulse_response_uff(
    path: str | os.PathLike[str], *, ports: Mapping[str, Place], system: System | None = None, tail: Tail = "forbid"
) -> SampledGreens:
    """Return g(t) [m/(N s)] from datasets 58: time responses (type 1) of displacement per unit impulse.

    Raises:
        UffError: as `read_frf_uff`.
        GreensFunctionError: errors of `SampledGreens.from_series`.
    """
    time, values, kind, _ = _responses(Path(path), ports, _TIME_RESPONSE, system, {}, None)
    if kind != "receptance":
        raise UffError(f"{path}: the time response is no displacement (data type 8): export it as one")
    origin, g = {"kind": "measured", "file": Path(path).name}, np.moveaxis(np.real(values), 0, 2)
    try:
        return SampledGreens.from_series(time, g, tail=tail, port_names=tuple(ports), origin=origin)
    except base.GreensFunctionError as problem:
        raise base.GreensFunctionError(f"{path}: {problem}") from problem


def _read(path: Path, kind: int, system: System | None) -> tuple[list[Dataset], Units]:
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
    dataset.at = _NAMES
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


def _function(dataset: Dataset) -> _Function:
    """Return the function in dataset 58 or 58b."""
    dataset.at = _NAMES
    line = dataset.text()
    try:
        function = int(line[:5])
        node, along, other, pushed = (int(word) for at in (41, 66) for word in line[at : at + 14].split())
        form, count, even = map(int, (words := dataset.text().split())[:3])
        first, step = map(real, words[3:5])
        axes = [
            (int(line[:10]), normal_unit(line[46:67].replace("NONE", "")))
            for line in (dataset.text() for _ in range(4))
        ]
        _, parts = SIZES[form if count >= 0 and even in (0, 1) else 0]
    except (LookupError, ValueError):
        raise dataset.fail(
            "must state function type, nodes and directions; data type (2, 4, 5, 6), count, spacing, first value, "
            "step; data types and units of the axes, each in its columns: export it again"
        ) from None
    columns = parts + 1 - even
    numbers = np.array(dataset.reals(columns * count)) if dataset.binary is None else dataset.binary.astype(float)
    if dataset.has_more or numbers.size != columns * count or not np.all(np.isfinite(numbers)):
        raise dataset.fail(f"has other than {columns * count} finite numbers, or goes on after them; export it again")
    rows = numbers.reshape(count, columns)
    x: base.Array = first + step * np.arange(count, dtype=np.float64) if even else rows[:, 0]
    values = rows[:, -1] if parts == 1 else rows[:, -2] + 1j * rows[:, -1]
    dataset.at = 0  # what is said later is said of its beginning
    return _Function(dataset, function, ((node, along), (other, pushed)), axes, x, values)


def _responses(
    path: Path, ports: Mapping[str, Place], form: int, system: System | None, units: Stated, quantity: Kind | None
) -> tuple[base.Array, base.ComplexArray, Kind, float]:
    """Return abscissa (n,) and responses (n, p, p) of a function type in SI, their quantity, and factor to SI."""
    sets, stated = _read(path, 58, system)
    if unknown := sorted({*units} - {"response", "frequency"}):
        raise UffError(f"{path}: units knows response and frequency of a universal file, not {unknown[0]}: remove it")
    functions = [_function(dataset) for dataset in sets]
    names, p = tuple(ports), len(ports)
    where = {(node, abs(_CODES[along])): k for k, (node, along) in enumerate(ports.values())}
    table: dict[tuple[int, int], _Function] = {}
    for function in functions:
        i, j = (where.get((node, abs(along)), -1) for node, along in function.ends)
        if function.type != form or min(i, j) < 0:
            continue
        if (i, j) in table:
            raise UffError(f"{path}: two responses from port {names[j]!r} to {names[i]!r}: keep one")
        table[i, j] = function
    missing = [f"{names[i]} / {names[j]}" for i in range(p) for j in range(i + 1) if not {(i, j), (j, i)} & set(table)]
    if missing:
        pairs = ["/".join(f"{node}:{along}" for node, along in function.ends) for function in functions[:8]]
        has = f"it has (response/reference, node:direction) {', '.join(pairs)}" + ", ..." * (len(functions) > 8)
        raise UffError(f"{path}: no {_ABSCISSAE[form][1]} response for the ports {', '.join(missing)}; {has}")
    first, is_chosen = table[0, 0], system is not None
    x, (kind, scale) = _abscissa(first, units), _scale(first, stated, is_chosen, units, quantity)
    values = np.zeros((len(x), p, p), dtype=complex)
    for (i, j), function in table.items():
        own, (own_kind, scale) = _abscissa(function, units), _scale(function, stated, is_chosen, units, quantity)
        if own_kind != kind or own.shape != x.shape or np.any(np.abs(own - x) > 1e-3 * np.median(np.diff(x))):
            raise function.dataset.fail(f"must have quantity and abscissa of {names[0]} / {names[0]}; convert it")
        signs = (np.sign(_CODES[ports[names[k]][1]] * end[1]) for k, end in zip((i, j), function.ends, strict=True))
        values[:, i, j] = scale * math.prod(signs) * function.values
        if (j, i) not in table:
            values[:, j, i] = values[:, i, j]
    return x, values, kind, scale


def _scale(
    function: _Function, stated: Units, is_chosen: bool, units: Stated, quantity: Kind | None
) -> tuple[Kind, float]:
    """Return the quantity of a response and its factor to SI: as the caller chose, or else by dataset 164 and the
    labels of the axes. Raises `UffError` for units that are not stated, not known or contradict each other."""
    _, (ordinate, above), (force, below) = function.axes[:3]
    fail, kind = function.dataset.fail, _ORDINATES.get(ordinate, quantity if ordinate in (0, 1) else None)
    if kind is None or force not in _FORCES:
        raise fail(
            f"a response of data type {ordinate} over {force}, must be 8, 11 or 12 over 13 (force): export it so"
        )
    known = response_units(kind)
    if (response := units.get("response")) is not None:
        if is_chosen or normal_unit(response) not in known:
            raise fail(f"units.response = {response!r} must be one of {', '.join(known)}, without system; remove one")
        return kind, known[normal_unit(response)]
    of_file = stated.metre / (stated.newton or 1.0)
    if of_file and (is_chosen or not above):
        return kind, of_file
    label = f"{above}/{below.removesuffix(' s') or 'N'}"  # N s of an impulse
    scale = known.get(label, known.get(above))
    if not below and scale is not None and above not in known:  # over the unit of force of the file
        scale = scale / stated.newton if stated.newton else None
    example = label if label in known else next(iter(known))
    remedy = f"state units.response, as {example!r}, or system: {', '.join(UNITS)}"
    if scale is None:
        why = f"labels {label!r} are no unit of {kind} that is known" if above else "there are no labels of axes"
        raise fail(f"states no units that are known: dataset 164 is missing, or {why}; {remedy}")
    if of_file and not math.isclose(scale, of_file, rel_tol=1e-6):
        raise fail(f"its axes are labelled {label!r}, which contradicts dataset 164 ({of_file:.6g} in SI); {remedy}")
    return kind, scale


def _abscissa(function: _Function, stated: Stated) -> base.Array:
    """Return the abscissa (n,) in SI. Raises `UffError` for another data type, and an unknown unit."""
    (kind, label), (needed, _, units) = function.axes[0], _ABSCISSAE[function.type]
    unit = stated.get("frequency") or label or next(iter(units))
    if kind not in (needed, 0) or unit not in units:
        words = f"is of data type {kind} in {unit!r}, must be {needed} in {', '.join(units)}"
        raise function.dataset.fail(f"its abscissa {words}: export it so")
    return np.asarray(units[unit] * function.x)


_ID_LINES: Final = ["NONE"] * _NAMES


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
        ends = "".join(f" {greens.ports[k][:10]:<10}{k + 1:10}{_CODES['+z']:4}" for k in (i, j))
        form = f"{6:10}{len(f):10}{1:10}{f[0]:13.5e}{f[1] - f[0]:13.5e}{0.0:13.5e}"
        numbers = [f"{x:20.11e}" for x in values[:, i, j].copy().view(float)]
        rows = ["".join(numbers[k : k + 4]) for k in range(0, len(numbers), 4)]
        sets.append((58, [*_ID_LINES, f"{_FRF:5}{0:10}{0:5}{0:10}{ends}", form, *axes, *rows]))
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
