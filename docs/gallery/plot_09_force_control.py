"""
By depth, or by force
=====================

Held at a depth the force relaxes; held by a force the skin creeps.
"""

import matplotlib.pyplot as plt

import fingerpad as fp

finger, ball = fp.Fingertip(), fp.Sphere(radius_mm=3.5)
by_depth = fp.indent(finger, ball, fp.RampAndHold(depth_mm=0.7, hold_ms=300))
by_force = fp.indent(finger, ball, fp.ForceRampAndHold(force_mn=by_depth.force_mn.max(), hold_ms=300))

figure, (left, right) = plt.subplots(1, 2, figsize=(8, 3), layout="constrained")
for skin, line, name in ((by_depth, "k-", "depth held"), (by_force, "k--", "force held")):
    left.plot(skin.times_ms, skin.force_mn, line, label=name)
    right.plot(skin.times_ms, skin.depth_mm, line)
left.set(xlabel="time [ms]", ylabel="force [mN]")
right.set(xlabel="time [ms]", ylabel="depth [mm]")
left.legend()
plt.show()
