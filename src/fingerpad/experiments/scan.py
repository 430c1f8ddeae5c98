"""A scan: an object moves over the finger in one line or in many, and afferents of all types respond.

A spike is drawn where the afferent lies on the object at that time, as in the spatial event plots of Johnson
and Lamb (1981, J. Physiol. 310, 117): all afferents of a type and all lines together give one image.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from pathlib import Path
from typing import ClassVar, Literal

import numpy as np
from scipy.signal import correlate

from fingerpad.core.checked import checked, result_class
from fingerpad.core.displayed import Columns, Contents, Result
from fingerpad.core.errors import InputError
from fingerpad.core.signals import ResponseMap
from fingerpad.core.units import MS_PER_S
from fingerpad.core.values import Count, FloatArray, NotNegative, Number, Pair, Positive, Text, Vector
from fingerpad.data import protocol
from fingerpad.data.afferents import TYPES
from fingerpad.experiments.requests.afferents import (
    AFFERENT_OBJECTS,
    Afferents,
    AfferentsSettings,
    RegionSettings,
    files_of,
    population_of,
    respond_to,
)
from fingerpad.experiments.requests.stimulus import (
    FINGER_OBJECTS,
    FingerRequest,
    PlacedObject,
    TactileStimulus,
)
from fingerpad.experiments.runner import Manifest, Runner
from fingerpad.geometry.embossed import Embossed
from fingerpad.geometry.fingertip import Fingertip
from fingerpad.geometry.indenters import Indenter
from fingerpad.geometry.motion import Trajectory
from fingerpad.geometry.motions import Corners, stroke
from fingerpad.mechanics.contact import Placement
from fingerpad.neuron.afferent import type_of
from fingerpad.neuron.population import Population
from fingerpad.skin.indentation import Touch
from fingerpad.skin.sampling import SkinResponse

FORCE_MN, SPEED_MM_PER_S = 300.0, 20.0  # Of a hand that reads letters; assumed.
FASTEST_MM_PER_S = 1000.0  # Faster than any hand explores a surface; assumed.
HELD_MS = 150.0  # Hold before the object moves: the burst of the ramp is over. [ms]
STEP_MM = 0.25  # Way between two times at which the skin is solved. [mm]
TOLERANCE = 1e-3
"""Of the balance of forces at every step, over the force: 2 mm of a letter took 106 Newton steps, and 125
with a tenth of it."""
PIXEL_MM = 0.25  # Of images.
DWELL_MS = 1.0  # Between looks at where afferents are, for the time that they spend in a pixel. [ms]
TOUCHED_MM = (8.0, 8.0)  # Skin that is in contact, along and across, in which afferents lie by default.


def _touched() -> AfferentsSettings:
    """SAI, RA and PC at their densities below the object."""
    densities = {name: TYPES[name].density_per_cm2 for name in ("SAI", "RA", "PC")}
    ellipse = RegionSettings(shape="ellipse", length_mm=TOUCHED_MM[0], width_mm=TOUCHED_MM[1])
    return AfferentsSettings(layout="poisson-disc", region=ellipse, densities_per_cm2=densities)


class ScanRequest(PlacedObject, FingerRequest):
    """A scan, as `fingerpad.scan` runs it and a file describes it."""

    word: ClassVar[str] = "scan"
    python: ClassVar[tuple[str, ...]] = (*FINGER_OBJECTS, "object", *AFFERENT_OBJECTS)

    title: Text = "A scan"  #: What it is, in words: the title of the page.
    x_mm: Corners = 0.0
    z_mm: Corners = 0.0
    """Where the object goes from its place, along the finger, distal positive, and across it: its end, or the
    corners of its path. [mm]"""
    speed_mm_per_s: Positive = SPEED_MM_PER_S  #: Along the path. [mm/s]
    force_mn: Positive | None = None  #: Constant normal force; 300 mN without a depth. [mN]
    depth_mm: Positive | None = None  #: Instead of a force, a constant depth. [mm]
    strokes: Count = 1  #: How often it goes there or back.
    lines: Count = 1
    line_mm: Positive = 0.2
    """How many lines are scanned, and how far apart, across the finger and about the place of the object.
    [mm]"""
    ramp_ms: Positive = protocol.RAMP.value
    hold_ms: NotNegative = HELD_MS  #: Until the object moves. [ms]
    step_mm: Positive = STEP_MM  #: Way between two times at which the skin is solved. [mm]
    detail_mm: Positive | None = None
    """Size below which no element goes, however fine the object: larger is faster and less exact. [mm]"""
    afferents: Afferents = _touched()  #: Who responds: by default SAI, RA and PC below the object.

    @cached_property
    def motion(self) -> Trajectory:
        """Motion of every line."""
        with self.origin.located():
            if self.force_mn is not None and self.depth_mm is not None:
                raise InputError("depth_mm", "must not be given beside force_mn", remedy="leave one out")
            if self.speed_mm_per_s > FASTEST_MM_PER_S:
                words = f"must be at most {FASTEST_MM_PER_S:g} mm/s, faster than any hand explores"
                raise InputError("speed_mm_per_s", words, f"{self.speed_mm_per_s:g}")
            force_mn = FORCE_MN if self.depth_mm is None and self.force_mn is None else self.force_mn
            x_mm, z_mm = self._way()
            return stroke(
                self.depth_mm, force_mn, speed_mm_per_s=self.speed_mm_per_s, x_mm=x_mm, z_mm=z_mm,
                strokes=self.strokes, ramp_ms=self.ramp_ms, hold_ms=self.hold_ms,
            )  # fmt: skip

    def _way(self) -> tuple[list[float], list[float]]:
        """Corners of the path, with points between them no further apart than a step. [mm]"""
        given = [np.atleast_1d(each) for each in (self.x_mm, self.z_mm)]
        most = max(each.size for each in given)
        given = [each if each.any() else np.zeros(most) for each in given]
        if given[0].size != given[1].size:
            words = "must have as many corners as z_mm, or be 0"
            raise InputError("x_mm", words, f"{given[0].size} and {given[1].size}")
        corners = np.vstack([np.zeros(2), np.column_stack(given)])
        points = [corners[:0]]
        for start, end in pairwise(corners):
            count = int(np.ceil(np.linalg.norm(end - start) / self.step_mm))
            if count == 0:
                raise InputError("x_mm", "must change from corner to corner, or z_mm must", "two equal ones")
            points.append(start + (end - start) * (np.arange(1, count + 1) / count)[:, None])
        x_mm, z_mm = np.concatenate(points).T.tolist()
        return x_mm, z_mm

    @cached_property
    def offsets_mm(self) -> list[float]:
        """How far each line lies from the place of the object, across the finger. [mm]"""
        return (self.line_mm * (np.arange(self.lines) - 0.5 * (self.lines - 1))).tolist()

    @cached_property
    def touches(self) -> list[Touch]:
        """A touch per line."""
        body, motion, depths_mm = self._checked_body(), self.motion, self.population.kept_depths_mm
        pressed = self.pressed_finger, self.scaled_tissues, self.resolution, self.grading
        place, found = dict(self.place), []
        with self.origin.located():
            for offset_mm in self.offsets_mm:
                where = place | {"z_mm": place["z_mm"] + offset_mm}
                made = TactileStimulus(body, motion, **where, friction=self.friction)
                try:
                    found.append(self._scanned(made.touch(*pressed, receptor_depths_mm=depths_mm)))
                except InputError as error:  # of a motion, whose numbers are keys of a scan
                    of_motion = error.path[:1] == ("motion",)
                    raise (error.at(error.path[1:] or ("x_mm",)) if of_motion else error) from error
        return found

    def _scanned(self, touch: Touch) -> Touch:
        """Return a touch with the mesh, steps and tolerances of a scan."""
        grading, settings = touch.grading, touch.settings
        if self.detail_mm is not None:
            grading = grading.no_finer_than(self.detail_mm)
        newton = replace(settings.newton, residual_tolerance=TOLERANCE, balance_tolerance=TOLERANCE)
        settings = replace(settings, ramp_steps=math.ceil(1.0 / self.step_mm), newton=newton)
        return replace(touch, grading=grading, settings=settings)

    def _checked_body(self) -> Indenter:
        """Make the object; letters that are larger than the finger are refused."""
        with self.origin.located():
            body, finger = self.body(self.beside), self.pressed_finger
            if isinstance(body, Embossed) and isinstance(finger, Fingertip):
                most_mm = 2.0 * float(finger.section(finger.contact_mm[0])[2])
                size_mm = float(np.ptp(np.concatenate(body.outlines_mm), axis=0).max())
                if size_mm > most_mm:
                    words = f"must be at most {most_mm:.3g} mm, as wide as the finger"
                    raise InputError("object", words, f"{size_mm:.3g} mm", "scan smaller letters")
            return body

    @cached_property
    def population(self) -> Population:
        """The afferents."""
        with self.origin.located():
            return population_of(self.afferents, self.tissues, self.beside, self.pressed_finger)

    def check(self) -> None:
        """Raise `InputError` if the scan is impossible; before anything is solved."""
        for touch in self.touches:
            touch.placement  # noqa: B018

    def further_files(self) -> list[Path]:
        """Files of the object and of the afferent."""
        return [*self.files(self.beside), *files_of(self.afferents.afferent, self.beside)]

    def run(self, runner: Runner) -> ScanResult:
        """Press the lines, or load them from where they are stored, and let the afferents respond."""
        self.check()
        skins = runner.responses({"lines": dict(enumerate(self.touches))})["lines"]
        with runner.stage("afferents", self.lines) as advance:
            responses = []
            for number in range(self.lines):
                responses.append(respond_to(self.afferents, self.population, skins[number]))
                advance()
        manifest = runner.manifest(
            self.conditions(self.pressed_finger, self.afferents.seed),
            {"lines": skins[0].mesh},
            inputs=self.input_hashes(),
        )
        lines = tuple(skins[number] for number in range(self.lines))
        return ScanResult(self, lines, tuple(responses), manifest)


@result_class
class TactileImage(Result):
    """Firing rate of the afferents of a type by where they lie on the object."""

    type: str
    along_mm: Vector  #: Middle of each pixel in the frame of the object, along its x axis, (n,). [mm]
    across_mm: Vector  #: The same along its z axis, (m,). [mm]
    rate_hz: np.ndarray  #: Spikes over the time that afferents spend there; NaN where none was, (n, m).
    pixel_mm: Positive  #: Size of a pixel. [mm]

    def __repr__(self) -> str:
        return f"TactileImage({self.type}, {self.along_mm.size} x {self.across_mm.size} pixels)"

    @property
    def half_width_mm(self) -> float:
        """Lag along the object at which the autocorrelation of the image falls to a half: its sharpness. [mm]

        NaN if the image is the same everywhere.
        """
        there = np.isfinite(self.rate_hz)
        around = np.where(there, self.rate_hz - np.mean(self.rate_hz, where=there), 0.0)
        middle, column = (side - 1 for side in around.shape)
        pairs = correlate(there.astype(float), there.astype(float))[middle:, column]
        products = correlate(around, around)[middle:, column]
        known = pairs > 0.5
        falls = products[known] / pairs[known]
        below = np.flatnonzero(falls < 0.5 * falls[0])
        if below.size == 0 or not falls[0] > 0.0:
            return float("nan")
        after = int(below[0])
        share = (falls[after - 1] - 0.5 * falls[0]) / (falls[after - 1] - falls[after])
        return float(self.pixel_mm * (after - 1 + share))

    def columns(self) -> Columns:
        along, across = np.meshgrid(self.along_mm, self.across_mm, indexing="ij")
        places = {"along_mm": along.ravel(), "across_mm": across.ravel()}
        return {"pixel": np.arange(along.size), **places, "rate_hz": self.rate_hz.ravel()}

    def contents(self) -> Contents:
        axes = {name: ((name,), getattr(self, name), {"units": "mm"}) for name in ("along_mm", "across_mm")}
        rates = (("along_mm", "across_mm"), self.rate_hz, {"units": "s-1"})
        return {**axes, "rate_hz": rates}, {"type": self.type, "pixel_mm": self.pixel_mm}


@result_class
class TypeSummary:
    """What the afferents of one type did while the object moved."""

    afferents: int
    firing: int  #: How many, and how many fire.
    mean_rate_hz: Number  #: Mean over afferents, lines and time. [spikes/s]
    half_width_mm: Number  #: Of the autocorrelation of their image; NaN if none fires. [mm]


@result_class
class ScanSummary:
    """A scan in a few numbers."""

    lines: int
    stroke_ms: Pair  #: Start and end of the motion. [ms]
    force_mn: Pair
    depth_mm: Pair  #: Smallest and largest while the object moves. [mN], [mm]
    types: dict[str, TypeSummary]  #: By the type of the afferents.


@result_class
class ScanFile:
    """The file `scan.json`."""

    format: Literal["fingerpad scan result"] = "fingerpad scan result"
    format_version: Literal[1] = 1  #: By which a reader knows the file.
    scan: ScanRequest  #: What was described.
    summary: ScanSummary  #: What came.
    manifest: Manifest  #: What ran.


@dataclass(frozen=True)
class ScanResult(Result):
    """What became of a scan: the responses of skin and afferents, line by line."""

    request: ScanRequest  #: What was asked.
    skins: tuple[SkinResponse, ...]  #: Responses of the skin: force, depth and contact over time.
    responses: tuple[ResponseMap, ...]  #: Responses of the afferents.
    manifest: Manifest  #: What ran.

    def __repr__(self) -> str:
        spikes = sum(int(response.spikes.counts.sum()) for response in self.responses)
        return f"ScanResult({len(self.skins)} line{'s' * (len(self.skins) != 1)}, {spikes} spikes)"

    @property
    def stroke_ms(self) -> tuple[float, float]:
        """Start and end of the motion. [ms]"""
        return self.request.ramp_ms + self.request.hold_ms, self.request.motion.end_ms

    @cached_property
    def of_type(self) -> dict[str, tuple[ResponseMap, ...]]:
        """Responses line by line, by the type of the afferents."""
        first = self.responses[0]
        if not first.parts:
            return {type_of(self.request.population.afferent): self.responses}
        return {name: tuple(response[name] for response in self.responses) for name in first}

    def on_object(self, positions_mm: FloatArray, times_ms: FloatArray, line: int) -> FloatArray:
        """Where points of the skin lie on the object, along its x and its z axis, (n, 2). [mm]

        The skin is taken as undeformed, `positions_mm` (n, 2 or 3) of afferents at `times_ms` (n,).
        """
        finger, motion = self.request.pressed_finger, self.request.motion
        points = positions_mm
        if points.shape[1] == 2:
            points = finger.skin_point(*points.T)
        way = [np.interp(times_ms, motion.samples_ms, motion.ways[:, axis]) for axis in (0, 1)]
        offset_mm = self.request.offsets_mm[line] - self.request.offsets_mm[0]
        moved = np.column_stack([way[0], np.zeros(times_ms.size), way[1] + offset_mm])
        return self._placement.to_local(points - moved, 0.0)[:, [0, 2]]

    @cached_property
    def _placement(self) -> Placement:
        """Where the object stands at first touch in the first line."""
        return self.request.touches[0].placement

    def events(self, name: str) -> Iterator[tuple[int, np.ndarray, FloatArray, FloatArray]]:
        """Line, afferents, times and places on the object of the spikes of a type by line. [ms], [mm]"""
        for line, response in enumerate(self.of_type[name]):
            spikes = response.spikes
            afferents = np.repeat(np.arange(len(spikes)), spikes.counts)
            moving = spikes.times_ms > self.stroke_ms[0]
            afferents, times_ms = afferents[moving], spikes.times_ms[moving]
            yield line, afferents, times_ms, self.on_object(response.positions_mm[afferents], times_ms, line)

    @checked
    def image(self, name: str, pixel_mm: Positive = PIXEL_MM) -> TactileImage:
        """Return the firing rate of the afferents of a type by where they lie on the object.

        Parameters
        ----------
        name : str
            Type of the afferents, such as "SAI".
        pixel_mm : float, optional
            Size of a pixel. [mm]
        """
        if name not in self.of_type:
            raise InputError("name", f"must be one of {', '.join(self.of_type)}", repr(name))
        looks_ms = np.arange(self.stroke_ms[0] + 0.5 * DWELL_MS, self.stroke_ms[1], DWELL_MS)
        been = []
        for line, response in enumerate(self.of_type[name]):
            places = response.positions_mm
            been.append(
                self.on_object(np.repeat(places, looks_ms.size, axis=0), np.tile(looks_ms, len(places)), line)
            )
        dwelt = np.concatenate(been)
        fired = np.concatenate([places for *_, places in self.events(name)])
        low = np.floor(dwelt.min(axis=0) / pixel_mm)
        counts = np.floor(dwelt.max(axis=0) / pixel_mm) + 1 - low
        edges = [pixel_mm * (start + np.arange(count + 1)) for start, count in zip(low, counts, strict=True)]
        time_s = np.histogramdd(dwelt, bins=edges)[0] * DWELL_MS / MS_PER_S
        spikes = np.histogramdd(fired, bins=edges)[0]
        rate_hz = np.divide(spikes, time_s, out=np.full(time_s.shape, np.nan), where=time_s > 0.0)
        along, across = (0.5 * (edge[1:] + edge[:-1]) for edge in edges)
        return TactileImage(type=name, along_mm=along, across_mm=across, rate_hz=rate_hz, pixel_mm=pixel_mm)

    def columns(self) -> Columns:
        """Spikes while the object moves, one per row."""
        rows = [(name, *event) for name in self.of_type for event in self.events(name)]
        sizes = [times.size for _, _, _, times, _ in rows]
        places = np.concatenate([event[4] for event in rows])
        return {
            "event": np.arange(len(places)),
            "type": np.repeat([event[0] for event in rows], sizes),
            "line": np.repeat([event[1] for event in rows], sizes),
            "afferent": np.concatenate([event[2] for event in rows]),
            "time_ms": np.concatenate([event[3] for event in rows]),
            "along_mm": places[:, 0],
            "across_mm": places[:, 1],
        }

    @property
    def summary(self) -> ScanSummary:
        """The scan in a few numbers."""
        start_ms, end_ms = self.stroke_ms
        moving = [skin.times_ms >= start_ms for skin in self.skins]

        def extremes(name: str) -> tuple[float, float]:
            values = np.concatenate(
                [getattr(skin, name)[those] for skin, those in zip(self.skins, moving, strict=True)]
            )
            return float(values.min()), float(values.max())

        types = {}
        for name, responses in self.of_type.items():
            rates_hz = np.array([each.spikes.counted_hz((start_ms, end_ms)) for each in responses])
            types[name] = TypeSummary(
                afferents=rates_hz.shape[1],
                firing=int(rates_hz.any(axis=0).sum()),
                mean_rate_hz=float(rates_hz.mean()),
                half_width_mm=self.image(name).half_width_mm,
            )
        return ScanSummary(
            lines=len(self.skins),
            stroke_ms=self.stroke_ms,
            force_mn=extremes("force_mn"),
            depth_mm=extremes("depth_mm"),
            types=types,
        )

    @property
    def result(self) -> ScanFile:
        """Content of `scan.json`."""
        return ScanFile(scan=self.request, summary=self.summary, manifest=self.manifest)
