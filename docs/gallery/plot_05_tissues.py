"""
Other tissues
=============

The same ball in three sets of tissues that ship, and in one of your own.
"""

import matplotlib.pyplot as plt

import fingerpad as fp

ball, motion = fp.Sphere(radius_mm=3.5), fp.RampAndHold(depth_mm=0.7, hold_ms=100)
soft = fp.named_tissues("human").scaled(0.5)
sets = {"human": "human", "paper": "paper", "maeno1998": "maeno1998", "human, half as stiff": soft}

figure, axes = plt.subplots(figsize=(6, 3.5), layout="constrained")
for (name, tissues), line in zip(sets.items(), ("k-", "k--", "k:", "k-."), strict=True):
    skin = fp.indent(fp.Fingertip(), ball, motion, tissues=tissues)
    axes.plot(skin.depth_mm[skin.times_ms <= 50], skin.force_mn[skin.times_ms <= 50], line, label=name)
axes.set(xlabel="depth [mm]", ylabel="force [mN]")
axes.legend()
plt.show()
