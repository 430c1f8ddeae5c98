"""Number of threads: setting, restoring, and several callers at the same time."""

import os
import subprocess
import sys
import threading

import numpy as np
import pytest

import fingerpad as fp
from fingerpad.core.threads import available_threads, compiled_threads, current_threads, in_blocks, in_chunks

needs_two_threads = pytest.mark.skipif(available_threads() < 2, reason="this machine has one core")


def test_number_is_what_it_was_afterwards():
    before = current_threads()
    with compiled_threads(1) as threads:
        assert threads == current_threads() == 1
        with compiled_threads() as inner:
            assert inner == 1
    assert current_threads() == before == available_threads()
    touch = fp.touch_of(fp.Fingertip(), fp.Sphere(curvature_per_m=287))
    for wrong in (0, -1, 1.5, True, 10_000):
        with pytest.raises(fp.InputError, match="threads must"):
            touch.solve(threads=wrong)
    with pytest.raises(ZeroDivisionError), compiled_threads(1):
        raise ZeroDivisionError
    assert current_threads() == before


@needs_two_threads
def test_work_is_shared_out_and_answers_come_in_order():
    """Each of the first two chunks waits for the other, so one thread alone would never be done."""
    meeting = threading.Barrier(2, timeout=20.0)

    def work(first, last):
        if first < 2:
            meeting.wait()
        return last, threading.get_ident()

    with compiled_threads(2):
        answers = in_chunks(work, [(0, 5), (1, 6), (2, 7), (3, 8)])
    assert [last for last, _ in answers] == [5, 6, 7, 8]
    assert len({thread for _, thread in answers}) == 2
    with compiled_threads(1):
        assert in_chunks(lambda *_: threading.get_ident(), [(0, 1), (1, 2)]) == 2 * [threading.get_ident()]


@needs_two_threads
def test_press_has_the_same_bits_on_any_number_of_threads():
    touch = fp.touch_of(
        fp.Fingertip(), fp.Sphere(curvature_per_m=287), fp.RampAndHold(depth_mm=0.2),
        grading=fp.Grading(17.37, 2.0, 1.0, 0.5, 0.5, stratum_corneum=1, dermis=2, subcutis=2),
        settings=fp.PressSettings(ramp_steps=1, hold_steps=1),
    )  # fmt: skip
    alone, together = (touch.solve(threads, whole=True).deformation for threads in (1, 2))
    for part, names in (
        (lambda done: done, ("force_mn", "displacement_mm", "sed_kpa", "reaction_mn", "stress_kpa")),
        (lambda done: done.fields, ("gradient", "stress_kpa", "stored_kpa", "instantaneous_kpa", "work_kpa")),
        (lambda done: done.energy, ("external_uj", "stored_uj", "dissipated_uj", "contact_uj")),
    ):
        for name in names:
            one, two = (getattr(part(done), name) for done in (alone, together))
            np.testing.assert_array_equal(two, one, err_msg=name)
    assert together.newton_steps == alone.newton_steps


@needs_two_threads
def test_a_failure_in_any_thread_is_raised():
    with compiled_threads(2):
        with pytest.raises(ZeroDivisionError):
            in_chunks(lambda first, last: 1 // (first - 3), [(n, n + 1) for n in range(6)])
        assert in_chunks(lambda first, last: first, [(0, 1), (1, 2)]) == [0, 1]


@needs_two_threads
def test_work_within_work_neither_waits_for_ever_nor_takes_other_threads():
    """Helpers that call for help wait for no one: all helpers may be in the same place."""

    def inner(first, last):
        return current_threads(), sum(in_chunks(lambda a, b: b - a, [(0, 2), (2, 5)])), last - first

    with compiled_threads(2):
        answers = in_blocks(lambda some: in_chunks(inner, [(some.start, some.stop), (0, 1)]), 6, block=1)
    assert answers == [[(2, 5, 1), (2, 5, 1)]] * 6


@needs_two_threads
def test_python_threads_may_share_out_work_at_once():
    sums = {}

    def several(name):
        for _ in range(200):
            with compiled_threads(2):
                sums[name] = in_chunks(lambda first, last: last - first, [(0, 3), (3, 5), (5, 9)])

    together = [threading.Thread(target=several, args=(name,)) for name in "ab"]
    for one in together:
        one.start()
    for one in together:
        one.join()
    assert sums == {"a": [3, 2, 4], "b": [3, 2, 4]}


FORKED = """
import os
from fingerpad.core.threads import compiled_threads, in_chunks

def shared():
    with compiled_threads(2):
        return in_chunks(lambda first, last: last - first, [(0, 3), (3, 5), (5, 9)])

shared()
child = os.fork()
if child == 0:
    print(shared(), flush=True)
    os._exit(0)
print("ended with", os.waitpid(child, 0)[1])
"""


@needs_two_threads
@pytest.mark.skipif(not hasattr(os, "fork"), reason="this system does not fork")
def test_forked_process_has_threads_of_its_own():
    command = [sys.executable, "-W", "ignore", "-c", FORKED]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
    assert (done.stdout, done.returncode) == ("[3, 2, 4]\nended with 0\n", 0)
