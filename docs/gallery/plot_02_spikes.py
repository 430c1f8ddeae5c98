"""
From touch to spikes
====================

One picture of a touch: the pressed finger, and the spike trains of its afferents.
"""

import matplotlib.image
import matplotlib.pyplot as plt

import fingerpad as fp

ball = fp.Sphere(radius_mm=3.5)
skin = fp.indent(fp.Fingertip(), ball, fp.RampAndHold(depth_mm=1.0, hold_ms=300))
response = fp.Population.grid(density_per_cm2=100).respond(skin)
picture = fp.save_figure("touch.png", skin, response, ball)

figure, axes = plt.subplots(figsize=(9, 4.5), layout="constrained")
axes.imshow(matplotlib.image.imread("touch.png"))
axes.set_axis_off()
plt.show()
