"""The studies: each is a command of its name, which writes a page in Markdown and its numbers as JSON."""

from __future__ import annotations

import typer

from fingerpad.cli import run
from fingerpad.cli.options import Command
from studies import (
    bar_readings,
    code_efficiency,
    drive_study,
    fit_methods,
    held_out,
    mesh_noise,
    mesh_refinement,
    paper_size,
    population_timing,
    sed_readings,
    spike_fit,
    tissue_posterior,
    tissue_search,
)
from studies.commands.results import results_command
from studies.pages.bar_readings import bar_readings_page
from studies.pages.code_efficiency import code_efficiency_page
from studies.pages.drive_study import drives_page
from studies.pages.fit_methods import methods_page
from studies.pages.held_out import held_out_page
from studies.pages.mesh_noise import mesh_noise_page
from studies.pages.mesh_refinement import MESH_REFINEMENT
from studies.pages.paper_size import PAPER_SIZE
from studies.pages.population_timing import population_timing_page
from studies.pages.spike_fit import spike_fit_page
from studies.pages.tissue_posterior import tissue_posterior_page
from studies.pages.tissue_search import tissue_search_page
from studies.study import Study, command_of

STUDIES = (
    Study(
        "tissue-search",
        "Compare tissues and drives on deflection, plate force, firing and percept.",
        tissue_search.run,
        tissue_search_page,
    ),
    Study(
        "bar-readings",
        "Compare readings of the rates under the bar: intervals in windows, and bar or grating.",
        bar_readings.run,
        bar_readings_page,
    ),
    Study(
        "held-out",
        "Predict what no search has used: force, spheres by force, gratings, adaptation, volume, thresholds.",
        held_out.run,
        held_out_page,
        tissues="human",
    ),
    Study(
        "tissue-posterior",
        "Draw tissues, afferent and noise from one posterior, with bands on all figures.",
        tissue_posterior.run,
        tissue_posterior_page,
        tissues="human",
    ),
    Study(
        "sed-readings",
        "Compare readings of the energy density at the epidermal-dermal border, with both sets.",
        sed_readings.run,
        sed_readings.readings_page,
        resolution="standard",
    ),
    Study(
        "drives",
        "Compare what may drive the afferent: quantities, explanations of the dynamic rates, depths.",
        drive_study.run,
        drives_page,
        resolution="standard",
    ),
    Study(
        "mesh-refinement",
        "Press bars and spheres into finer meshes, and report the error of the meshes of every resolution.",
        lambda runner, conditions: mesh_refinement.run(runner),
        MESH_REFINEMENT.page,
        resolution=None,
    ),
    Study(
        "paper-size",
        "Compare the meshes of quick and standard with one of the paper's size.",
        lambda runner, conditions: paper_size.run(runner),
        PAPER_SIZE.page,
        resolution=None,
    ),
    Study(
        "methods",
        "Compare start points, methods of fitting and models on the rates under the bar.",
        fit_methods.run,
        methods_page,
    ),
    Study(
        "spike-fit",
        "Recover the fitted afferent from its spikes, and measure the variability of intervals.",
        spike_fit.run,
        spike_fit_page,
    ),
    Study(
        "mesh-noise",
        "Press the two nearest spheres on meshes with shifted element boundaries.",
        mesh_noise.run,
        mesh_noise_page,
    ),
    Study(
        "population-timing",
        "Order of first spikes and population rate about the contact under the spheres.",
        population_timing.run,
        population_timing_page,
    ),
    Study(
        "code-efficiency",
        "Compare the codes of a population with the ideal observer of its responses.",
        code_efficiency.run,
        code_efficiency_page,
    ),
)
"""Studies without options of their own."""

app = typer.Typer(
    help="Research on the model itself.",
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)
app.command("results", cls=Command)(results_command)
for study in STUDIES:
    app.command(study.name, cls=Command)(command_of(study))


def main() -> None:
    """Run one study."""
    run(app, "studies")


if __name__ == "__main__":
    main()
