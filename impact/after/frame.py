"""Histories and tables as pandas data frames."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from impact.extras import how_to_mend

if TYPE_CHECKING:
    import pandas


class FrameError(ImportError):
    """pandas is missing; the message names the command that installs it."""


def frame_of(columns: Mapping[str, Any], index: str = "") -> pandas.DataFrame:
    """Return the ``columns`` as a `pandas.DataFrame`, with that named ``index`` as its index.

    Arrays (n, p) become p columns, "name[0]" to "name[p - 1]". Raises `FrameError` without pandas.
    """
    try:
        import pandas
    except Exception as missing:  # a broken one raises anything
        raise FrameError(f"a data frame needs pandas: {how_to_mend('pandas', 'tables', missing)}") from missing
    flat: dict[str, Any] = {}
    for name, values in columns.items():
        several = getattr(values, "ndim", 1) == 2
        flat |= {f"{name}[{k}]": values[:, k] for k in range(values.shape[1])} if several else {name: values}
    frame = pandas.DataFrame(flat)
    return frame.set_index(index) if index else frame
