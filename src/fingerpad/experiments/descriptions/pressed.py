"""A described touch pressed: the skin's response, stored, and the afferents' responses."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

import numpy as np

from fingerpad.core.checked import result_class
from fingerpad.core.progress import Progress
from fingerpad.core.signals import ResponseMap
from fingerpad.core.values import Number
from fingerpad.experiments.conditions import Conditions
from fingerpad.experiments.descriptions.touch import DescribedTouch, TouchDescription
from fingerpad.experiments.manifest import Manifest
from fingerpad.experiments.runner import Runner
from fingerpad.neuron.afferent import as_sai
from fingerpad.neuron.afferent_types import OwnAfferent
from fingerpad.neuron.escape_rate import EscapeRate
from fingerpad.skin.sampling import SkinResponse


@result_class
class TouchSummary:
    """What a touch did, in a few numbers."""

    nodes: int
    """Size of the mesh, and number of times."""
    times: int
    """Size of the mesh, and number of times."""
    end_ms: Number
    """End of the motion. [ms]"""
    largest_force_mn: Number
    """Over time. [mN], [mm], [mm²]"""
    largest_depth_mm: Number
    """Over time. [mN], [mm], [mm²]"""
    largest_contact_mm2: Number
    """Over time. [mN], [mm], [mm²]"""
    afferents: int
    """How many, and how many fire at all."""
    firing: int
    """How many, and how many fire at all."""
    dynamic_rate_hz: Number
    """Largest firing rates in the two windows. [spikes/s]"""
    static_rate_hz: Number
    """Largest firing rates in the two windows. [spikes/s]"""


@result_class
class TouchFile:
    """The file `touch.json`."""

    format: Literal["fingerpad touch result"] = "fingerpad touch result"
    """By which a reader knows the file."""
    format_version: Literal[1] = 1
    """By which a reader knows the file."""
    touch: TouchDescription
    """What was described."""
    summary: TouchSummary
    """What it did."""
    manifest: Manifest
    """What ran."""


@dataclass(frozen=True)
class PressedTouch:
    """A described touch with the responses of skin and afferents."""

    described: DescribedTouch
    """The description."""
    skin: SkinResponse
    """Response of the skin; with all nodes and elements if it was pressed `whole`."""
    response: ResponseMap
    """Responses of the afferents."""
    manifest: Manifest
    """What ran."""

    @property
    def summary(self) -> TouchSummary:
        """The touch in a few numbers."""
        skin, response = self.skin, self.response
        return TouchSummary(
            nodes=len(skin.mesh.nodes_mm),
            times=skin.times_ms.size,
            end_ms=float(skin.times_ms[-1]),
            largest_force_mn=float(skin.force_mn.max()),
            largest_depth_mm=float(skin.depth_mm.max()),
            largest_contact_mm2=float(skin.fields["contact_area_mm2"].max()),
            afferents=len(response.positions_mm),
            firing=int(np.count_nonzero(np.isfinite(response.first_spike_latency_ms))),
            dynamic_rate_hz=float(response.dynamic_rate_hz.max()),
            static_rate_hz=float(response.static_rate_hz.max()),
        )

    @property
    def result(self) -> TouchFile:
        """Content of `touch.json`."""
        return TouchFile(touch=self.described.description, summary=self.summary, manifest=self.manifest)


def press_described(
    described: DescribedTouch,
    folder: Path,
    progress: Progress | None = None,
    command: str | None = None,
    whole: bool = False,
) -> PressedTouch:
    """Press a described touch, or load it from where it is stored, and let the afferents respond."""
    touch, _ = described.touch, described.population
    asked = described.description
    runner = Runner(folder, progress=progress)
    if whole:
        with runner.stage("press", 1) as advance:
            skin = touch.solve(whole=True)
            runner.store.save(touch, skin)
            advance()
        runner.note([skin])
    else:
        skin = runner.responses({"press": {"touch": touch}})["press"]["touch"]
    with runner.stage("afferents", 1) as advance:
        response = respond(described, skin)
        advance()
    manifest = runner.manifest(
        Conditions(asked.resolution, asked.afferents.seed, asked.tissues),
        {"touch": skin.mesh},
        half_model=not touch.grading.full,
        command=command,
        inputs=described.input_hashes(),
    )
    return PressedTouch(described, skin, response, manifest)


def respond(described: DescribedTouch, skin: SkinResponse) -> ResponseMap:
    """Responses of the described afferents to a skin, random if they have noise."""
    asked, population = described.description.afferents, described.population
    windows = asked.windows_ms.dynamic, asked.windows_ms.static
    if asked.noise == 0.0 or population.parts:
        return population.respond(skin, *windows)
    afferent = as_sai(population.afferent)
    membrane = EscapeRate(afferent.membrane, asked.noise)
    noisy = OwnAfferent(
        lambda traces: membrane.spikes(afferent.transduction.current(traces), asked.seed),
        dynamic_quantity=afferent.dynamic_quantity,
        static_quantity=afferent.static_quantity,
    )
    return replace(population, afferent=noisy).respond(skin, *windows)
