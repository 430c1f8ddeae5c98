"""
All fields of a press
=====================

With ``whole=True`` a press keeps stress, strain and energy of every element over time.
"""

import matplotlib.pyplot as plt

import fingerpad as fp

touch = fp.touch_of(fp.Fingertip(), fp.Cylinder(diameter_mm=3.17), fp.RampAndHold(depth_mm=0.7, hold_ms=50))
skin = touch.solve(whole=True)
middle = skin.mesh.nodes_mm[skin.mesh.elements].mean(axis=1)
stress_kpa = skin.deformation.fields.von_mises_kpa[-1]
near = middle[:, 2] < 0.5

figure, axes = plt.subplots(figsize=(6, 4), layout="constrained")
drawn = axes.scatter(middle[near, 0], middle[near, 1], c=stress_kpa[near], s=6, cmap="viridis", norm="log")
figure.colorbar(drawn, label="von Mises stress [kPa]")
axes.set(xlabel="along the finger, x [mm]", ylabel="y [mm]", aspect="equal")
plt.show()
