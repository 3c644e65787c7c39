"""The report of a run: complete, escaped, and alive in a real browser without a network."""

from __future__ import annotations

import json
import re
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from seatfem.faces.cli import BAD_INPUT, DONE, run_command
from seatfem.faces.report.figures import MOST, _envelope
from seatfem.faces.report.folder import ReportError
from seatfem.faces.report.page import report_page

EXAMPLE = Path(__file__).parents[2] / "examples" / "flapper_on_spring.toml"
HOSTILE = "<script>document.title='taken'</script>"


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Of a run whose title is no text for a page."""
    where = tmp_path_factory.mktemp("report")
    text = EXAMPLE.read_text(encoding="utf-8").replace("Flapper reed on a spring", f"Reed {HOSTILE}")
    scene = where / "reed.toml"
    scene.write_text(text.replace('"3 ms"', '"1.5 ms"').replace('"1 %"', '"5 %"'), encoding="utf-8")
    assert run_command(["run", str(scene), "-o", str(where / "result"), "--quiet"]) == DONE
    assert run_command(["report", str(where / "result"), "--quiet"]) == DONE
    return where / "result"


def test_it_holds_what_was_asked_planned_and_found(folder: Path) -> None:
    page = (folder / "report.html").read_text(encoding="utf-8")
    assert len(page) < 15e6
    assert json.loads((folder / "plan.json").read_text(encoding="utf-8"))["choices"]
    for words in ("kind = &quot;cantilever&quot;", "accuracy of 5 % met", "Plan and its reasons", "run.time_step"):
        assert words in page
    assert "peak, 1 us mean" in page
    assert "SHA-256" in page
    assert page.count("data:image/png;base64") >= 2


def test_no_text_of_a_scene_runs_in_it(folder: Path) -> None:
    page = (folder / "report.html").read_text(encoding="utf-8")
    assert HOSTILE not in page
    assert "Reed &lt;script&gt;" in page


def test_it_names_no_address_to_ask(folder: Path) -> None:
    """Of its own: plotly's source names some that it asks only for maps."""
    page = re.sub(r"<script>.*?</script>", "", (folder / "report.html").read_text(encoding="utf-8"), flags=re.DOTALL)
    assert "://" not in page


def test_a_curve_keeps_its_peaks() -> None:
    values = np.zeros(200_000)
    values[[17, 123_456]] = 5.0, -7.0
    kept = _envelope(values)
    assert len(kept) <= MOST + 2
    assert {17, 123_456, 0, 199_999} <= set(kept.tolist())


@pytest.mark.parametrize(
    ("content", "message"), [(None, "holds no summary.json"), ("{", "is no JSON"), ("[]", "is no summary of a run")]
)
def test_what_is_no_run(tmp_path: Path, content: str | None, message: str) -> None:
    if content is not None:
        (tmp_path / "summary.json").write_text(content, encoding="utf-8")
    with pytest.raises(ReportError, match=message):
        report_page(tmp_path)
    assert run_command(["report", str(tmp_path), "--quiet"]) == BAD_INPUT
    assert not (tmp_path / "report.html").exists()


@pytest.fixture(scope="module")
def browser(folder: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    """The report in a headless Chromium."""
    chromium, driver = shutil.which("chromium"), shutil.which("chromedriver")
    if chromium is None or driver is None:
        pytest.skip("chromium or chromedriver is not installed (.ci/apt.txt)")
    from selenium import webdriver

    options = webdriver.ChromeOptions()
    options.binary_location = chromium
    profile = tmp_path_factory.mktemp("profile")
    for flag in ("headless=new", "no-sandbox", "disable-gpu", "disable-quic", "no-first-run", "disable-sync"):
        options.add_argument(f"--{flag}")
    for flag in ("disable-background-networking", "disable-component-update", f"user-data-dir={profile}"):
        options.add_argument(f"--{flag}")
    options.add_argument("--window-size=1200,900")
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    page = webdriver.Chrome(options=options, service=webdriver.ChromeService(driver))
    try:
        page.get((folder / "report.html").as_uri())
        yield page
    finally:
        page.quit()


@pytest.mark.slow
def test_a_browser_draws_it_without_a_complaint(browser: Any, tmp_path: Path) -> None:
    assert browser.get_log("browser") == []
    assert browser.title.startswith("Reed <script>")
    plots = browser.find_elements("css selector", ".js-plotly-plot")
    assert len(plots) >= 4
    asked = browser.execute_script("return performance.getEntriesByType('resource').map(e => e.name)")
    assert [name for name in asked if not name.startswith("data:")] == []
    browser.execute_script("arguments[0].scrollIntoView()", plots[0])
    plots[0].screenshot(str(tmp_path / "force.png"))
    shades = np.asarray(Image.open(tmp_path / "force.png").convert("L"))
    assert (shades < 200).mean() > 0.003  # lines and letters on a white ground


@pytest.mark.slow
def test_its_controls_work(browser: Any) -> None:
    plot = browser.find_elements("css selector", ".js-plotly-plot")[0]
    shown = "return arguments[0].querySelectorAll('.scatterlayer .trace').length"
    before = browser.execute_script(shown, plot)
    browser.execute_script("arguments[0].scrollIntoView()", plot)
    hidden = plot.find_elements("css selector", ".legendtoggle")[1]
    browser.execute_script(
        "for (const kind of ['mousedown', 'mouseup'])"
        " arguments[0].dispatchEvent(new MouseEvent(kind, {bubbles: true, view: window}))",
        hidden,
    )
    for _ in range(50):
        if browser.execute_script(shown, plot) > before:
            break
        browser.execute_async_script("setTimeout(arguments[0], 100)")
    assert browser.execute_script(shown, plot) == before + 1
    summary = browser.find_element("css selector", "details > summary")
    browser.execute_script("arguments[0].scrollIntoView({block: 'center'})", summary)
    summary.click()
    assert browser.find_element("css selector", "details pre").is_displayed()
    for image in browser.find_elements("css selector", "img"):
        assert image.get_attribute("alt")
