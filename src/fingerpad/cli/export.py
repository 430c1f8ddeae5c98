"""`fingerpad export`: one touch as files for other programs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from fingerpad.cli.options import (
    DEFAULT_TISSUES,
    FINGER_CHOICES,
    FORMAT_CHOICES,
    INDENTER_CHOICES,
    Resolution,
    Tissues,
    number_option,
    option,
)
from fingerpad.cli.running import interruptible, make_writable
from fingerpad.core.errors import InputError

SPHERE, QUICK, ADULT = "sphere", "quick", "adult"


def export_command(
    folder: Annotated[
        Path, typer.Argument(metavar="FOLDER", help="Folder for the files; it is created if needed.")
    ],
    indenter: Annotated[
        str,
        option(f"One of {', '.join(INDENTER_CHOICES)}, with sizes as in punch:6.35 or sphere:radius_mm=3.5."),
    ] = SPHERE,
    curvature: Annotated[float | None, number_option("Curvature of the sphere. Default: 287. [1/m]")] = None,
    depth: Annotated[float | None, number_option("Depth of the hold. Default: 1. [mm]")] = None,
    trajectory: Annotated[
        Path | None,
        option(
            "CSV file with a motion instead of ramp and hold (docs/motions.md); samples close to a line "
            "are left out."
        ),
    ] = None,
    tolerance: Annotated[
        float | None,
        number_option(
            "How close, over the range of each column of --trajectory: above the noise of the recording. "
            "Default: 0.005."
        ),
    ] = None,
    finger: Annotated[
        str, option(f"One of {', '.join(FINGER_CHOICES)}, with measures as in adult:width_mm=18.")
    ] = ADULT,
    tissues: Tissues = DEFAULT_TISSUES,
    resolution: Resolution = QUICK,
    format_name: Annotated[str, option(f"One of {', '.join(FORMAT_CHOICES)}.", "--format")] = "vtu",
    described: Annotated[
        Path | None,
        option("YAML file of a touch (format: docs/touch.md) instead of the options above.", "--touch"),
    ] = None,
    elastic_moduli: Annotated[
        str | None, option("For calculix, whose materials do not relax: long_term or instantaneous.")
    ] = None,
) -> None:
    """Press an indenter into the finger and write the touch as a table, for ParaView or another solver."""
    from fingerpad.core.values import one_of
    from fingerpad.experiments.descriptions.touch import described_touch, read_touch_description
    from fingerpad.export.formats import check_format, export_touch

    one_of("format", format_name, FORMAT_CHOICES)
    if curvature is not None and indenter != SPHERE:
        raise InputError(
            f"--curvature is that of a sphere, --indenter sphere without a size: got {indenter}; "
            "leave it out."
        )
    if trajectory is not None and depth is not None:
        raise InputError(f"--depth is that of a hold, and {trajectory} has its own: leave it out.")
    if tolerance is not None and trajectory is None:
        raise InputError("--tolerance is that of a --trajectory: give both, or leave it out.")
    if described is not None:
        given = (indenter, curvature, depth, trajectory, finger, tissues, resolution)
        if given != (SPHERE, None, None, None, ADULT, DEFAULT_TISSUES, QUICK):
            raise InputError(
                f"--touch {described} has its own finger, object, motion, tissues and resolution: leave the "
                "other options of the touch out."
            )
        touch = read_touch_description(described).touch
    else:
        motion: dict[str, object] = {} if depth is None else {"depth_mm": depth}
        if trajectory is not None:
            motion = {"kind": "recorded", "file": str(trajectory)}
        if tolerance is not None:
            motion["tolerance"] = tolerance
        touch = described_touch(
            {
                "object": indenter if curvature is None else {"kind": SPHERE, "curvature_per_m": curvature},
                "motion": motion,
                "finger": finger,
                "tissues": tissues,
                "resolution": resolution,
                "place": {"tilt_deg": 0.0},
            },
            "the touch",
        ).touch
    check_format(format_name, elastic_moduli)
    make_writable(folder, "FOLDER")
    with interruptible("Files that exist are complete; the others were not written."):
        files = export_touch(folder, touch, format_name, elastic_moduli)
    typer.echo(f"Open: {files[0]}")
