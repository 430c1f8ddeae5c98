"""
A touch in real time
====================

A reduced touch is made from five presses, and then answers sample by sample.
"""

import matplotlib.pyplot as plt
import numpy as np

import fingerpad as fp

model = fp.reduce(object=fp.Sphere(radius_mm=3.5), range={"depth_mm": 0.6}, calibration=0)
stream = fp.ReducedTouch(model, [(17.37, 0.0)])
times_ms = np.arange(1.0, 300.0)
depths_mm = 0.35 + 0.2 * np.sin(2.0 * np.pi * times_ms / 100.0)
forces_mn = [stream.step(t, depth_mm=d).force_mn for t, d in zip(times_ms, depths_mm, strict=True)]

figure, axes = plt.subplots(figsize=(6, 3.5), layout="constrained")
axes.plot(times_ms, forces_mn, "k-")
axes.set(xlabel="time [ms]", ylabel="force [mN]")
plt.show()
