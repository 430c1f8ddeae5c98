"""
A psychometric curve
====================

Hit rates of an observer who tells balls from one of 287 /m, with a Weibull function through them.
"""

import matplotlib.pyplot as plt
import numpy as np

import fingerpad as fp

curvatures = np.array([287.0, 300.0, 320.0, 360.0])
motion = fp.RampAndHold(depth_mm=0.8, hold_ms=200)
population = fp.Population.grid()
rates = [
    population.respond(
        fp.indent(fp.Fingertip(), fp.Sphere(curvature_per_m=curvature), motion)
    ).dynamic_rate_hz
    for curvature in curvatures
]
pairs = fp.psychophysics.neighbour_pairs(population.positions_mm, population.pitch_mm)
observer = fp.psychophysics.GradientSum(pairs)
hits = fp.psychophysics.discriminate_by(observer, rates, 0.1, seed=1).hit_rate
differences, trials = curvatures[1:] - curvatures[0], np.full(3, 100)
fit = fp.psychophysics.fit_psychometric(differences, np.round(hits * trials), trials)

figure, axes = plt.subplots(figsize=(5, 3.5), layout="constrained")
at = np.linspace(1.0, 90.0, 90)
axes.plot(at, fit.predict(at), "k-")
axes.plot(differences, hits, "ko")
axes.set(xlabel="difference from 287 /m [1/m]", ylabel="hit rate", ylim=(0.45, 1.02))
plt.show()
