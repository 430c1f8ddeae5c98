"""
Press a ball into a fingertip
=============================

Force over time, and where the skin goes. Tissue relaxes while the ball is held.
"""

import matplotlib.pyplot as plt

import fingerpad as fp

skin = fp.indent(fp.Fingertip(), fp.Sphere(radius_mm=3.5), fp.RampAndHold(depth_mm=1.0, hold_ms=300))
profile = skin.surface_profile()

figure, (left, right) = plt.subplots(1, 2, figsize=(8, 3), layout="constrained")
left.plot(skin.times_ms, skin.force_mn, "k-")
left.set(xlabel="time [ms]", ylabel="force [mN]")
right.plot(profile.distance_mm, -profile.deflection_mm, "k-")
right.set(xlabel="distance from the ball [mm]", ylabel="skin [mm]", xlim=(-8, 8))
plt.show()
