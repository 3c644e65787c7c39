"""The only way to the terminal: what is printed cannot steer it, whatever titles, keys, files and names hold.

Control characters (ESC and what follows from it, C0, C1), marks that turn the direction of writing round, invisible
characters and halves of pairs are written as escapes, ``\\x1b``; square brackets are no markup.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from typing import Any, Final

from rich.console import Console as RichConsole
from rich.console import ConsoleOptions, RenderableType
from rich.segment import Segment
from rich.text import Text

_UNSEEN: Final = re.compile(
    "[\\x00-\\x08\\x0b-\\x1f\\x7f-\\x9f\\xad\\u034f\\u061c\\u115f\\u1160\\u17b4\\u17b5\\u180b-\\u180f\\u200b-\\u200f"
    "\\u2028-\\u202e\\u2060-\\u206f\\u3164\\ud800-\\udfff\\ufeff\\uffa0\\ufff0-\\ufffb\\U000e0000-\\U000e0fff]"
)


def visible(text: str) -> str:
    """Return the text with every character that is not seen as itself written as an escape; tabs and line ends stay."""
    return _UNSEEN.sub(lambda found: found[0].encode("unicode_escape").decode("ascii"), text)


class Console(RichConsole):
    """rich's console, for texts that come from anywhere."""

    def __init__(self, **options: Any) -> None:
        super().__init__(**{"markup": False, "emoji": False} | options)

    def render_str(self, text: str, **options: Any) -> Text:
        """Render, as rich does, what `visible` makes of the text, so that tables leave room for it."""
        return super().render_str(visible(text), **options)

    def render(self, renderable: RenderableType, options: ConsoleOptions | None = None) -> Iterable[Segment]:
        """Render as rich does, and make visible what rich has not made itself."""
        for text, style, control in super().render(renderable, options):
            yield Segment(text if control else visible(text), style, control)
