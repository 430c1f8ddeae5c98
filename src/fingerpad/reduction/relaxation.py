"""How a response to a pose relaxes: one first-order filter per time constant of the tissues.

Each branch i of the tissues' Prony series has relaxed a stress S_i away (`fingerpad.mechanics.viscoelastic`)
that follows tau_i dS_i/dt = g_i S0 - S_i. While the deformation follows the pose p alone, any quantity that
is linear in the stress therefore is

    y(t) = Y(p(t)) - sum_i m_i(t),    tau_i dm_i/dt = D_i(p(t)) - m_i,

with Y the response at once and D_i what branch i relaxes in a long hold of the pose. Tissue that relaxes also
deforms a little differently; how much this matters is measured (docs/decisions/reduced-touch.md). As in the
full solver, D_i is linear within a step, and then the steps are exact.
"""

from __future__ import annotations

import numpy as np

from fingerpad.core.checks import FloatArray


def filter_step(step_ms: float, times_ms: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Factors a, b and gamma of m = a D + b D_before + gamma m_before, (n_branches,) each.

    Examples
    --------
    >>> a, b, gamma = filter_step(100.0, np.array([100.0]))
    >>> print(f"{a[0]:.4f} {b[0]:.4f} {gamma[0]:.4f}")
    0.3679 0.2642 0.3679
    """
    if step_ms == 0.0:
        return np.zeros(times_ms.size), np.zeros(times_ms.size), np.ones(times_ms.size)
    gamma = np.exp(-step_ms / times_ms)
    average = times_ms / step_ms * (1.0 - gamma)
    return 1.0 - average, average - gamma, gamma


def filtered(times_ms: FloatArray, values: FloatArray, constant_ms: float) -> FloatArray:
    """Filter values over time that start from rest.

    Parameters
    ----------
    times_ms : array (n_times,)
        Increasing. [ms]
    values : array (n_times, n)
        D, linear between the times.
    constant_ms : float
        Time constant. [ms]

    Returns
    -------
    array (n_times, n)
        m.
    """
    found = np.zeros_like(values)
    for now in range(1, times_ms.size):
        a, b, gamma = filter_step(times_ms[now] - times_ms[now - 1], np.array([constant_ms]))
        found[now] = a * values[now] + b * values[now - 1] + gamma * found[now - 1]
    return found
