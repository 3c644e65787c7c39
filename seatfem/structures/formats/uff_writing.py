"""Receptances and modes as universal files, datasets 58 and 55, for modal analysis. Needs the extra [uff]."""

from __future__ import annotations

import os
from importlib import import_module
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike

from impact.extras import how_to_mend
from impact.files.atomic import whole_file
from impact.greens.base import Array, GreensFunction
from seatfem.structures.formats.uff import UffError

ALONG: Final = 3  # direction +z, the outward normal of every port
_FRF: Final[dict[str, Any]] = {
    **{f"id{k}": "NONE" for k in range(1, 6)},
    **{"binary": 0, "func_type": 4, "ver_num": 0, "load_case_id": 0, "rsp_dir": ALONG, "ref_dir": ALONG},
    **{"ord_data_type": 6, "abscissa_spacing": 1, "z_axis_value": 0.0, "z_axis_spec_data_type": 0},
    **{"abscissa_spec_data_type": 18, "ordinate_spec_data_type": 8, "orddenom_spec_data_type": 13},
}
"""Double precision, even steps of frequency, displacement over force."""
_MODE: Final[dict[str, Any]] = {
    **{f"id{k}": "NONE" for k in range(1, 6)},
    **{"model_type": 1, "analysis_type": 2, "data_ch": 2, "spec_data_type": 8, "data_type": 2, "n_data_per_node": 3},
    **{"load_case": 0, "modal_damp_vis": 0.0, "modal_damp_his": 0.0},
}
"""Structural, normal mode, translations, displacement, real."""


def write_receptance_uff(greens: GreensFunction, frequency: ArrayLike, path: str | os.PathLike[str]) -> None:
    """Write the receptances G_ij(2 pi i f) [m/N] of all ports in SI units; port k is node k + 1, direction +z.

    Args:
        frequency: (n,) in even steps, at least two [Hz].

    Raises:
        UffError: pyuff is missing; frequencies that are not even.
        GreensFunctionError: a representation whose transform is not known in closed form.
        OutputError: ``path`` cannot be written.
    """
    f = np.asarray(frequency, dtype=np.float64)
    if f.ndim != 1 or len(f) < 2 or not np.allclose(np.diff(f), f[1] - f[0], rtol=1e-6) or f[1] <= f[0]:
        raise UffError("frequency: give at least two frequencies in even, rising steps")
    pyuff = _pyuff()
    values = greens.transfer(np.asarray(2j * np.pi * f, dtype=np.complex128))
    sets = [_units(pyuff), *_functions(pyuff, f, values, greens.ports)]
    _write(pyuff, sets, path)


def write_modes_uff(
    points: Array, shapes: Array, frequency: Array, modal_mass: Array, path: str | os.PathLike[str]
) -> None:
    """Write normal modes in SI units, undamped: nodes (dataset 15) and shapes (dataset 55, analysis type 2).

    Args:
        points: (n, 3) of the nodes 1 to n [m].
        shapes: (m, n, 3).
        frequency, modal_mass: (m,) [Hz], [kg] for these shapes.

    Raises:
        UffError: pyuff is missing. OutputError: ``path`` cannot be written.
    """
    pyuff = _pyuff()
    numbers, ones = np.arange(1, len(points) + 1), np.ones(len(points), dtype=int)
    x, y, z = np.asarray(points, dtype=float).T
    sets = [
        _units(pyuff),
        pyuff.prepare_15(node_nums=numbers, def_cs=0 * ones, disp_cs=0 * ones, color=ones, x=x, y=y, z=z),
        *(
            pyuff.prepare_55(
                **_MODE,
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


def _pyuff() -> Any:
    try:
        return import_module("pyuff")
    except ImportError as missing:
        raise UffError(f"universal files need pyuff: {how_to_mend('pyuff', 'uff', missing)}") from None


def _write(pyuff: Any, sets: list[Any], path: str | os.PathLike[str]) -> None:
    with whole_file(Path(path)) as temporary:
        temporary.unlink()
        pyuff.UFF(str(temporary)).write_sets(sets, mode="add")


def _units(pyuff: Any) -> Any:
    scales = {"length": 1.0, "force": 1.0, "temp": 1.0, "temp_offset": 273.15}
    return pyuff.prepare_164(units_code=1, units_description="SI", temp_mode=1, **scales)


def _functions(pyuff: Any, f: Array, values: Any, names: tuple[str, ...]) -> list[Any]:
    step = {"num_pts": len(f), "abscissa_min": float(f[0]), "abscissa_inc": float(f[1] - f[0]), "x": f}
    return [
        pyuff.prepare_58(
            **_FRF,
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
