"""
Press, release, press again
===========================

The second press meets skin that has not yet recovered.
"""

import matplotlib.pyplot as plt

import fingerpad as fp

motion = fp.Trajectory((0, 50, 150, 200, 300, 350, 450), depth_mm=(0, 0.7, 0.7, -0.2, -0.2, 0.7, 0.7))
skin = fp.indent(fp.Fingertip(), fp.Sphere(radius_mm=3.5), motion)

figure, axes = plt.subplots(figsize=(7, 3.5), layout="constrained")
axes.plot(skin.times_ms, skin.force_mn, "k-")
axes.set(xlabel="time [ms]", ylabel="force [mN]")
plt.show()
