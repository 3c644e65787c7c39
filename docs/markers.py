"""Pages whose numbers a script writes: between two comments of the page."""

from __future__ import annotations

import re


def between(text: str, name: str, content: str) -> str:
    """Return ``text`` with what stands between the markers of ``name`` replaced; raises `ValueError` without them."""
    pattern = rf"(<!-- {name} -->\n).*?(<!-- /{name} -->)"
    if not re.search(pattern, text, flags=re.DOTALL):
        raise ValueError(f"no markers <!-- {name} --> ... <!-- /{name} -->")
    return re.sub(pattern, lambda m: m[1] + content + "\n" + m[2], text, flags=re.DOTALL)
