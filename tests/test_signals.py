"""Ctrl-C and SIGTERM end a command and its workers at once, with one sentence."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import psutil
import pytest

from fingerpad.cli import Terminated, signals_raise

LIMIT_S = 60.0
AT_ONCE_S = 1.0


def begin(folder: Path, jobs: int) -> subprocess.Popen[str]:
    """Start a run with many presses in a process group of its own."""
    return subprocess.Popen(
        [sys.executable, "-m", "fingerpad", "reproduce", "--resolution", "quick", "--jobs", str(jobs)],
        cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True,
    )  # fmt: skip


def descendants(program: subprocess.Popen[str]) -> list[psutil.Process]:
    return psutil.Process(program.pid).children(recursive=True)


@pytest.mark.parametrize(
    ("sent", "status", "after_s", "jobs"),
    [(signal.SIGINT, 130, 2.0, 1), (signal.SIGINT, 130, 6.0, 2), (signal.SIGTERM, 143, 6.0, 2)],
    ids=["while it starts", "Ctrl-C in presses", "SIGTERM in presses"],
)
def test_a_signal_ends_everything_at_once_with_a_sentence(
    tmp_path: Path, sent: signal.Signals, status: int, after_s: float, jobs: int
) -> None:
    program = begin(tmp_path, jobs)
    try:
        time.sleep(after_s)
        workers = descendants(program)
        if sent == signal.SIGINT:
            os.killpg(program.pid, sent)  # as a terminal does
        else:
            program.send_signal(sent)
        began = time.monotonic()
        _, said = program.communicate(timeout=LIMIT_S)
        assert program.returncode == status
        assert time.monotonic() - began < 5 * AT_ONCE_S  # other tests use the same cores
        assert "Traceback" not in said
        assert any(line.startswith("fingerpad: stopped.") for line in said.splitlines())
        _, alive = psutil.wait_procs(workers, timeout=5 * AT_ONCE_S)
        assert alive == []
    finally:
        program.kill()
        program.communicate()


@pytest.mark.parametrize("sent", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_that_an_import_hides_still_stops(sent: signal.Signals) -> None:
    """A module in C whose import a signal breaks off ended a command with a traceback and status 1."""

    def import_that_hides() -> None:
        try:
            signal.raise_signal(sent)
        except KeyboardInterrupt:
            raise ImportError("initialization failed") from None

    with pytest.raises(KeyboardInterrupt) as caught, signals_raise():
        import_that_hides()
    assert isinstance(caught.value, Terminated) == (sent == signal.SIGTERM)
    with pytest.raises(ImportError), signals_raise():
        raise ImportError("no signal came")


def test_a_worker_that_is_just_starting_ignores_ctrl_c(tmp_path: Path) -> None:
    """Else it might write Python's own traceback before its parent ends it."""
    script = (
        "import os, time\n"
        "from fingerpad.core.engine import Processes\n"
        "def work(item, threads):\n"
        "    return item\n"
        "if __name__ == '__main__':\n"
        "    print(sum(outcome() for _, outcome in Processes(2).map(work, [1, 2])))\n"
        "else:\n"
        "    os.write(1, b'starts\\n')\n"
        "    time.sleep(1)\n"
    )
    (tmp_path / "starting.py").write_text(script, encoding="utf-8")
    program = subprocess.Popen(
        [sys.executable, "starting.py"], cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
        text=True,
    )  # fmt: skip
    try:
        assert program.stdout is not None
        assert program.stdout.readline() == "starts\n"
        for worker in descendants(program):
            worker.send_signal(signal.SIGINT)
        printed, said = program.communicate(timeout=LIMIT_S)
        assert (program.returncode, said) == (0, "")
        assert printed.splitlines()[-1] == "3"
    finally:
        program.kill()
        program.communicate()


def test_a_second_signal_ends_the_process_whatever_it_does(tmp_path: Path) -> None:
    script = (
        "import time\n"
        "from fingerpad.cli import signals_raise\n"
        "with signals_raise():\n"
        "    try:\n"
        "        print('ready', flush=True)\n"
        "        time.sleep(60)\n"
        "    finally:\n"
        "        time.sleep(60)\n"
    )
    program = subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE, text=True)
    try:
        assert program.stdout is not None
        assert program.stdout.readline() == "ready\n"
        program.send_signal(signal.SIGINT)
        time.sleep(0.3)
        assert program.poll() is None  # it tidies up
        program.send_signal(signal.SIGINT)
        assert program.wait(timeout=LIMIT_S) == -signal.SIGINT
    finally:
        program.kill()
        program.communicate()


@pytest.mark.parametrize("where", ["before the command", "in the command"])
def test_an_interrupt_within_exec_ends_with_the_status_of_an_interrupt(tmp_path: Path, where: str) -> None:
    """As Ctrl-C does while a dataclass is made: CPython would end `python -m` by the signal."""
    script = (
        "from fingerpad import cli\n"
        "def interrupted(*_):\n"
        "    exec('raise KeyboardInterrupt')\n"
        f"cli.{'_run' if where.startswith('before') else 'parser_of'} = interrupted\n"
        "cli.main(['store', 'list', '.'])\n"
    )
    (tmp_path / "interrupted.py").write_text(script, encoding="utf-8")
    command = [sys.executable, "-m", "interrupted"]
    ended = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=LIMIT_S)
    assert ended.returncode == 130
    said = "fingerpad: stopped. The same command continues after the last finished indentation.\n"
    assert ended.stderr == said
