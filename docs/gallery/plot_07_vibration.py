"""
A vibration on a hold
=====================

Three cycles of 20 Hz on a hold of 0.6 mm. RA afferents fire with the cycles, SAI afferents in the
hold as well.
"""

import matplotlib.pyplot as plt

import fingerpad as fp

motion = fp.sine(depth_mm=0.6, amplitude_mm=0.1, frequency_hz=20, cycles=3, hold_ms=50)
skin = fp.indent(fp.Fingertip(), fp.Sphere(radius_mm=2.0), motion)

figure, (above, below) = plt.subplots(2, 1, sharex=True, figsize=(7, 4), layout="constrained")
above.plot(skin.times_ms, skin.depth_mm, "k-")
above.set(ylabel="depth [mm]")
for row, afferent in enumerate((fp.SAI(), fp.RA())):
    traces = skin.sed([(17.37, 0.0)], afferent.dynamic_quantity, afferent.static_quantity)
    (train,) = afferent.spikes(traces)
    below.plot(train, [row] * train.size, "k|", markersize=20)
below.set(xlabel="time [ms]", yticks=[0, 1], yticklabels=["SAI", "RA"], ylim=(-0.6, 1.6))
plt.show()
