"""The commented example of a description that `fingerpad init` writes."""

from __future__ import annotations

import json
from pathlib import Path

from fingerpad.core.files import check_new, path_of, write_atomically
from fingerpad.experiments import schemas

EXAMPLE = f"""\
# yaml-language-server: $schema={schemas.TOUCH_SCHEMA}
#
# One touch. Try: fingerpad check touch.yaml, then fingerpad touch touch.yaml --out touch
# Keys that are left out have the values below or the paper's. docs/touch.md explains every key.

title: A ball on the finger pad

resolution: quick          # quick for a first look, standard for results
tissues: human             # a set of tissues; all others: docs/tissues.md
finger: adult              # small, large, child, macaque, aged; or measures:
# finger: {{length_mm: 24, width_mm: 18, height_mm: 15, stratum_corneum_mm: 0.5}}

object:
  kind: sphere             # cylinder, bar, line, punch, plate, edge, gap, grating, dots, braille,
                           # embossed, embossed_text, ridges, surface, height_map
  radius_mm: 4             # [mm]

motion:
  kind: ramp_and_hold      # sine, chirp, repeated, staircase, stroke, recorded, trajectory
  depth_mm: 0.8            # [mm]; or force_mn, in mN
  ramp_ms: 50
  hold_ms: 450

place:                     # from the middle of the finger pad
  x_mm: 0                  # along the finger, towards the tip
  z_mm: 0                  # across it
  spin_deg: 0              # turn about the direction of pressing

friction: 0                # Coulomb's coefficient between skin and object

afferents:
  layout: grid             # rectangular, hexagonal, uniform, jittered, poisson-disc, nail rows
  density_per_cm2: 100
  afferent: default        # the one that was fitted with the tissues, or fit.json of fingerpad fit
  noise: 0                 # width of a soft threshold over the threshold; 0 is without randomness
  seed: 0

outputs: [figures, csv, spikes]   # npz, netcdf, zarr, nwb, vtu, abaqus, calculix, febio
"""


def write_example(path: Path) -> Path:
    """Write the example, and beside it the JSON schema from which editors complete its keys."""
    path = path_of("path", path)
    check_new(path)
    schema = json.dumps(schemas.touch_schema(), indent=1)
    write_atomically(path.parent / schemas.TOUCH_SCHEMA, schema.encode())
    write_atomically(path, EXAMPLE.encode())
    return path
