"""What tests of pages do in a browser: look, wait, set controls."""

import io
import time
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

PATIENCE = 40.0  # s of the clock, on a machine that is busy otherwise too


def shot(element: Any) -> NDArray[np.float64]:
    """Return what a screenshot of an element shows, in grey."""
    return np.asarray(Image.open(io.BytesIO(element.screenshot_as_png)).convert("L"), dtype=float)


def until(ask: Callable[[], Any], what: str) -> Any:
    """Return the first true answer."""
    end = time.monotonic() + PATIENCE
    while time.monotonic() < end:
        if answer := ask():
            return answer
        time.sleep(0.2)
    raise AssertionError(f"{what}: not within {PATIENCE:g} s")


def changed(element: Any, before: NDArray[np.float64], what: str, share: float = 0.003) -> NDArray[np.float64]:
    """Return its picture once more than a ``share`` of it differs clearly from that ``before``."""

    def look() -> tuple[NDArray[np.float64], ...]:
        now = shot(element)
        return (now,) if now.shape == before.shape and (np.abs(now - before) > 12).mean() > share else ()

    (now,) = until(look, f"{what}: another picture")
    return now


def put(browser: Any, element: Any, value: str) -> None:
    """Set a control to a value, as a user would leave it."""
    browser.execute_script(
        "arguments[0].value = arguments[1];"
        "for (const kind of ['input', 'change']) arguments[0].dispatchEvent(new Event(kind, {bubbles: true}))",
        element,
        value,
    )
