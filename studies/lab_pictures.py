"""Pictures of docs/reduced.md#a-laboratory-in-the-browser: the laboratory in a real browser.

`python -m studies.lab_pictures FOLDER [RANGE]...` is `fingerpad lab [RANGE]... --folder FOLDER` (minutes if
the folder is empty): it opens the page in Chromium, and writes docs/images/lab.png.
"""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

PICTURE = Path(__file__).parents[1] / "docs" / "images" / "lab.png"
STATE = "#other=ball&other_size=180&depth_mm=1&slide_mm=1&time=400"


def draw(folder: str, *ranges: str) -> None:
    """Serve, open, solve exactly, and take the picture."""
    from playwright.sync_api import sync_playwright

    command = [sys.executable, "-m", "fingerpad", "lab", *ranges, "--folder", folder]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as served, sync_playwright() as play:
        assert served.stdout is not None
        address = served.stdout.readline().split()[1]
        browser = play.chromium.launch(executable_path=shutil.which("chromium"), args=["--no-sandbox"])
        page = browser.new_page(viewport={"width": 1300, "height": 1000})
        page.goto(address + STATE)
        page.get_by_text("An ideal observer").wait_for(timeout=1_200_000)
        page.get_by_role("button", name="Solve exactly").click()
        page.get_by_text("Largest differences").wait_for(timeout=600_000)
        page.screenshot(path=PICTURE, full_page=True)
        browser.close()
        served.terminate()


if __name__ == "__main__":
    draw(*sys.argv[1:])
