"""The Python lines that reproduce a view."""

from __future__ import annotations

from fingerpad.lab.answer import COLUMNS, ROWS, motion_of, sample_times_ms
from fingerpad.lab.laboratory import Laboratory
from fingerpad.lab.state import LabState
from fingerpad.reduction.model import ON_THE_PAD

TEMPLATE = """import numpy as np

import fingerpad as fp
from fingerpad.experiments.descriptions.reduction import described_reduction

# {title}
described = described_reduction({content}, {source!r})
training, shape = described.training, {shape}
model = fp.read_reduced({path!r}, training.touch)
motion = fp.Trajectory(
    {times},
    depth_mm={depth},
    x_mm={x},
    z_mm={z},
    tilt_deg={tilt},
)
times_ms = {samples}

# The reduced touch at the afferents, and what these fire.
finger = training.touch.finger
afferent = {afferent}
grid_mm = fp.Population.grid(rows={rows}, columns={columns}, finger=finger).positions_mm
inside_mm = grid_mm[(grid_mm[:, 0] > 1.0) & (grid_mm[:, 0] < finger.length_mm - 1.0)]
sites_mm = inside_mm[np.abs(inside_mm[:, 1]) < {pad} * finger.section(inside_mm[:, 0])[2]]
stream = fp.ReducedTouch(model, sites_mm, *shape)
samples = []
for time in times_ms:
    pose, depth_mm = motion.pose_at(time), float(motion.prescribed_at(time))
    samples.append(stream.step(time, depth_mm, None, pose.x_mm, pose.z_mm, pose.tilt_deg))
force_mn = np.array([sample.force_mn for sample in samples])
traces = fp.Traces(
    times_ms,
    np.array([sample.fields[afferent.static_quantity] for sample in samples]),
    kinks_ms=motion.times_ms[1:-1],
    quantity=afferent.static_quantity,
)
spikes = afferent.spikes(traces)
print(f"{{force_mn.max():.1f}} mN, {{sum(len(train) for train in spikes)}} spikes")

# The full solution of the same touch; it takes seconds to a minute.
exact = training.touch_with(shape, motion)
# skin = exact.solve()
"""


def python_lines(laboratory: Laboratory, state: LabState, path: str = "") -> str:
    """Write the lines; they read the file of the reduced touch, or `path`."""
    described = laboratory.described(state)
    motion, shape = motion_of(described, laboratory.model(state), state)
    return TEMPLATE.format(
        title=str(state),
        content=described.description.model_dump(mode="json", exclude_unset=True),
        source=laboratory.source(state).name if path else str(laboratory.source(state).resolve()),
        shape=shape,
        rows=ROWS,
        columns=COLUMNS,
        pad=ON_THE_PAD,
        path=path or str(laboratory.path(state).resolve()),
        times=motion.times_ms,
        depth=motion.depth_mm,
        x=motion.x_mm,
        z=motion.z_mm,
        tilt=motion.tilt_deg,
        samples=[round(time, 6) for time in sample_times_ms(motion).tolist()],
        afferent="fp.RA()"
        if state.afferent == "RA"
        else f"fp.Afferent.for_tissues({described.description.tissues!r})",
    )
