"""The studies: each is a command of its name."""

from __future__ import annotations

import fingerpad.cli
from fingerpad.cli import Program
from studies import held_out, mesh_refinement, sai_search
from studies.results_command import RESULTS
from studies.study import Study, command_of

STUDIES = (
    Study(
        "held-out",
        "Predict what no search has used: force, spheres by force, gratings, adaptation, volume, thresholds.",
        held_out.run,
        held_out.blocks,
        "held-out.md",
    ),
    Study(
        "sai-search",
        "Search for one SAI afferent by rates under a bar and areas of receptive fields.",
        sai_search.run,
        sai_search.blocks,
        "decisions/paper-and-human.md",
    ),
    Study(
        "mesh-refinement",
        "Press bars and spheres into finer meshes, and report the error of the meshes of every resolution.",
        mesh_refinement.run,
        mesh_refinement.blocks,
        None,
        has_conditions=False,
    ),
)

PROGRAM = Program(
    "studies",
    "Research on the model itself.",
    {"results": RESULTS, **{study.name: command_of(study) for study in STUDIES}},
)


def main() -> None:
    """Run one study."""
    fingerpad.cli.main(program=PROGRAM)


if __name__ == "__main__":
    main()
