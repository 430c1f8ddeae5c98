"""The number of threads: who sets it, who gets it back, and what happens where several callers want them."""

import os
import subprocess
import sys
import threading

import numba
import numpy as np
import pytest

import fingerpad as fp
from fingerpad.errors import InputError
from fingerpad.threads import available_threads, compiled_threads, worker_threads

needs_two_threads = pytest.mark.skipif(available_threads() < 2, reason="this machine has one core")

LOOPS = """
import os, threading
import numpy as np
from numba import njit, prange
from fingerpad.errors import FingerpadError
from fingerpad.threads import compiled_threads

@njit(parallel=True)
def halve(numbers):
    for n in prange(numbers.size):
        numbers[n] /= 2.0

def several():
    for _ in range(1000):
        with compiled_threads():
            halve(np.ones(10000))
"""
"""What the processes below begin with: one of Numba's own parallel loops, a thousand times over."""

SIDE_BY_SIDE = """
together = [threading.Thread(target=several) for _ in range(2)]
for one in together:
    one.start()
for one in together:
    one.join()
print("both done")
"""

FORKED = """
several()
child = os.fork()
if child == 0:
    try:
        several()
        print("done", flush=True)
    except FingerpadError as error:
        print(error, flush=True)
    os._exit(0)
print("ended with", os.waitpid(child, 0)[1])
"""


def said(code, layer):
    """What a process that runs `code` prints."""
    environment = os.environ | {"NUMBA_THREADING_LAYER": layer}
    done = subprocess.run(
        [sys.executable, "-c", LOOPS + code], env=environment, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def has_openmp():
    try:
        from numba.np.ufunc import omppool  # noqa: F401
    except ImportError:
        return False
    return sys.platform == "linux"


needs_openmp = pytest.mark.skipif(not has_openmp(), reason="Numba finds no GNU OpenMP here")


def test_numba_has_its_number_back():
    before = numba.get_num_threads()
    with compiled_threads(1) as threads:
        assert threads == numba.get_num_threads() == 1
    assert numba.get_num_threads() == before
    with pytest.raises(ZeroDivisionError), compiled_threads(1):
        raise ZeroDivisionError
    assert numba.get_num_threads() == before


def test_default_is_the_number_that_the_caller_has_set():
    before = numba.get_num_threads()
    with compiled_threads() as threads:
        assert threads == before
    numba.set_num_threads(1)
    try:
        with compiled_threads() as threads:
            assert threads == 1
    finally:
        numba.set_num_threads(before)


@pytest.mark.parametrize("threads", [0, -1, 1.5, True, 10_000])
def test_number_of_threads_is_checked(threads):
    touch = fp.touch_of(fp.Fingertip(), fp.Sphere(curvature_per_m=287))
    for action in (touch.solve, touch.deform):
        with pytest.raises(InputError, match="threads must"):
            action(threads=threads)


@needs_two_threads
def test_work_is_shared_out_and_answers_come_in_order():
    """Each of the first two chunks waits for the other, so one thread alone would never be done."""
    meeting = threading.Barrier(2, timeout=20.0)

    def work(first, last):
        if first < 2:
            meeting.wait()
        return last, threading.get_ident()

    with compiled_threads(2), worker_threads() as each:
        answers = each(work, [(0, 5), (1, 6), (2, 7), (3, 8)])
    assert [last for last, _ in answers] == [5, 6, 7, 8]
    assert len({thread for _, thread in answers}) == 2
    with compiled_threads(1), worker_threads() as each:
        assert each(lambda *_: threading.get_ident(), [(0, 1), (1, 2)]) == 2 * [threading.get_ident()]


@needs_two_threads
def test_press_has_the_same_bits_on_any_number_of_threads():
    touch = fp.touch_of(
        fp.Fingertip(), fp.Sphere(curvature_per_m=287), fp.RampAndHold(depth_mm=0.2),
        grading=fp.Grading(17.37, 2.0, 1.0, 0.5, 0.5, stratum_corneum=1, dermis=2, subcutis=2),
        settings=fp.PressSettings(ramp_steps=1, hold_steps=1),
    )  # fmt: skip
    alone, together = (touch.deform(threads=threads) for threads in (1, 2))
    for name in ("force_mn", "displacement_mm", "sed_kpa", "reaction_mn", "stress_kpa"):
        np.testing.assert_array_equal(getattr(together, name), getattr(alone, name), err_msg=name)
    for name in ("gradient", "stress_kpa", "stored_kpa", "instantaneous_kpa", "work_kpa"):
        np.testing.assert_array_equal(
            getattr(together.fields, name), getattr(alone.fields, name), err_msg=name
        )
    for name in ("external_uj", "stored_uj", "dissipated_uj", "contact_uj"):
        np.testing.assert_array_equal(
            getattr(together.energy, name), getattr(alone.energy, name), err_msg=name
        )
    assert together.newton_steps == alone.newton_steps


@needs_two_threads
def test_python_threads_go_one_after_the_other():
    """Numba's own layer ends a process in which two run loops at once."""
    assert said(SIDE_BY_SIDE, "workqueue") == "both done\n"


@needs_two_threads
@pytest.mark.skipif(not hasattr(os, "fork"), reason="this system does not fork")
def test_forked_process_works_with_the_layer_that_can():
    assert said(FORKED, "workqueue") == "done\nended with 0\n"


@needs_two_threads
@needs_openmp
def test_forked_process_is_refused_where_openmp_would_end_it():
    heard = said(FORKED, "omp")
    assert heard.startswith("This process was forked from one that had used its threads")
    assert heard.endswith("ended with 0\n")
