"""Tables of the modes and of the installation. Their terminal takes no markup: messages have brackets."""

from __future__ import annotations

import inspect
import re
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from rich.table import Table
from rich.text import Text

from impact.quantities import percent, text
from seatfem.fields import by_group, kind_of
from seatfem.machine.doctor import Check
from seatfem.structures.kinds import kinds_of
from seatfem.study.accuracy.source_words import STAGES

if TYPE_CHECKING:
    from seatfem.structures.natural_modes import Mode


def time_line(seconds: Mapping[str, float]) -> str:
    """Return where the time went, the longest stage first, in one line."""
    longest_first = sorted(seconds.items(), key=lambda item: -item[1])
    return ", ".join(f"{STAGES.get(stage, stage)} {spent:.1f} s" for stage, spent in longest_first if spent >= 0.05)


def modes_table(modes: Sequence[Mode]) -> Table:
    """Return a table of the modes: number, frequency, nodal diameters of a body of revolution, the port's share."""
    revolved = any(mode.diameters is not None for mode in modes)
    table = Table("mode", "frequency", *(["nodal diameters"] if revolved else []), "share of the contact's compliance")
    for number, mode in enumerate(modes, start=1):
        around = [] if not revolved else [f"{mode.diameters} {mode.family}".strip()]
        share = "rigid" if mode.frequency_hz == 0 else "" if mode.share is None else percent(mode.share, 3)
        table.add_row(str(number), text(mode.frequency_hz, "Hz", 5), *around, share)
    return table


def kinds_table() -> Table:
    """Return the kinds of bodies that scenes know, by groups, each with the first sentence of its description."""
    table = Table("", "kind", "what it is")
    for group, kinds in by_group(kinds_of()).items():
        for number, each in enumerate(kinds):
            words = " ".join((inspect.getdoc(each) or "").replace("`", "").split())
            table.add_row("" if number else group, kind_of(each), re.split(r"(?<=[a-z)])[.:;] ", words)[0].rstrip("."))
    return table


def doctor_table(checks: Sequence[Check]) -> Table:
    """Return a table of what is installed, and how to mend what is not."""
    table = Table("", "", "state", "remedy")
    for check in checks:
        state = Text("ok") if check.ok else Text(*(("missing", "red") if check.required else ("gap", "yellow")))
        table.add_row(check.name, state, check.detail, "" if check.ok else check.remedy)
    return table


def rates_table(measured: Mapping[str, float], default: Mapping[str, float]) -> Table:
    """Return a table of the seconds for a unit of each kind of work on this computer, and over the default ones."""
    table = Table("work", "here (s)", "over default")
    for name, seconds in measured.items():
        table.add_row(name.replace("_", " "), f"{seconds:.2g}", f"{seconds / default[name]:.2g}")
    return table
