"""
Press an STL
============

A box is written as STL, as a drawing program would, and read with rounded edges.
"""

import matplotlib.image
import matplotlib.pyplot as plt
import trimesh

import fingerpad as fp

trimesh.creation.box((3.0, 12.0, 2.0)).export("bar.stl")
bar = fp.read_surface("bar.stl", edge_radius_mm=0.4)
skin = fp.indent(fp.Fingertip(), bar, fp.RampAndHold(depth_mm=0.5, hold_ms=100))
fp.save_figure("bar.png", skin, fp.Population.grid(density_per_cm2=100).respond(skin), bar)

figure, axes = plt.subplots(figsize=(9, 4.5), layout="constrained")
axes.imshow(matplotlib.image.imread("bar.png"))
axes.set_axis_off()
plt.show()
