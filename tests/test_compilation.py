"""What a first run says before it compiles: only if it will, once, and in the terminal's own way."""

import os
import subprocess
import sys
import textwrap

import pytest

from fingerpad.core.compilation import NOTICE, announce_compilation

KERNEL = """
from numba import njit

@njit(cache=True)
def twice(x):
    return 2 * x
"""


@pytest.fixture
def say(tmp_path):
    """Run code in a new interpreter whose kernels are stored in a folder that is empty at first."""
    (tmp_path / "kernels.py").write_text(KERNEL)
    places = {
        "NUMBA_CACHE_DIR": str(tmp_path / "cache"),
        "PYTHONPATH": os.pathsep.join([str(tmp_path), *sys.path]),
    }

    def run(code, **variables):
        done = subprocess.run(
            [sys.executable, "-W", "error", "-c", textwrap.dedent(code)],
            capture_output=True,
            text=True,
            check=False,
            env=os.environ | places | variables,
        )
        assert done.returncode == 0, done.stderr
        return done.stdout.split(), done.stderr

    return run


LOOK = """
    from kernels import twice
    from fingerpad.core.numba_internals import is_compiled
    print(is_compiled(twice), twice(1), is_compiled(twice))
"""


def test_a_kernel_is_compiled_once_per_source(say, tmp_path):
    assert say(LOOK) == (["False", "2", "True"], "")
    assert say(LOOK) == (["True", "2", "True"], "")
    (tmp_path / "kernels.py").write_text(KERNEL.replace("2 * x", "2 * x + 0"))
    assert say(LOOK)[0] == ["False", "2", "True"]


def test_where_nothing_is_compiled_nothing_is_said(say):
    assert say(LOOK, NUMBA_DISABLE_JIT="1") == (["True", "2", "True"], "")


PRESS = """
    import fingerpad as fp
    from fingerpad.skin import indentation

    class Pressed(Exception):
        pass

    def no_press(*_):
        raise Pressed

    indentation.press = no_press
    touch = fp.touch_of(fp.Fingertip(), fp.Sphere())
    {set_up}
    for _ in range(2):
        try:
            touch.solve()
        except Pressed:
            print("pressed")
"""


@pytest.mark.parametrize(
    ("set_up", "said"),
    [
        ("", NOTICE + "\n"),
        ("import logging; logging.getLogger('fingerpad').setLevel('ERROR')", ""),
    ],
    ids=["as it comes", "silenced"],
)
def test_a_first_press_says_so_once(say, set_up, said):
    assert say(PRESS.format(set_up=set_up)) == (["pressed", "pressed"], said)


def test_a_compiled_kernel_is_not_announced(caplog):
    class Compiled:
        signatures = ((),)

    announce_compilation(Compiled())
    assert caplog.text == ""


def test_workers_leave_it_to_their_parent(say):
    code = """
        import logging, os
        from fingerpad.skin import store
        from fingerpad.core.compilation import announce_compilation
        from kernels import twice
        store._begin(os.getppid())
        announce_compilation(twice)
    """
    assert say(code) == ([], "")
