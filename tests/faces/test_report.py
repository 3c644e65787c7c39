"""The report of a run: complete, escaped, and alive in a real browser without a network."""

import html
import io
import json
import os
import re
import shutil
import subprocess
import sys
import webbrowser
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from seatfem.faces.cli import BAD_INPUT, DONE, run_command
from seatfem.faces.report.asked import AskedError
from seatfem.faces.report.fragments import ReportError, hot_spots, keys_table, provenance
from seatfem.faces.report.page import SCREENS, _landings, report_page
from seatfem.pictures.moving import save_moving
from tests.browsing import changed, put, shot, until
from tests.moving_block import block_modes, block_wave

EXAMPLE = Path(__file__).parents[2] / "examples" / "flapper_on_spring.toml"
HOSTILE = "<script>document.title='taken'</script>"


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Run and report a scene whose title is no text for a page."""
    where = tmp_path_factory.mktemp("report")
    text = EXAMPLE.read_text(encoding="utf-8").replace("Flapper reed on a spring", f"Reed {HOSTILE}")
    scene = where / "reed.toml"
    scene.write_text(text.replace('"3 ms"', '"1.5 ms"').replace('"1 %"', '"5 %"'), encoding="utf-8")
    assert run_command(["run", str(scene), "-o", str(where / "result"), "--quiet"]) == DONE
    save_moving(block_modes(("1: 10 kHz", "2: 20 kHz", HOSTILE)), where / "result" / "modes.h5")
    save_moving(block_wave(), where / "result" / "stress_wave.h5")
    assert run_command(["report", str(where / "result"), "--quiet"]) == DONE
    return where / "result"


@pytest.mark.slow
def test_it_holds_what_was_asked_planned_and_found(folder: Path) -> None:
    """No text of a scene runs in the page, and outside the scripts, where plotly names sources of maps, it names no
    address. The seat is a spring: it has no response over time, and no other spring to be compared with."""
    page = (folder / "report.html").read_text(encoding="utf-8")
    assert len(page) < 15e6
    assert json.loads((folder / "plan.json").read_text(encoding="utf-8"))["choices"]
    for words in (
        "kind = &quot;cantilever&quot;",
        "Accuracy of 5 % reached: impulse ±",
        "Plan and its reasons",
        "run.time_step",
        "peak force (mean over 1 us)",
    ):
        assert words in page
    assert "Not in this folder" not in page
    assert "SHA-256" in page
    assert page.count("data:image/png;base64") >= 2
    assert HOSTILE not in page
    assert "Reed &lt;script&gt;" in page
    assert page.count("&lt;script&gt;document.title") >= 2  # the name of a mode, too
    assert "://" not in re.sub(r"<script>.*?</script>", "", page, flags=re.DOTALL)
    assert (folder / "greens.png").is_file()
    for words in ("Green&#x27;s function of the seat", "The driving-point Green", "spring<br>baseline"):
        assert words not in page


@pytest.mark.slow
@pytest.mark.parametrize(("width", "height"), [(1300, 900), (400, 800)])
def test_the_decision_is_on_the_first_screen_and_nothing_scrolls_sideways(
    browser: Any, width: int, height: int
) -> None:
    """All tables fit into a page as wide as a laptop's; on a phone a wide table scrolls by itself."""
    size = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": False}
    browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
    try:
        word = browser.find_element("css selector", ".first .decision")
        assert word.text.lower() == "undecided"
        assert word.rect["y"] + word.rect["height"] < height
        seen = "return document.documentElement.scrollWidth"  # curves are drawn anew after a moment
        until(lambda: browser.execute_script(seen) <= width, f"a page of {width} px")
        wide = "[...document.querySelectorAll('.scroll')].filter(each => each.scrollWidth > each.clientWidth).length"
        assert width < 1300 or browser.execute_script(f"return {wide}") == 0
    finally:
        browser.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})


def test_hot_spots_and_keys_of_wings_are_tables() -> None:
    spot = {"von_mises_Pa": 1.25e8, "time_s": 2e-4, "at_m": [0.004, 0.001], "edge_distance_m": None}
    assert "<td>125 MPa</td><td>200 µs</td><td>4, 1</td><td></td>" in hot_spots({"seat_stress_hot_spots": [spot, 3]})
    assert hot_spots({}) == hot_spots({"seat_stress_hot_spots": "many"}) == ""
    unknown = {"peak_seat_stress_Pa": 21.18e6, "error_bar_peak_seat_stress_Pa": 42.9e6}
    assert "not known (21 ± 43 MPa)" in hot_spots({"seat_stress_hot_spots": [spot], **unknown})
    table = keys_table({"life_margin": 1.234567, "error_bar_life_margin": 0.05, "life_at": "<b>"}, "life_")
    assert "margin</td><td>1.235 ± 0.050</td>" in table
    assert "not known (1.20 ± 0.70)" in keys_table({"life_margin": 1.2, "error_bar_life_margin": 0.7}, "life_")
    assert "&lt;b&gt;" in table
    assert keys_table({"peak": 1.0}, "life_") == ""


def landings(count: int) -> list[dict[str, object]]:
    """Return landings as summary.json lists them, each weaker than the one before."""
    return [
        {
            "body": "seat", "number": number, "time_s": 1e-4 * number, "duration_s": 2e-5,
            "peak_time_s": 1e-4 * number + 1e-5, "filtered_peak_force_N": 50.0 - number,
            "excess_peak_force_N": 50.0 - number,
        }
        for number in range(1, count + 1)
    ]  # fmt: skip


def test_landings_are_a_table_and_all_of_them_can_be_opened() -> None:
    assert _landings({}) == ""
    few, many = (_landings({"landings": landings(count)}) for count in (3, 12))
    assert few.count("<td>seat ") == 3
    assert "<details>" not in few
    shown, whole = many.split("<details><summary>all 12 landings</summary>")
    assert (shown.count("<td>seat "), whole.count("<td>seat ")) == (10, 12)
    assert "; 2 more in landings.csv" in shown


@pytest.mark.parametrize(
    ("content", "message"), [(None, "holds no summary.json"), ("{", "is no JSON"), ("[]", "is no summary of a run")]
)
def test_what_is_no_run(tmp_path: Path, content: str | None, message: str) -> None:
    if content is not None:
        (tmp_path / "summary.json").write_text(content, encoding="utf-8")
    with pytest.raises(ReportError, match=message):
        report_page(tmp_path)
    for verb in ("report", "view"):
        assert run_command([verb, str(tmp_path), "--quiet"]) == BAD_INPUT
    assert not (tmp_path / "report.html").exists()


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="the browser is named by the variable BROWSER")
def test_view_opens_the_page_in_the_browser(folder: Path, tmp_path: Path) -> None:
    page, request = tmp_path / "a page.html", tmp_path / "asked"
    program = tmp_path / "browser"
    program.write_text(f'#!/bin/sh\nprintf %s "$*" > {request}\n', encoding="utf-8")
    program.chmod(0o755)
    words = [sys.executable, "-m", "seatfem", "view", str(folder), "-o", str(page)]
    shown = {**os.environ, "BROWSER": f"{program} %s"}
    process = subprocess.run(words, env=shown, capture_output=True, text=True, timeout=300, check=True)
    assert process.stdout == f"wrote {page}\n"
    assert request.read_text(encoding="utf-8") == page.as_uri()
    assert page.read_text(encoding="utf-8").startswith("<!doctype html>")


def _no_browser(address: str) -> bool:
    raise webbrowser.Error("could not locate runnable browser")


@pytest.mark.slow
@pytest.mark.parametrize("screen", ["", ":0"])
def test_view_without_a_browser_says_where_the_page_is(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, screen: str
) -> None:
    """The page's place is told where no browser opens; none is asked without a screen."""
    monkeypatch.setattr(sys, "platform", "linux")
    for name in SCREENS:
        monkeypatch.setenv(name, screen)
    addresses: list[str] = []
    monkeypatch.setattr(webbrowser, "open", lambda address: addresses.append(address) or _no_browser(address))
    page = tmp_path / "page.html"
    assert run_command(["view", str(folder), "-o", str(page)]) == DONE
    assert addresses == ([page.as_uri()] if screen else [])
    assert f"no browser opens here; open {page} in one" in capsys.readouterr().out
    assert page.is_file()
    if screen:
        addresses.clear()
        assert run_command(["view", str(folder), "-o", str(page), "--no-browser"]) == DONE
        assert addresses == []
        assert capsys.readouterr().out == f"wrote {page}\n"


@pytest.fixture(scope="module")
def browser(folder: Path, chromium: Any) -> Any:
    """Open the report in a headless Chromium, whose log may hold complaints about pages before it."""
    chromium.get_log("browser")
    chromium.get((folder / "report.html").as_uri())
    return chromium


@pytest.mark.slow
def test_a_browser_draws_it_without_a_complaint(browser: Any, tmp_path: Path) -> None:
    assert browser.get_log("browser") == []
    assert browser.title.startswith("Reed <script>")
    plots = browser.find_elements("css selector", ".js-plotly-plot")
    assert len(plots) >= 4
    resources = browser.execute_script("return performance.getEntriesByType('resource').map(e => e.name)")
    assert [name for name in resources if not name.startswith("data:")] == []
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


def _body(browser: Any, name: str) -> tuple[Any, Any]:
    """Return a figure of a body that is drawn, in sight, and its canvas."""
    figure = browser.find_element("css selector", f"figure.body[data-file='{name}']")
    until(lambda: figure.get_attribute("data-ready"), f"{name} is drawn")
    canvas = figure.find_element("css selector", "canvas")
    browser.execute_script("arguments[0].scrollIntoView({block: 'center'})", canvas)
    return figure, canvas


@pytest.mark.slow
def test_a_mode_is_picked_turned_and_played(browser: Any) -> None:
    figure, canvas = _body(browser, "modes.h5")
    first = shot(canvas)
    assert (first < 240).mean() > 0.02  # something is drawn
    put(browser, figure.find_element("css selector", "[data-of=frame]"), "1")
    second = changed(canvas, first, "another mode")
    put(browser, figure.find_element("css selector", "[data-of=scale]"), "90")
    third = changed(canvas, second, "more exaggeration")
    canvas.send_keys("\ue014" * 6)  # the right arrow
    changed(canvas, third, "turned by keys")
    figure.find_element("css selector", "[data-of=reset]").click()
    until(lambda: (np.abs(shot(canvas) - third) > 12).mean() < 0.001, "as it was before it was turned")
    play = figure.find_element("css selector", "[data-of=play]")
    play.click()
    assert play.get_attribute("aria-pressed") == "true"
    changed(canvas, third, "in motion")
    play.click()
    assert browser.get_log("browser") == []


@pytest.mark.slow
def test_time_is_scrubbed_and_a_click_tells_the_stress(browser: Any) -> None:
    """The front is at the top in the last frame: 50 MPa and 1 µm, exactly."""
    figure, canvas = _body(browser, "stress_wave.h5")
    before = shot(canvas)
    put(browser, figure.find_element("css selector", "[data-of=frame]"), "4")
    assert "4 µs" in figure.text
    assert "von Mises stress [MPa]" in figure.text
    after = changed(canvas, before, "another time")
    rows = np.flatnonzero((after < 240).any(axis=1))
    from selenium.webdriver import ActionChains

    down = float(rows[0] + 12 - after.shape[0] / 2)  # on the top face
    ActionChains(browser).move_to_element_with_offset(canvas, 0, round(down)).click().perform()
    info = until(lambda: (text := figure.find_element("css selector", ".probe").text).startswith("At") and text, "told")
    assert "10.00) mm: displacement (0.00, 0.00, 1.00) µm; von Mises stress 50.00 MPa or more (4 µs)" in info
    put(browser, figure.find_element("css selector", "[data-of=colour]"), "0")
    changed(canvas, after, "coloured by displacement", share=0.0)
    assert "displacement [µm]" in figure.text
    assert browser.get_log("browser") == []


def _share_of_sand(canvas: Any) -> float:
    """Return the share of a canvas in the colour of the inside, in light and shade."""
    red, green, blue = np.moveaxis(np.asarray(Image.open(io.BytesIO(canvas.screenshot_as_png)), dtype=float), 2, 0)[:3]
    return float(((red < 240) & (abs(red / (green + 1) - 1.2) < 0.05) & (abs(red / (blue + 1) - 1.55) < 0.1)).mean())


@pytest.mark.slow
def test_a_section_shows_the_inside(browser: Any) -> None:
    """The upper part goes across z, where a click finds nothing then; in y the half that faces the first view."""
    from selenium.webdriver import ActionChains

    figure, canvas = _body(browser, "stress_wave.h5")
    put(browser, figure.find_element("css selector", "[data-of=frame]"), "2")
    axis, cut = (figure.find_element("css selector", f"[data-of={name}]") for name in ("axis", "cut"))
    assert not cut.is_enabled()
    browser.execute_async_script("requestAnimationFrame(() => requestAnimationFrame(arguments[0]))")
    whole = shot(canvas)
    assert _share_of_sand(canvas) < 0.0005
    top = np.flatnonzero((whole[:, : whole.shape[1] // 2] < 240).any(axis=1))[0]  # left of the scale
    put(browser, axis, "2")
    half = changed(canvas, whole, "a section across z")
    assert "z = 5.000 mm" in figure.text
    assert np.flatnonzero((half[:, : half.shape[1] // 2] < 240).any(axis=1))[0] > top + 50
    assert _share_of_sand(canvas) > 0.003
    ActionChains(browser).move_to_element_with_offset(
        canvas, 0, round(float(top) + 30 - whole.shape[0] / 2)
    ).click().perform()
    until(lambda: figure.find_element("css selector", ".probe").text == "Nothing there.", "no body where it is cut off")
    put(browser, cut, "300")
    lower = changed(canvas, half, "a section elsewhere")
    assert "z = 3.000 mm" in figure.text
    put(browser, axis, "1")
    changed(canvas, lower, "a section across y")
    assert _share_of_sand(canvas) > 0.01
    put(browser, axis, "")
    until(lambda: (np.abs(shot(canvas) - whole) > 12).mean() < 0.001, "as it was before it was cut")
    assert browser.get_log("browser") == []


@pytest.mark.slow
def test_a_browser_that_draws_no_bodies_shows_pictures_of_them(folder: Path, chromium: Any, tmp_path: Path) -> None:
    still = tmp_path / "run"
    shutil.copytree(folder, still)
    Image.new("RGB", (40, 30), "teal").save(still / "landing.gif")
    save_moving(block_wave(), still / "landing.h5")
    assert run_command(["report", str(still), "--quiet"]) == DONE
    lame = {"source": "HTMLCanvasElement.prototype.getContext = () => null"}
    script = chromium.execute_cdp_cmd("Page.addScriptToEvaluateOnNewDocument", lame)
    try:
        chromium.get((still / "report.html").as_uri())
        for body in chromium.find_elements("css selector", "figure.body"):
            assert "does not draw it" in body.find_element("css selector", ".probe").text
            assert not body.find_element("css selector", ".stage").is_displayed()  # no blank canvas
        assert chromium.find_element("css selector", "figure.still img").is_displayed()
    finally:
        chromium.execute_cdp_cmd("Page.removeScriptToEvaluateOnNewDocument", script)
    chromium.get((still / "report.html").as_uri())
    until(lambda: chromium.find_elements("css selector", "figure.body[data-ready]"), "drawn")
    assert not chromium.find_element("css selector", "figure.still img").is_displayed()


@pytest.mark.parametrize(
    "change",
    ["title=it's $(touch made)", 'title="$(touch made)"', "title=`touch made`; touch made", "a b\nc", "$HOME!!", "--x"],
)
def test_the_command_that_does_it_again_is_safe_in_a_shell(tmp_path: Path, change: str) -> None:
    """A shell reads the command as these very words and runs nothing else."""
    (tmp_path / "scene.toml").write_text(f"# --set {change!r}\n[seat]\n", encoding="utf-8")
    page = html.unescape(provenance(tmp_path, {}))
    command = page[page.index("seatfem run scene.toml") : page.index("</td>", page.index("seatfem run scene.toml"))]
    shell = subprocess.run(
        ["sh", "-c", f"printf '%s\\0' {command}"], cwd=tmp_path, capture_output=True, text=True, check=True
    )
    assert shell.stdout.split("\0")[:-1] == ["seatfem", "run", "scene.toml", "--set", change]
    assert not (tmp_path / "made").exists()


@pytest.mark.parametrize("line", ["x; touch made", "'a' + 'b'", "'a", "1", "[" * 2000, "'\\x'"])
def test_a_copy_whose_changes_are_no_texts(tmp_path: Path, line: str) -> None:
    (tmp_path / "scene.toml").write_text(f"# --set {line}\n[seat]\n", encoding="utf-8")
    with pytest.raises(AskedError, match=r"change.*quotes"):
        provenance(tmp_path, {})
