"""A picture of a report for docs/report.md, by a headless Chromium.

    .venv/bin/python docs/page_pictures.py [FOLDER]

Runs examples/impact_stress.toml (or takes FOLDER, where it has run), and writes docs/images/report.png.
"""

from __future__ import annotations

import io
import shutil
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

from PIL import Image
from selenium import webdriver

from impact.files.safe_files import whole_file
from seatfem.faces.report.page import write_report
from seatfem.study.runs.pipeline import run_scene
from seatfem.study.scene import load_scene

ROOT = Path(__file__).resolve().parent.parent
IMAGES = ROOT / "docs" / "images"
FLAGS = ("headless=new", "no-sandbox", "use-angle=swiftshader", "enable-unsafe-swiftshader", "window-size=1120,860")
SETTLED = 4.0  # s, until a page is drawn


def main() -> None:
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(tempfile.mkdtemp())
    if not (folder / "summary.json").is_file():
        run_scene(load_scene(ROOT / "examples" / "impact_stress.toml"), folder)
    options = webdriver.ChromeOptions()
    options.binary_location = shutil.which("chromium") or ""
    for flag in FLAGS:
        options.add_argument(f"--{flag}")
    browser = webdriver.Chrome(options=options, service=webdriver.ChromeService(shutil.which("chromedriver")))
    try:
        page = Path(tempfile.mkdtemp()) / "report.html"
        write_report(folder, page)
        browser.get(page.as_uri())
        time.sleep(SETTLED)
        figure = browser.find_element("css selector", "figure.body[data-file='stress_wave.h5']")
        for name, value in (("frame", "9"), ("axis", "0"), ("cut", "600")):
            set_to(browser, figure.find_element("css selector", f"[data-of={name}]"), value)
        keep(figure.screenshot_as_png, "report.png")
    finally:
        browser.quit()


def set_to(browser: Any, element: Any, value: str) -> None:
    """A control of a page."""
    browser.execute_script(
        "arguments[0].value = arguments[1];"
        "for (const kind of ['input', 'change']) arguments[0].dispatchEvent(new Event(kind, {bubbles: true}))",
        element,
        value,
    )


def keep(png: bytes, name: str) -> None:
    """Packed as small as PNG can; all colours, since scales are told by them."""
    with whole_file(IMAGES / name) as temporary:
        Image.open(io.BytesIO(png)).convert("RGB").save(temporary, "PNG", optimize=True)


if __name__ == "__main__":
    main()
