"""The picture of docs/live.md: a live page in a headless Chromium, with a slider moved.

    .venv/bin/python docs/live_picture.py [WIDTH FILE]

Serves examples/flapper_on_peek_sleeve.toml, and writes docs/images/live.png, 1300 pixels wide (or FILE, WIDTH wide).
"""

from __future__ import annotations

import sys
import tempfile
import threading
import time
from pathlib import Path

from page_pictures import FLAGS, keep, set_to
from selenium import webdriver
from selenium.webdriver.support.wait import WebDriverWait

from seatfem.faces.live.server import LiveServer

SCENE = Path(__file__).resolve().parent.parent / "examples" / "flapper_on_peek_sleeve.toml"
PATIENCE = 600  # of a full run [s]


def main() -> None:
    width, name = (int(sys.argv[1]), sys.argv[2]) if len(sys.argv) > 2 else (1300, "live.png")
    options = webdriver.ChromeOptions()
    for flag in FLAGS:
        options.add_argument(f"--{flag}")
    browser = webdriver.Chrome(options=options, service=webdriver.ChromeService("/usr/bin/chromedriver"))
    with tempfile.TemporaryDirectory() as folder:
        server = LiveServer(SCENE, {}, Path(folder) / "log.txt")
        threading.Thread(target=server.run, daemon=True).start()
        try:
            size = {"width": width, "height": 1010, "deviceScaleFactor": 1, "mobile": width < 500}
            browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
            browser.get(server.address)

            def wait_for(words: str) -> None:
                waiting = WebDriverWait(browser, PATIENCE)
                waiting.until(lambda page: page.find_element("css selector", "#state").text.startswith(words))

            wait_for("computed in full")
            set_to(browser, browser.find_element("css selector", "[name='reed.thickness']"), "-45")
            wait_for("answered by")
            time.sleep(1.0)  # of the last drawing
            keep(browser.get_screenshot_as_png(), name)
        finally:
            browser.quit()
            server.server_close()


if __name__ == "__main__":
    main()
