"""
A child's finger and an adult's
===============================

The same force presses less deep into a smaller finger: it has less tissue above the bone.
"""

import matplotlib.pyplot as plt

import fingerpad as fp

press = fp.ForceRampAndHold(force_mn=60.0, ramp_ms=50, hold_ms=150)
figure, axes = plt.subplots(figsize=(6, 3.5), layout="constrained")
for name, line in (("adult", "k-"), ("child", "k--")):
    finger = fp.Fingertip.of(name)
    skin = fp.indent(finger, fp.Sphere(radius_mm=3.5), press)
    axes.plot(skin.times_ms, skin.depth_mm, line, label=name)
axes.set(xlabel="time [ms]", ylabel="depth [mm]")
axes.legend()
plt.show()
