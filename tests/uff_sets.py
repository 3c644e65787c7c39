"""Datasets of universal files: units, modes and functions, as test programs write them."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pyuff

NAMES = {f"id{k}": "NONE" for k in range(1, 6)}


def write_sets(path: Path, *sets: dict[str, Any]) -> Path:
    for number, one in enumerate(sets):
        pyuff.UFF(str(path)).write_sets(one, mode="add" if number else "overwrite")
    return path


def unit_set(length: float = 1.0, force: float = 1.0) -> dict[str, Any]:
    """Dataset 164; SI, or so many units to a metre and a newton."""
    return dict(
        pyuff.prepare_164(
            units_code=9, units_description="own", temp_mode=1, length=length, force=force, temp=1.0, temp_offset=0.0
        )
    )


def mode_set(
    number: int, frequency: float, damping: float, x: Sequence[float], z: Sequence[float], mass: float = 1.0,
    hysteretic: float = 0.0,
) -> dict[str, Any]:  # fmt: skip
    """Dataset 55 of one mode [Hz], whose shape at the nodes 7, 8 and 9 has the components x and z."""
    kind = {"model_type": 1, "analysis_type": 2, "data_ch": 2, "spec_data_type": 8, "data_type": 2}
    shape = {"r1": np.array(x), "r2": np.zeros(3), "r3": np.array(z)}
    return dict(
        pyuff.prepare_55(
            **NAMES, **kind, **shape, n_data_per_node=3, node_nums=[7, 8, 9], load_case=1, mode_n=number,
            freq=float(frequency), modal_m=float(mass), modal_damp_vis=float(damping), modal_damp_his=float(hysteretic),
        )
    )  # fmt: skip


def function_set(x: np.ndarray, values: np.ndarray, *, in_time: bool = False, **changed: Any) -> dict[str, Any]:
    """Dataset 58 from node 7 to itself along z: displacement by force, over frequency or time."""
    given: dict[str, Any] = {
        **NAMES, "binary": 0, "func_type": 1 if in_time else 4, "ver_num": 0, "load_case_id": 0,
        "rsp_ent_name": "NONE", "rsp_node": 7, "rsp_dir": 3, "ref_ent_name": "NONE", "ref_node": 7, "ref_dir": 3,
        "ord_data_type": 4 if in_time else 6, "num_pts": len(x), "abscissa_spacing": 1, "abscissa_min": float(x[0]),
        "abscissa_inc": float(x[1] - x[0]), "z_axis_value": 0.0, "abscissa_spec_data_type": 17 if in_time else 18,
        "ordinate_spec_data_type": 8, "orddenom_spec_data_type": 13, "z_axis_spec_data_type": 0, "data": values, "x": x,
    }  # fmt: skip
    return dict(pyuff.prepare_58(**given | changed))
