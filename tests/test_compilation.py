"""First run that compiles: shown once, only if kernels are compiled, and suited to the terminal."""

import os
import subprocess
import sys
import textwrap

import pytest

import fingerpad as fp
from fingerpad.core.compilation import NOTICE, SHORT_NOTICE, SUBJECT
from fingerpad.mechanics.kernels import KERNELS

KERNEL = """
from numba import njit

@njit(cache=True)
def twice(x):
    return 2 * x

@njit(cache=True)
def thrice(x):
    return 3 * x
"""


@pytest.fixture
def say(tmp_path):
    """Run code in a new interpreter whose kernels are stored in a folder that is empty at first."""
    (tmp_path / "kernels.py").write_text(KERNEL)
    paths = os.pathsep.join([str(tmp_path), *sys.path])
    places = {"NUMBA_CACHE_DIR": str(tmp_path / "cache"), "PYTHONPATH": paths}

    def run(code, **variables):
        command = [sys.executable, "-W", "error", "-c", textwrap.dedent(code)]
        done = subprocess.run(command, capture_output=True, text=True, env=os.environ | places | variables)
        assert done.returncode == 0, done.stderr
        return done.stdout.split(), done.stderr

    return run


LOOK = """
    from kernels import twice
    from fingerpad.core.numba_internals import is_compiled
    print(is_compiled(twice), twice(1), is_compiled(twice))
"""


def test_a_kernel_is_compiled_once_per_source_and_announced_by_the_parent_only(say, tmp_path):
    announce = """
        import logging, os
        from fingerpad.core import engine
        from fingerpad.core.compilation import announce_compilation
        from kernels import twice
        {first}
        with announce_compilation([twice]):
            pass
    """
    for silent in ("engine._begin(os.getppid())", "logging.getLogger('fingerpad').setLevel('ERROR')"):
        assert say(announce.format(first=silent)) == ([], "")
    assert say(LOOK, NUMBA_DISABLE_JIT="1") == (["True", "2", "True"], "")
    assert say(LOOK) == (["False", "2", "True"], "")
    assert say(LOOK) == (["True", "2", "True"], "")
    (tmp_path / "kernels.py").write_text(KERNEL.replace("2 * x", "2 * x + 0"))
    assert say(LOOK)[0] == ["False", "2", "True"]


PRESS = """
    import fingerpad as fp
    from fingerpad.skin import indentation

    class Pressed(Exception):
        pass

    def no_press(*_):
        raise Pressed

    indentation.press = no_press
    touch = fp.touch_of(fp.Fingertip(), fp.Sphere())
    for _ in range(2):
        try:
            touch.solve()
        except Pressed:
            print("pressed")
"""


def test_a_first_press_reports_compilation_once(say):
    assert say(PRESS) == (["pressed", "pressed"], f"{NOTICE}\n")


def test_messages_count_the_kernels_that_are_done(say):
    code = """
        import time
        from fingerpad.core import compilation
        from kernels import thrice, twice

        compilation.INTERVAL_S = 0.05
        for _ in range(2):  # only the first block logs
            with compilation.announce_compilation([twice, thrice]):
                time.sleep(0.2)
                thrice(1)
                time.sleep(0.2)
                twice(1)
                time.sleep(0.2)
    """
    _, said = say(code)
    assert said.splitlines()[0] == NOTICE
    counts = [line.removeprefix(f"{SUBJECT}: ").split(" after")[0] for line in said.splitlines()[1:]]
    assert counts == ["0 of 2 done", "1 of 2 done", "2 of 2 done"]


RESPOND = """
    import numpy as np
    import fingerpad as fp
    from fingerpad.core.signals import Traces
    traces = Traces(np.array([0.0, 50.0, 100.0]), np.array([[0.0], [40.0], [40.0]]), np.array([50.0]))
    for _ in range(2):
        print(len(fp.Afferent.for_tissues("paper").spikes(traces)[0]) > 0)
"""


def test_a_first_response_reports_compilation_once_and_none_that_is_stored(say):
    """It took seconds without a line."""
    assert say(RESPOND) == (["True", "True"], SHORT_NOTICE + "\n")
    assert say(RESPOND) == (["True", "True"], "")


def test_a_press_calls_every_kernel_that_is_counted():
    fp.touch_of(fp.Fingertip(), fp.Sphere(), settings=fp.PressSettings(1, 1)).solve()
    assert [kernel for kernel in KERNELS if not kernel.signatures] == []


def test_what_another_process_compiles_ahead_is_what_a_press_and_a_response_call():
    """Kernels called with other types would be compiled a second time."""
    code = """
        from dataclasses import replace
        import fingerpad as fp
        from fingerpad.mechanics import balance, fields, viscoelastic
        from fingerpad.experiments import compile_ahead
        from fingerpad.neuron import exact_spikes, transduction
        from fingerpad.skin import receptor_sheet
        ahead = (
            balance._relaxed_work, fields._mean_fields, fields._isochoric_work, viscoelastic._relax,
            viscoelastic._states, viscoelastic._stored_energy, receptor_sheet.values_and_slopes_at,
            receptor_sheet.values_at, transduction._interpolate, exact_spikes.continued_trains,
        )
        compile_ahead.main()
        before = [list(kernel.signatures) for kernel in ahead]
        touch = fp.touch_of(fp.Fingertip(), fp.Sphere(), settings=fp.PressSettings(1, 1))
        skin = replace(touch, grading=compile_ahead.COARSE).solve()
        fp.Population.grid(density_per_cm2=100).respond(skin)
        print(all(before), before == [list(kernel.signatures) for kernel in ahead])
    """
    command = [sys.executable, "-c", textwrap.dedent(code)]
    assert subprocess.run(command, capture_output=True, text=True).stdout.split() == ["True", "True"]
