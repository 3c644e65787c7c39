"""Universal files (UFF): modes of dataset 55, frequency and impulse responses of dataset 58. Needs the extra [uff]."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any, Final, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike

from impact.files.safe_files import MB, check_file, whole_file
from impact.greens import base, modal
from impact.greens.sampled import SampledGreens, Tail
from impact.measured.frf import FrequencyResponse, Kind, receptance
from impact.names import how_to_mend

Direction = Literal["+x", "-x", "+y", "-y", "+z", "-z"]
Place = tuple[int, Direction]
"""Node number, and direction of the outward normal of the struck face."""
System = Literal["SI", "mm-N-s", "inch-lbf-s"]
UNITS: dict[str, tuple[float, float]] = {
    "SI": (1.0, 1.0),
    "mm-N-s": (1e-3, 1.0),
    "inch-lbf-s": (0.0254, 4.4482216152605),
}
"""Metres and newtons per unit of the file."""
LIMIT = 256 * MB
_AXES = {"x": 1, "y": 2, "z": 3}
_ORDINATES: dict[int, Kind] = {8: "receptance", 11: "mobility", 12: "accelerance"}
_FORCES = (9, 13)
_TIME_RESPONSE, _FRF, _NORMAL_MODE = 1, 4, 2


class UffError(ValueError):
    """Error of a universal file that cannot be used; the message names file, dataset and remedy."""


@dataclass(frozen=True)
class _File:
    """Datasets of one type, and metres and newtons per unit."""

    path: Path
    sets: list[dict[str, Any]]
    metre: float
    newton: float


def read_modes_uff(
    path: str | os.PathLike[str],
    *,
    ports: Mapping[str, Place | Sequence[Place]],
    units: System | None = None,
    damping_ratio: float | None = None,
    modal_mass: float | None = None,
    compliance: base.Array | float | None = None,
) -> modal.ModalGreens:
    """Return normal modes of datasets 55 as a Green's function.

    w = 2 pi f, zeta = viscous ratio + half the hysteretic, shapes divided by the root of the modal mass. The file lacks
    the response of higher modes: give its static ``compliance``, or none is added.

    Args:
        ports: node and direction by name; several places are averaged.
        units: units of a file without dataset 164, one of `UNITS`.
        damping_ratio: replaces the damping in the file.
        modal_mass: replaces the modal mass in the file, in its unit of mass (1 for mass-normalised shapes).
        compliance: static compliance of all modes above the last, scalar or (p, p) [m/N], a massless spring.

    Raises:
        UffError: pyuff missing, no such file, no normal modes, no units, a node that is missing, a modal mass that is
            not positive, complex shapes.
    """
    file = _read(Path(path), 55, units)
    modes = [dataset for dataset in file.sets if dataset.get("analysis_type") == _NORMAL_MODE]
    if not modes:
        raise UffError(f"{file.path}: no normal modes (dataset 55, analysis type 2) in it; export them")
    places = {name: _places(port) for name, port in ports.items()}
    per_mass = file.newton / file.metre  # kilograms per unit of mass
    omega, zeta, shapes = np.zeros(len(modes)), np.zeros(len(modes)), np.zeros((len(modes), len(places)))
    for k, mode in enumerate(modes):
        number = mode.get("mode_n", k + 1)
        mass = float(mode["modal_m"]) if modal_mass is None else modal_mass
        if not mass > 0:
            raise UffError(
                f"{file.path}: mode {number} has the modal mass {mass:g}; give modal_mass=1.0 if its shapes are "
                "mass-normalised"
            )
        omega[k] = 2 * np.pi * float(mode["freq"])
        damping = float(mode["modal_damp_vis"]) + float(mode["modal_damp_his"]) / 2
        zeta[k] = damping if damping_ratio is None else damping_ratio
        values = [np.mean([_displacement(file.path, mode, place) for place in port]) for port in places.values()]
        shapes[k] = np.array(values) / np.sqrt(mass * per_mass)
    order = np.argsort(omega, kind="stable")
    p = len(places)
    residual = modal.Residual.none(p) if compliance is None else modal.Residual.spring(compliance)
    origin = {
        "kind": "modes",
        "file": file.path.name,
        "modes": len(modes),
        "ports": {n: str(v) for n, v in places.items()},
    }
    return modal.ModalGreens(omega[order], zeta[order], shapes[order], residual, tuple(places), origin=origin)


def read_frf_uff(
    path: str | os.PathLike[str], *, ports: Mapping[str, Place], units: System | None = None
) -> FrequencyResponse:
    """Return frequency responses of datasets 58 between the given ports, as receptance.

    They are receptance, mobility or accelerance by the ordinate's data type (8, 11 or 12) over a force (9 or 13). One
    of G_ij and G_ji is enough; every G_ii is needed. A direction opposite to the port's changes the sign.

    Raises:
        UffError: pyuff missing, no such file, no units, a response that is missing, ambiguous or of another quantity.
        FrequencyResponseError: errors of `FrequencyResponse`.
    """
    file = _read(Path(path), 58, units)
    names, p = tuple(ports), len(ports)
    table: dict[tuple[int, int], dict[str, Any]] = {}
    for i, j, dataset in _between(file, ports, _FRF):
        if (i, j) in table:
            raise UffError(f"{file.path}: two frequency responses from port {names[j]!r} to {names[i]!r}: keep one")
        table[i, j] = dataset
    missing = [f"{names[i]} / {names[j]}" for i in range(p) for j in range(i + 1) if not {(i, j), (j, i)} & set(table)]
    if missing:
        raise UffError(f"{file.path}: no frequency response for the ports {', '.join(missing)}; {_listing(file)}")
    first = table[0, 0]
    frequency, kinds = np.asarray(first["x"], dtype=float), set()
    values = np.zeros((len(frequency), p, p), dtype=complex)
    for (i, j), dataset in table.items():
        kinds.add(_kind(file.path, dataset))
        x = np.asarray(dataset["x"], dtype=float)
        if x.shape != frequency.shape or np.any(np.abs(x - frequency) > 1e-3 * np.median(np.diff(frequency))):
            raise UffError(f"{file.path}: {names[i]} / {names[j]} must have the frequencies of {names[0]} / {names[0]}")
        sign = _sign(dataset, "rsp", ports[names[i]]) * _sign(dataset, "ref", ports[names[j]])
        values[:, i, j] = sign * np.asarray(dataset["data"]) * file.metre / file.newton
        if (j, i) not in table:
            values[:, j, i] = values[:, i, j]
    if len(kinds) > 1:
        raise UffError(f"{file.path}: {', '.join(sorted(kinds))} at once: convert them to one quantity")
    return receptance(frequency, values, kinds.pop(), port_names=names, origin={"file": file.path.name})


def read_impulse_response_uff(
    path: str | os.PathLike[str], *, ports: Mapping[str, Place], units: System | None = None, tail: Tail = "forbid"
) -> SampledGreens:
    """Return g(t) of one port from dataset 58: a time response (type 1) of displacement per unit impulse.

    Raises:
        UffError: as `read_frf_uff`; more than one port.
        GreensFunctionError: errors of `SampledGreens.from_series`.
    """
    file = _read(Path(path), 58, units)
    if len(ports) != 1:
        raise UffError(
            f"{file.path}: {len(ports)} ports; impulse responses are read for one; stack the values for more"
        )
    (name, place) = next(iter(ports.items()))
    responses = [dataset for _, _, dataset in _between(file, ports, _TIME_RESPONSE)]
    if len(responses) != 1:
        raise UffError(
            f"{file.path}: {len(responses)} time responses of port {name!r}, one is needed; {_listing(file)}"
        )
    if responses[0]["ordinate_spec_data_type"] != 8:
        raise UffError(f"{file.path}: the time response is no displacement (data type 8): integrate it first")
    sign = _sign(responses[0], "rsp", place) * _sign(responses[0], "ref", place)
    values = sign * np.real(responses[0]["data"]) * file.metre / file.newton
    origin = {"kind": "measured", "file": file.path.name}
    try:
        return SampledGreens.from_series(responses[0]["x"], values, tail=tail, port_names=(name,), origin=origin)
    except base.GreensFunctionError as problem:
        raise base.GreensFunctionError(f"{file.path}: {problem}") from problem


def _read(path: Path, kind: int, units: System | None) -> _File:
    pyuff = _pyuff(path.name)
    if not path.exists():
        raise UffError(f"{path}: no such file; check the path")
    check_file(path, LIMIT, UffError)
    if units is not None and units not in get_args(System):
        raise UffError(f"units {units!r} are unknown; choose from {', '.join(get_args(System))}")
    try:
        uff = pyuff.UFF(str(path))
        types = [int(number) for number in uff.get_set_types()]
        sets = [uff.read_sets(n) for n, number in enumerate(types) if number == kind]
        declared = [uff.read_sets(n) for n, number in enumerate(types) if number == 164]
        _refuse_incomplete(path, sets)
    except UffError:
        raise
    except Exception as problem:  # pyuff raises plain Exception
        raise UffError(f"{path}: cannot be read as a universal file, export it again: {problem}") from problem
    if not sets:
        raise UffError(f"{path}: no dataset {kind} in it; it holds {sorted(set(types)) or 'nothing'}")
    if units is None and not declared:
        raise UffError(f"{path}: states no units (dataset 164); give units=, one of {', '.join(UNITS)}")
    per_unit = [1 / x for x in UNITS[units]] if units else [float(declared[0][name]) for name in ("length", "force")]
    if not all(0 < x < np.inf for x in per_unit):
        raise UffError(f"{path}: dataset 164 states the units 1/{per_unit[0]:g} m and 1/{per_unit[1]:g} N; give units=")
    return _File(path, sets, 1 / per_unit[0], 1 / per_unit[1])


def _refuse_incomplete(path: Path, sets: list[dict[str, Any]]) -> None:
    """Raise `UffError` for values that are not finite or without abscissae, and for shapes with missing nodes."""
    for number, one in enumerate(sets, start=1):
        shapes = [(f"r{axis}", one.get(f"r{axis}"), one.get("node_nums")) for axis in (1, 2, 3)]
        for name, values, places in (("data", one.get("data"), one.get("x")), *shapes):
            if values is not None and (places is None or np.shape(values) != np.shape(places)):
                raise UffError(
                    f"{path}: dataset {number} of its type is incomplete: {name} {np.shape(values)}, "
                    f"{0 if places is None else np.size(places)} places; export it again"
                )
            if values is not None and not np.all(np.isfinite(values)):
                raise UffError(f"{path}: dataset {number} of its type: {name} must be finite")


def _between(file: _File, ports: Mapping[str, Place], function: int) -> Iterator[tuple[int, int, dict[str, Any]]]:
    """Yield the datasets of a function type with force at port j and response at port i, as (i, j, dataset)."""
    where = {(node, _AXES[direction[1]]): k for k, (node, direction) in enumerate(ports.values())}
    for dataset in file.sets:
        response = where.get((int(dataset["rsp_node"]), abs(int(dataset["rsp_dir"]))))
        reference = where.get((int(dataset["ref_node"]), abs(int(dataset["ref_dir"]))))
        if dataset["func_type"] == function and response is not None and reference is not None:
            yield response, reference, dataset


def _kind(path: Path, dataset: dict[str, Any]) -> Kind:
    ordinate, force = int(dataset["ordinate_spec_data_type"]), int(dataset["orddenom_spec_data_type"])
    if ordinate not in _ORDINATES or force not in _FORCES:
        raise UffError(
            f"{path}: a frequency response of data type {ordinate} over {force}; displacement (8), velocity (11) or "
            "acceleration (12) over force (13) is needed"
        )
    return _ORDINATES[ordinate]


def _sign(dataset: dict[str, Any], end: str, place: Place) -> float:
    along = 1.0 if place[1][0] == "+" else -1.0
    return along * float(np.sign(int(dataset[f"{end}_dir"])))


def _displacement(path: Path, mode: dict[str, Any], place: Place) -> float:
    node, direction = place
    if node not in (numbers := np.asarray(mode["node_nums"]).astype(int)):
        raise UffError(
            f"{path}: mode {mode.get('mode_n')} has no node {node}; it has {len(numbers)} from {numbers.min()} to "
            f"{numbers.max()}"
        )
    value = np.asarray(mode[f"r{_AXES[direction[1]]}"])[np.flatnonzero(numbers == node)[0]]
    if abs(np.imag(value)) > 1e-6 * abs(value):
        raise UffError(f"{path}: mode {mode.get('mode_n')} is complex: export normal modes, or fit its FRFs")
    return float(np.real(value)) * (1.0 if direction[0] == "+" else -1.0)


def _places(port: Place | Sequence[Place]) -> list[Place]:
    one, two = port[0], port[-1]
    if isinstance(one, int) and isinstance(two, str):
        return [(one, two)]
    return [place for place in port if isinstance(place, tuple)]


def _listing(file: _File) -> str:
    pairs = [f"{f['rsp_node']}:{f['rsp_dir']}/{f['ref_node']}:{f['ref_dir']}" for f in file.sets]
    return f"it holds (response/reference, node:direction) {', '.join(pairs[:8])}" + (", ..." if len(pairs) > 8 else "")


ALONG: Final = 3  # code of the direction +z, the outward normal of every port
_FRF_SET: Final[dict[str, Any]] = {
    **{f"id{k}": "NONE" for k in range(1, 6)},
    **{"binary": 0, "func_type": 4, "ver_num": 0, "load_case_id": 0, "rsp_dir": ALONG, "ref_dir": ALONG},
    **{"ord_data_type": 6, "abscissa_spacing": 1, "z_axis_value": 0.0, "z_axis_spec_data_type": 0},
    **{"abscissa_spec_data_type": 18, "ordinate_spec_data_type": 8, "orddenom_spec_data_type": 13},
}
"""Settings of a response: double precision, even frequency steps, displacement over force."""
_MODE_SET: Final[dict[str, Any]] = {
    **{f"id{k}": "NONE" for k in range(1, 6)},
    **{"model_type": 1, "analysis_type": 2, "data_ch": 2, "spec_data_type": 8, "data_type": 2, "n_data_per_node": 3},
    **{"load_case": 0, "modal_damp_vis": 0.0, "modal_damp_his": 0.0},
}
"""Settings of a mode: structural, normal mode, translations, displacement, real."""


def write_receptance_uff(greens: base.GreensFunction, frequency: ArrayLike, path: str | os.PathLike[str]) -> None:
    """Write the receptances G_ij(2 pi i f) [m/N] of all ports in SI units; port k is node k + 1, direction +z.

    Args:
        frequency: at least two evenly spaced frequencies (n,) [Hz].

    Raises:
        UffError: pyuff is missing; frequencies that are not evenly spaced.
        GreensFunctionError: a representation whose transform is not known in closed form.
        OutputError: ``path`` cannot be written.
    """
    f = np.asarray(frequency, dtype=np.float64)
    if f.ndim != 1 or len(f) < 2 or not np.allclose(np.diff(f), f[1] - f[0], rtol=1e-6) or f[1] <= f[0]:
        raise UffError("frequency: give at least two frequencies in even, rising steps")
    pyuff = _pyuff()
    values = greens.transfer(np.asarray(2j * np.pi * f, dtype=np.complex128))
    sets = [_unit_set(pyuff), *_functions(pyuff, f, values, greens.ports)]
    _write(pyuff, sets, path)


def write_modes_uff(
    points: base.Array, shapes: base.Array, frequency: base.Array, modal_mass: base.Array, path: str | os.PathLike[str]
) -> None:
    """Write normal modes in SI units, undamped: nodes (dataset 15) and shapes (dataset 55, analysis type 2).

    Args:
        points: positions (n, 3) of the nodes 1 to n [m].
        shapes: displacements (m, n, 3).
        frequency, modal_mass: frequencies (m,) [Hz], and modal masses (m,) for these shapes [kg].

    Raises:
        UffError: pyuff is missing. OutputError: ``path`` cannot be written.
    """
    pyuff = _pyuff()
    numbers, ones = np.arange(1, len(points) + 1), np.ones(len(points), dtype=int)
    x, y, z = np.asarray(points, dtype=float).T
    sets = [
        _unit_set(pyuff),
        pyuff.prepare_15(node_nums=numbers, def_cs=0 * ones, disp_cs=0 * ones, color=ones, x=x, y=y, z=z),
        *(
            pyuff.prepare_55(
                **_MODE_SET,
                mode_n=k,
                freq=float(f),
                modal_m=float(mass),
                node_nums=numbers,
                **{f"r{axis}": shape[:, axis - 1] for axis in (1, 2, 3)},
            )
            for k, (shape, f, mass) in enumerate(zip(shapes, frequency, modal_mass, strict=True), start=1)
        ),
    ]
    _write(pyuff, sets, path)


def _pyuff(what: str = "writing a universal file") -> Any:
    try:
        return import_module("pyuff")
    except ImportError as missing:
        raise UffError(f"{what} needs pyuff: {how_to_mend('pyuff', 'uff', missing)}") from missing


def _write(pyuff: Any, sets: list[Any], path: str | os.PathLike[str]) -> None:
    with whole_file(Path(path)) as temporary:
        temporary.unlink()
        pyuff.UFF(str(temporary)).write_sets(sets, mode="add")


def _unit_set(pyuff: Any) -> Any:
    scales = {"length": 1.0, "force": 1.0, "temp": 1.0, "temp_offset": 273.15}
    return pyuff.prepare_164(units_code=1, units_description="SI", temp_mode=1, **scales)


def _functions(pyuff: Any, f: base.Array, values: Any, names: tuple[str, ...]) -> list[Any]:
    step = {"num_pts": len(f), "abscissa_min": float(f[0]), "abscissa_inc": float(f[1] - f[0]), "x": f}
    return [
        pyuff.prepare_58(
            **_FRF_SET,
            **step,
            rsp_ent_name=response[:10],
            rsp_node=i + 1,
            ref_ent_name=force[:10],
            ref_node=j + 1,
            data=values[:, i, j],
        )
        for i, response in enumerate(names)
        for j, force in enumerate(names[: i + 1])
    ]
