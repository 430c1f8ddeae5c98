"""The laboratory in a browser: from a slider to its picture, weight of the pages, and memory in long use."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from shutil import which
from tempfile import gettempdir
from time import monotonic
from typing import Any

import numpy as np
import psutil

from benchmarks.results import Report, Table
from fingerpad.lab.laboratory import Laboratory, shipped
from fingerpad.lab.static import write_static

FOLDER = Path(gettempdir()) / "fingerpad-laboratory"
"""Where the reduced touches of the shipped objects are kept from one run to the next."""

CHANGES, MINUTES = 200, 10.0

MOVE = """([name, value]) => new Promise(done => {
  const began = performance.now(), slider = window.slider(name);
  window.drawn(() => done(performance.now() - began));
  slider.value = value;
  slider.dispatchEvent(new Event("input"));
})"""
"""Moves a slider and gives the time until the page has drawn the answer. [ms]"""

FIND = """() => {
  const all = root => [root, ...[...root.querySelectorAll("*")].flatMap(each =>
    each.shadowRoot ? all(each.shadowRoot) : [])];
  const within = all(document).find(root => root.querySelector(".lab"));
  window.slider = name => within.querySelector(`input[name=${name}]`);
  const words = within.querySelector(".lab div[role=status]");
  window.drawn = done => {
    const watch = new MutationObserver(() => { watch.disconnect(); done(); });
    watch.observe(words, { childList: true });
  };
}"""
"""Finds the controls and the words below the pictures, which are written last."""


def measure() -> Report:
    """Serve the shipped objects, use the page, and write the static one."""
    from playwright.sync_api import sync_playwright

    FOLDER.mkdir(exist_ok=True)
    ranges = [FOLDER / path.name for path in shipped()]
    for path, known in zip(ranges, shipped(), strict=True):
        path.write_text(f"{known.read_text('utf-8')}calibration: 0\n", encoding="utf-8")
    static = write_static(Laboratory(FOLDER, ranges), FOLDER / "static")
    command = [sys.executable, "-m", "fingerpad", "lab", *map(str, ranges), "--folder", str(FOLDER)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as served, sync_playwright() as play:
        assert served.stdout is not None
        address = served.stdout.readline().split()[1]
        browser = play.chromium.launch(
            executable_path=which("chromium"), args=["--no-sandbox", "--enable-precise-memory-info"]
        )
        page = browser.new_page()
        weights: list[int] = []
        page.on("response", lambda got: weights.append(int(got.headers.get("content-length", 0))))
        page.goto(address)
        page.locator(".lab div[role=status] p").first.wait_for(timeout=600_000)
        page.evaluate(FIND)
        depths = np.random.default_rng(1).uniform(0.1, 1.0, CHANGES).round(2)
        times = [page.evaluate(MOVE, ["depth_mm", float(depth)]) for depth in depths]
        weight = sum(weights)
        used = _use(page, browser, address, psutil.Process(served.pid))
        browser.close()
        served.terminate()
    p50, p99 = np.percentile(times, [50, 99])
    growth = used[-1][1] - used[1][1]
    return Report(
        name="laboratory",
        title="The laboratory in a browser",
        about=(
            "The shipped objects at `quick` without errors, Chromium without a screen. "
            f"{CHANGES} random depths of a ball, "
            f"from the event of the slider to the drawn picture; then {MINUTES:g} minutes of a change every "
            "0.2 s, and a second page that is opened and closed every minute."
        ),
        tables=[
            Table(
                "What it takes:",
                ["what", "measured"],
                [
                    ["slider to picture, median, ms", f"{p50:.0f}"],
                    ["slider to picture, 99 %, ms", f"{p99:.0f}"],
                    ["scripts and styles that the page loads, MB", f"{weight / 1e6:.1f}"],
                    ["static page, MB", f"{static.stat().st_size / 1e6:.1f}"],
                ],
            ),
            Table(
                "Memory in use:",
                ["after, min", "server, MB", "heap of the page, MB", "changes"],
                [[f"{minute:.0f}", f"{server:.0f}", f"{heap:.0f}", n] for minute, server, heap, n in used],
            ),
        ],
        measured={
            "laboratory_ms": float(p99),
            "laboratory_static_mb": static.stat().st_size / 1e6,
            "laboratory_growth_mb": float(growth),
        },
    )


def _use(page: Any, browser: Any, address: str, server: psutil.Process) -> list[tuple[float, ...]]:
    """Use the page, and tell once a minute of the memory of server and page. [min, MB, MB, changes]"""
    random, began, changes = np.random.default_rng(2), monotonic(), 0
    found: list[tuple[float, ...]] = []
    while (minute := (monotonic() - began) / 60.0) <= MINUTES:
        if minute >= len(found):
            other = browser.new_page()
            other.goto(address)
            other.locator(".lab div[role=status] p").first.wait_for(timeout=60_000)
            other.close()
            page.request_gc()
            heap = page.evaluate("performance.memory.usedJSHeapSize") / 1e6
            found.append((minute, server.memory_info().rss / 1e6, heap, changes))
        page.evaluate(MOVE, ["depth_mm", float(random.uniform(0.1, 1.0))])
        page.wait_for_timeout(200)
        changes += 1
    return found
