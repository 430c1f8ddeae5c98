"""
How the population codes curvature
==================================

Sharper balls make fewer afferents fire faster.
"""

import matplotlib.pyplot as plt

import fingerpad as fp

motion = fp.RampAndHold(depth_mm=0.7, hold_ms=200)
population = fp.Population.grid(density_per_cm2=200, rows=1, columns=14)

figure, axes = plt.subplots(figsize=(6, 3.5), layout="constrained")
for curvature, line in ((144, "k-"), (287, "k--"), (694, "k:")):
    skin = fp.indent(fp.Fingertip(), fp.Sphere(curvature_per_m=curvature), motion)
    response = population.respond(skin, static_window_ms=(100, 250))
    axes.plot(response.positions_mm[:, 1], response.static_rate_hz, line, label=f"{curvature} /m")
axes.set(xlabel="across the finger [mm]", ylabel="rate in the hold [spikes/s]")
axes.legend(title="curvature")
plt.show()
