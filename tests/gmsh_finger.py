"""A finger made by Gmsh: a tube with a round tip about a bone, bricks and, on its axis, wedges.

A profile of four layers is meshed with quadrilaterals and turned about the axis of the bone by half a turn:
half a finger at z >= 0.
"""

from __future__ import annotations

import signal
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path

import pytest

from fingerpad.geometry.mesh import LAYERS

BONE_MM, RADIUS_MM, TUBE_MM = 2.5, 8.0, 16.0
DEPTHS_MM = (0.4, 0.5, 1.6)


def write_gmsh_finger(
    path: Path,
    along: int = 10,
    cap: int = 6,
    around: int = 12,
    through: Sequence[int] = (1, 1, 2, 2),
    version: float = 4.1,
    scale: float = 1.0,
    skin: str = "skin",
) -> None:
    """Write a finger with numbers of elements along, at the tip, around half of it, and through layers."""
    try:
        import gmsh
    except (ImportError, OSError) as error:  # OSError: a library of the system that its windows need
        pytest.skip(f"Gmsh cannot be loaded: {error}")

    gmsh.initialize(interruptible=False)
    if hasattr(signal, "SIGPIPE"):
        # Gmsh gives it back to the system: writing to a closed socket would end all further tests.
        signal.signal(signal.SIGPIPE, signal.SIG_IGN)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        occ, mesh = gmsh.model.geo, gmsh.model.mesh
        radii = [RADIUS_MM, *(RADIUS_MM - depth for depth in DEPTHS_MM), BONE_MM]
        centre = occ.addPoint(TUBE_MM, 0.0, 0.0)
        # The profile lies in the plane z = 0, on the volar side: y = -r.
        points = [
            [occ.addPoint(0.0, -r, 0.0), occ.addPoint(TUBE_MM, -r, 0.0), occ.addPoint(TUBE_MM + r, 0.0, 0.0)]
            for r in radii
        ]
        straight = [occ.addLine(row[0], row[1]) for row in points]
        round_tip = [occ.addCircleArc(row[1], centre, row[2]) for row in points]
        across = [[occ.addLine(outer[n], inner[n]) for n in range(3)] for outer, inner in pairwise(points)]
        surfaces = []
        for layer in range(len(LAYERS)):
            for number, lines in enumerate((straight, round_tip)):
                loop = occ.addCurveLoop(
                    [lines[layer], across[layer][number + 1], -lines[layer + 1], -across[layer][number]]
                )
                surfaces.append(occ.addPlaneSurface([loop]))
        for line in straight:
            mesh_line(occ, line, along)
        for line in round_tip:
            mesh_line(occ, line, cap)
        for layer, count in enumerate(through):
            for line in across[layer]:
                mesh_line(occ, line, count)
        for surface in surfaces:
            occ.mesh.setTransfiniteSurface(surface)
            occ.mesh.setRecombine(2, surface)
        groups: dict[str, list[int]] = {name: [] for name in (*LAYERS, skin, "bone", "symmetry")}
        groups["symmetry"] += surfaces
        for number, surface in enumerate(surfaces):
            layer = number // 2
            # Two quarter turns: from the volar side by +z to the dorsal side.
            end = (2, surface)
            for _ in range(2):
                made = occ.revolve(
                    [end], 0, 0, 0, 1, 0, 0, -1.5707963267948966, [around // 2], recombine=True
                )
                end = made[0]
                groups[LAYERS[layer]] += [tag for dim, tag in made if dim == 3]
                # Behind the volume stand its sides, in the order of the curves of the profile.
                sides = [tag for dim, tag in made[2:]]
                if layer == 0:
                    groups[skin].append(sides[0])
                if layer == len(LAYERS) - 1:
                    # The line of the tip on the axis is turned into no surface.
                    groups["bone"].append(sides[2 - number % 2])
            groups["symmetry"].append(end[1])
        occ.synchronize()
        for name, tags in groups.items():
            gmsh.model.addPhysicalGroup(3 if name in LAYERS else 2, tags, name=name)
        mesh.generate(3)
        if scale != 1.0:
            mesh.affineTransform([scale, 0, 0, 0, 0, scale, 0, 0, 0, 0, scale, 0])
        gmsh.option.setNumber("Mesh.MshFileVersion", version)
        gmsh.option.setNumber("Mesh.Binary", 0)
        gmsh.write(str(path))
    finally:
        gmsh.finalize()


def mesh_line(geometry, line: int, count: int) -> None:
    """Divide a line into equal parts."""
    geometry.mesh.setTransfiniteCurve(line, count + 1)
