"""
The first script of TouchSim's users, done here
===============================================

A population at measured densities, a pin of 1 mm diameter pressed 0.5 mm deep, and the spikes of each type of
afferent; no SAII afferent fires here. The page for users of TouchSim compares the two models.
"""

import matplotlib.pyplot as plt

import fingerpad as fp

finger = fp.Fingertip()
pad = fp.UnrolledSkin(finger)
population = fp.Population.at_densities(pad.pad(), place=pad.points, seed=1)
pin = fp.FlatPunch(diameter_mm=1.0, edge_radius_mm=0.3)
skin = fp.indent(finger, pin, fp.RampAndHold(depth_mm=0.5, hold_ms=200))
response = population.respond(skin)

figure, axes = plt.subplots(figsize=(8, 3.5), layout="constrained")
row = 0
for name, style in (("SAI", "k"), ("RA", "tab:blue"), ("PC", "tab:orange"), ("SAII", "0.6")):
    for train in response[name].spikes:
        if train.size:
            axes.plot(train, [row] * train.size, "|", color=style)
            row += 1
    print(f"{name}: {sum(train.size > 0 for train in response[name].spikes)} afferents fire")
axes.set(xlabel="time [ms]", ylabel="afferents that fire: SAI, RA, PC, SAII", xlim=(0, 250))
axes.yaxis.get_major_locator().set_params(integer=True)
plt.show()
