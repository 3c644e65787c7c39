"""Universal files (UFF): frequency and impulse responses of dataset 58."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from impact.bodies.time_series import NOTHING_STATED, SECONDS, Stated
from impact.files.csv_table import normal_unit, real
from impact.greens import base
from impact.greens.sampled import SampledGreens, Tail
from impact.measured.frf import HERTZ, FrequencyResponse, Kind, receptance, response_units
from seatfem.structures.formats.uff import CODES, FRF, NAMES, UNITS, Place, System, UffError, read_sets
from seatfem.structures.formats.universal import SIZES, Dataset, Units

_ORDINATES: dict[int, Kind] = {8: "receptance", 11: "mobility", 12: "accelerance"}
_FORCES = (9, 13)
_TIME_RESPONSE = 1
_ABSCISSAE = {FRF: (18, "frequency", HERTZ), _TIME_RESPONSE: (17, "time", SECONDS)}


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
    frequency, values, kind, scale = _responses(Path(path), ports, FRF, system, units, quantity)
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


def _function(dataset: Dataset) -> _Function:
    """Return the function in dataset 58 or 58b."""
    dataset.at = NAMES
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
    sets, stated = read_sets(path, 58, system)
    if unknown := sorted({*units} - {"response", "frequency"}):
        raise UffError(f"{path}: units knows response and frequency of a universal file, not {unknown[0]}: remove it")
    functions = [_function(dataset) for dataset in sets]
    names, p = tuple(ports), len(ports)
    where = {(node, abs(CODES[along])): k for k, (node, along) in enumerate(ports.values())}
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
        signs = (np.sign(CODES[ports[names[k]][1]] * end[1]) for k, end in zip((i, j), function.ends, strict=True))
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
