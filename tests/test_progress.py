"""What a command tells while it runs: lines where it is piped, nothing or more on request."""

import logging
import threading
import time

import fingerpad as fp
from cluster import wait_until
from fingerpad.cli import main
from fingerpad.cli.commands import progress
from fingerpad.core import progress as progress_module
from fingerpad.core.logger import LOGGER
from fingerpad.core.progress import Bars, Lines, NoProgress, share_done

TOUCH = "object: sphere\nmotion: {depth_mm: 0.2, hold_ms: 60}\nafferents: {windows_ms: {static: [60, 100]}}\n"


def test_lines_tell_the_way_and_the_end_of_a_long_stage_only():
    told = []
    with Lines(told.append, every_s=0.0).stage("presses", 3) as advance:
        for _ in range(3):
            advance()
    assert [line.partition(",")[0] for line in told] == [f"presses: {n} of 3" for n in (1, 2, 3)]
    with Lines(told.append, every_s=60.0, short=False).stage("short", 2) as advance:
        advance()
        advance()
    assert len(told) == 3


def test_a_long_part_is_told_of_before_it_ends(monkeypatch):
    monkeypatch.setattr(progress_module, "SHORTEST_WAIT_S", 0.02)
    told = []
    with Lines(told.append, every_s=0.02).stage("presses", 2) as advance:
        wait_until(lambda: told)
        assert told[0] == "presses: 0 of 2 after 0 s"
        share_done(0.5)
        wait_until(lambda: "50 % of number 1 of 2" in told[-1])
        advance()
        wait_until(lambda: told[-1].startswith("presses: 1 of 2, "))
    said = len(told)
    share_done(0.9)  # after the stage nobody listens
    time.sleep(0.1)
    assert len(told) == said
    assert not [thread for thread in threading.enumerate() if thread.name == "progress"]


def test_a_press_tells_how_far_it_is(monkeypatch, caplog):
    told = []
    caplog.set_level(logging.DEBUG, "fingerpad.mechanics.press")
    motion = fp.RampAndHold(depth_mm=0.2, hold_ms=60)
    skin = fp.indent(fp.Fingertip(), fp.Sphere(), motion, progress=Lines(told.append, every_s=0.0))
    shares = [int(line.removeprefix("press: ").partition(" %")[0]) for line in told if "%" in line]
    assert shares == sorted(shares)
    assert shares[-1] == 100
    assert told[-1] == "press: 1 of 1, 0 s left"
    assert len(caplog.messages) == skin.times_ms.size - 1
    assert caplog.messages[-1].startswith("110 of 110 ms: depth 0.2 mm, ")


def test_progress_is_lines_where_it_is_piped_bars_on_a_terminal_and_nothing_when_quiet(monkeypatch):
    assert isinstance(progress(), Lines)
    monkeypatch.setenv("FORCE_COLOR", "1")
    assert isinstance(progress(), Bars)
    LOGGER.setLevel(logging.ERROR)
    assert isinstance(progress(), NoProgress)


def test_quiet_says_nothing_but_results_and_verbose_tells_of_stages(run_program, tmp_path, caplog):
    (tmp_path / "touch.yaml").write_text(TOUCH)
    status, out, errors = run_program(main, "fingerpad", "touch", "touch.yaml", "--out", "quiet", "--quiet")
    assert (status, errors, caplog.text) == (0, "", "")
    assert out
    status, _, _ = run_program(main, "fingerpad", "--verbose", "touch", "touch.yaml", "--out", "verbose")
    told = [(record.name, record.getMessage()) for record in caplog.records]
    assert status == 0
    assert any(name == "fingerpad.experiments.runner" and " took " in text for name, text in told)
    assert any(name == "fingerpad.skin.store" and text.startswith("stored ") for name, text in told)
    status, _, errors = run_program(main, "fingerpad", "--quiet", "--verbose", "store", "list")
    assert (status, errors) == (2, "fingerpad: --quiet and --verbose exclude each other: leave one out.\n")
