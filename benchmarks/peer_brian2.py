"""The afferents by Brian2: exact integration between steps of a clock, compiled; without fingerpad.

Brian2 holds the current constant within a step, here at its value in the middle, and notes a spike at the
start of the step in which the threshold is passed; it is taken to be at the step's end, which is closer.
"""

from __future__ import annotations

import tempfile
from time import perf_counter
from typing import Any

import numpy as np


def fire(currents: str, found: str, step_ms: float, mode: str, cores: int) -> dict[str, Any]:
    """Fire afferents and keep their spikes.

    Parameters
    ----------
    currents, found : str
        Common file of membrane and currents, and where spikes go.
    step_ms : float
        Step of the clock. [ms]
    mode : {"cython", "standalone"}
        Compiled step by step for Python, or as one C++ program with OpenMP, Brian2's fastest.
    cores : int
        Threads of the C++ program.

    Returns
    -------
    dict
        Seconds of the run without building and compiling, and the number of spikes.
    """
    import brian2  # here, since only this environment has it

    with np.load(currents) as stored:
        tau_ms, capacitance_mf, threshold_mv, refractory_ms = stored["membrane"].tolist()
        knots_ms, course, strength_ma = stored["knots_ms"], stored["course"], stored["strength_ma"]
    steps = round(knots_ms[-1] / step_ms)
    if mode == "standalone":
        brian2.set_device("cpp_standalone", build_on_run=False)
        brian2.prefs.devices.cpp_standalone.openmp_threads = cores
    else:
        brian2.prefs.codegen.target = "cython"
    brian2.defaultclock.dt = step_ms * brian2.ms
    middles_ms = (np.arange(steps) + 0.5) * step_ms
    shape = brian2.TimedArray(np.interp(middles_ms, knots_ms, course), dt=step_ms * brian2.ms)
    # Charging in mV/ms: 1 mA/mF = 1 mV/ms.
    group = brian2.NeuronGroup(
        strength_ma.size,
        "du/dt = (-u + tau*charging*shape(t)/ms)/tau : 1 (unless refractory)\ncharging : 1 (constant)",
        threshold="u >= threshold", reset="u = 0", refractory=refractory_ms * brian2.ms, method="exact",
        namespace={"tau": tau_ms * brian2.ms, "threshold": threshold_mv, "shape": shape},
    )  # fmt: skip
    group.charging = strength_ma / capacitance_mf
    monitor = brian2.SpikeMonitor(group)
    network = brian2.Network(group, monitor)
    length = steps * step_ms * brian2.ms
    with tempfile.TemporaryDirectory() as folder:
        if mode == "standalone":
            network.run(length)
            brian2.device.build(directory=folder, compile=True, run=False)
            started = perf_counter()
            brian2.device.run(directory=folder, with_output=False, run_args=[])
        else:
            network.run(step_ms * brian2.ms)  # compiles
            started = perf_counter()
            network.run(length - step_ms * brian2.ms)
        solve_s = perf_counter() - started
        neurons = np.asarray(monitor.i, dtype=np.int64)
        times_ms = np.asarray(monitor.t / brian2.ms)
    order = np.lexsort((times_ms, neurons))
    offsets = np.concatenate([[0], np.cumsum(np.bincount(neurons, minlength=strength_ma.size))])
    np.savez(found, times_ms=times_ms[order] + step_ms, offsets=offsets)
    return {
        "solve_s": solve_s,
        "spikes": int(times_ms.size),
        "version": f"Brian2 {brian2.__version__}, NumPy {np.__version__}",
    }
