"""One indentation: an indenter, its place on the finger and its motion; solved for the skin's response."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import field, replace
from functools import cached_property, lru_cache
from inspect import signature
from itertools import pairwise
from typing import Annotated, Any, ParamSpec, cast

import numpy as np
from numpy.typing import ArrayLike
from pydantic import SkipValidation
from scipy.optimize import brentq
from threadpoolctl import threadpool_limits

from fingerpad.core.checked import checked, value_class
from fingerpad.core.compilation import announce_compilation
from fingerpad.core.errors import InputError, shown
from fingerpad.core.phases import from_onset
from fingerpad.core.progress import NoProgress, Progress
from fingerpad.core.threads import compiled_threads
from fingerpad.core.values import (
    Finite,
    Flag,
    FloatArray,
    Numbers,
    Pair,
    Whole,
    choice,
    instance,
    limits,
    positive,
)
from fingerpad.data import fingertip as published
from fingerpad.data.tissues import DEFAULT_TISSUES
from fingerpad.geometry.fingertip import Finger, Fingertip
from fingerpad.geometry.grading import RESOLUTIONS, Grading
from fingerpad.geometry.indenters import Indenter
from fingerpad.geometry.mesh import Mesh, finger_mesh
from fingerpad.geometry.motion import CLEARANCE_TO_BONE, STILL, Motion, RampAndHold, check_path
from fingerpad.geometry.probing import check_gap
from fingerpad.geometry.size_field import check_sizes, grading_below
from fingerpad.mechanics.contact import PlacedIndenter, Placement, check_friction, place, rotation_of
from fingerpad.mechanics.inertia import warn_of_inertia
from fingerpad.mechanics.kernels import KERNELS
from fingerpad.mechanics.materials import Tissues
from fingerpad.mechanics.press import Deformation, Specimen, press
from fingerpad.mechanics.press_settings import PressSettings
from fingerpad.mechanics.tissues import named_tissues
from fingerpad.skin.fields import stored_fields, watched_elements
from fingerpad.skin.sampling import SkinResponse, places_below, receptors_of

CONTACT_POINT_MM = (published.CONTACT_POINT.value[0], 0.0)
STEPS = {"quick": (5, 5), "standard": (8, 8), "paper": (8, 8)}

LARGEST_TILT_DEG = 45.0

_Given = ParamSpec("_Given")

LOOKS_FOR_TOUCH = 8  # Times per sample of a motion aside at which first touch is looked for.


@value_class
class Touch:
    """Everything that determines one indentation; its value is the key of the stored result.

    Raises
    ------
    InputError
        If the axis misses the finger, the depth reaches the bone, an axis beside the midline or a spin that
        breaks the symmetry meets half a finger, the elements are too long for the indenter or a groove,
        tilt, spin or friction is asked of a wire, or no tissue lies as deep as an end organ.

    Warns
    -----
    InertiaWarning
        If the motion is so fast that the inertia of the tissue, which is neglected, matters.
    """

    finger: Finger
    indenter: Indenter  #: The rigid body.
    stimulus: Motion  #: Its motion, by depth or by force.
    tissues: Tissues  #: Laws of the four layers.
    grading: Grading  #: Fine zone and element sizes of the mesh; those that a `FingerMesh` has.
    settings: PressSettings = field(default_factory=PressSettings)  #: Steps and tolerances.
    at_mm: Pair = None  # type: ignore[assignment]  # a pair after initialisation
    """x and z of the skin point that the indenter's axis goes through; by default the middle of the finger's
    pad, `Fingertip.contact_mm`. [mm]"""
    tilt_deg: Annotated[float, limits(-LARGEST_TILT_DEG, LARGEST_TILT_DEG)] = 0.0
    """Rotation of the indenter about z. At 0 it presses along y, perpendicular to the finger's long axis; a
    positive tilt turns the direction of pressing towards the proximal end. [degrees]"""
    friction: Finite = 0.0  #: Coulomb's coefficient between skin and indenter.
    spin_deg: Finite = 0.0
    """Rotation of the indenter about its direction of pressing, after the tilt. At 0 a bar lies across the
    finger, at 90 along it; a positive spin turns the indenter's x axis from distal towards +z. [degrees]"""
    receptor_depths_mm: Numbers = ()
    """Depths of end organs at which all quantities are wanted beside the border of epidermis and dermis: they
    are kept in the layers that hold these depths. [mm]"""
    whole: Flag = field(default=False, compare=False, repr=False)
    """Whether `solve` keeps all nodes and elements over time, unless it is told. No part of the key."""
    progress: SkipValidation[Progress | None] = field(default=None, compare=False, repr=False)
    """Shown how far `solve` is. No part of the key."""

    def __post_init__(self) -> None:
        x, z = self.at_mm or self.finger.contact_mm
        object.__setattr__(self, "at_mm", (x, z))
        if z != 0.0 and not self.grading.full:
            raise InputError(f"at_mm beside the midline (z = {z:g} mm) needs a grading with full=True.")
        body = type(self.indenter).__name__
        for name, angle in (("tilt_deg", self.tilt_deg), ("spin_deg", self.spin_deg)):
            if self.indenter.grips and angle != 0.0:
                raise InputError(name, f"must be 0 for {body}", f"{angle:g} degrees")
        if self.indenter.grips and not self.stimulus.stays:
            raise InputError(f"{body} may only be moved up and down: got a motion that moves or turns it.")
        # A class that was made by exec has no module.
        home = type(self.indenter).gap.__module__ or ""
        if not home.startswith(f"{__package__.partition('.')[0]}."):
            check_gap(self.indenter.gap, body)
        if not self.grading.full and not self.indenter.mirrors(self.spin_deg):
            raise InputError(
                f"spin_deg = {self.spin_deg:g} degrees leaves {body} without symmetry across the midline, so "
                "half a finger is not enough: give a grading with full=True."
            )
        for pose in () if self.grading.full else self.stimulus.poses:
            if pose.z_mm != 0.0:
                raise InputError(f"z_mm = {pose.z_mm:g} mm of the motion needs a grading with full=True.")
            if pose.spin_deg != 0.0:  # friction twists the skin, which then has no mirror image
                raise InputError("spin_deg of the motion needs a grading with full=True.")
        check_friction(self.friction, self.indenter)
        if self.progress is not None and not callable(getattr(self.progress, "stage", None)):
            raise InputError(
                "progress", "must have a method stage, as fp.notebook_progress() has", shown(self.progress)
            )
        check_path(self.finger, self.stimulus, self.at_mm)
        self.steps_ms()  # refuses times that lie outside of the motion
        depths_mm = sorted({positive("receptor_depths_mm", depth, "mm") for depth in self.receptor_depths_mm})
        object.__setattr__(self, "receptor_depths_mm", tuple(depths_mm))
        if depths_mm:
            watched_elements(self.mesh, depths_mm)
        warn_of_inertia(self.stimulus, self.tissues.layers, self.layers_mm)

    @property
    def layers_mm(self) -> FloatArray:
        """Thickness of the layers below the indenter. [mm]"""
        depths = self.finger.layer_depths_mm
        to_bone_mm = float(self.finger.depth_available_mm(*self.at_mm))
        return np.diff([0.0, *depths, max(to_bone_mm, depths[-1])])

    def steps_ms(self) -> FloatArray:
        """List the times to solve at, from 0, without a tolerance of SED. [ms]"""
        return self.settings.steps_ms(self.stimulus, sticks=self.friction > 0.0)

    def check_sites(self, sites_mm: ArrayLike) -> None:
        """Raise `InputError` if the skin could not be sampled at a site, as `SkinResponse.sed` would.

        Examples
        --------
        >>> from fingerpad.geometry.bodies import Sphere
        >>> touch_of(Fingertip(), Sphere(), resolution="quick").check_sites([[99.0, 0.0]])
        Traceback (most recent call last):
        fingerpad.core.errors.InputError: sites must lie on the volar skin of the mesh: (x, z) = (99, 0) ...
        """
        places_below(receptors_of(self.mesh), sites_mm)

    def solve(self, threads: Whole | None = None, whole: Flag | None = None) -> SkinResponse:
        """Solve the indentation and return the response of the skin.

        Parameters
        ----------
        threads : int, optional
            Number of threads, all by default; the result has the same bits on any number of threads.
        whole : bool, optional
            Whether to keep `SkinResponse.deformation` as well: displacement of all nodes, stress, strain and
            energies of all elements over time. It takes about 200 bytes per element and time. By default as
            the touch was described.

        Raises
        ------
        ConvergenceError
            If a step cannot be solved.
        """
        mesh, whole = self.mesh, self.whole if whole is None else whole
        watched = watched_elements(mesh, self.receptor_depths_mm)
        with (self.progress or NoProgress()).stage("press", 1) as advance:
            done = self._press(np.arange(len(mesh.elements)) if whole else watched, threads)
            advance()
        kept = replace(done, fields=done.fields.of(watched)) if whole else done
        return self.response(
            {field.name: field.stored_values(kept, mesh) for field in stored_fields()},
            force_imbalance=done.force_imbalance,
            energy_imbalance=done.energy.relative_imbalance,
            penetration_mm=done.penetration_mm,
            newton_steps=done.newton_steps,
            factorisations=done.factorisations,
            linear_solver=done.linear_solver,
            deformation=done if whole else None,
        )

    def response(self, fields: Mapping[str, FloatArray], **solution: Any) -> SkinResponse:
        """Return the response to this indentation, given its fields and how it was solved."""
        return SkinResponse(
            mesh=self.mesh,
            kinks_ms=self.stimulus.corners_ms,
            phases=from_onset(self.stimulus.phases, self.onset_ms),
            onset_ms=self.onset_ms,
            pose=self.stimulus.pose_at(self.stimulus.end_ms),
            axis_x_mm=self.at_mm[0],
            direction=rotation_of(self.tilt_deg, self.spin_deg)[:, 1].copy(),
            fields=fields,
            touch=self,
            receptor_depths_mm=self.receptor_depths_mm,
            **solution,
        )

    @cached_property
    def onset_ms(self) -> float:
        """Time of first touch of the undeformed skin. [ms]"""
        onset = self.stimulus.onset_ms
        if self.stimulus.pose_at(onset) == STILL:
            return onset
        # Aside or turned, the indenter meets skin that lies higher or lower.
        body, skin_mm = self.body, self.mesh.nodes_mm[self.mesh.skin_nodes]

        def gap_mm(time_ms: float) -> float:
            there = self.placement.moved(self.stimulus.pose_at(time_ms))
            depth_mm = 0.0 if self.stimulus.by_force else float(self.stimulus.prescribed_at(time_ms))
            return float(body.gap(there.to_local(skin_mm, depth_mm))[0].min())

        samples_ms = np.array(self.stimulus.samples_ms)
        times = np.interp(np.arange(0.0, samples_ms.size - 1.0, 1.0 / LOOKS_FOR_TOUCH),
                          np.arange(samples_ms.size), samples_ms)  # fmt: skip
        for before, after in pairwise(times.tolist()):
            if gap_mm(after) <= 0.0:
                return before if gap_mm(before) <= 0.0 else float(brentq(gap_mm, before, after))
        return onset

    def _press(self, watched: np.ndarray, threads: int | None) -> Deformation:
        # Libraries get one thread, since their sums depend on the number of threads; our loops' do not.
        with (
            compiled_threads(threads) as used,
            announce_compilation(KERNELS, on_two_cores=used > 1),
            threadpool_limits(limits=1),
        ):
            specimen = Specimen(self.mesh, self.tissues.layers, watched)
            indenter = PlacedIndenter(
                self.body, self.placement, self.friction, self.grading.finest_strip_mm, self.deepest_mm
            )
            return press(specimen, indenter, self.stimulus, self.settings)

    @property
    def body(self) -> Indenter:
        """The indenter as its mesh resolves it (docs/decisions/small-bodies.md).

        Contact is judged at nodes. A rim or edge that is sharper than the elements there has their size.
        """
        finest_mm = self.grading.finest_strip_mm
        return self.indenter if np.isinf(finest_mm) else self.indenter.rounded_to(finest_mm)

    @property
    def placement(self) -> Placement:
        """Position and rotation of the indenter at first touch."""
        skin = self.mesh.nodes_mm[self.mesh.skin_nodes]
        at = self.finger.skin_point(*self.at_mm)
        return place(self.body, skin, at, rotation_of(self.tilt_deg, self.spin_deg))

    @property
    def deepest_mm(self) -> float:
        """Largest allowed depth, 80 % of the distance to the bone. [mm]"""
        return CLEARANCE_TO_BONE * float(self.finger.depth_available_mm(*self.at_mm))

    @property
    def mesh(self) -> Mesh:
        """Mesh of the undeformed finger."""
        return self.finger.own_mesh or _mesh(self.finger, self.grading)


@lru_cache(maxsize=4)
def _mesh(finger: Finger, grading: Grading) -> Mesh:
    return finger_mesh(cast(Fingertip, finger), grading)


@checked
def touch_of(
    finger: Finger,
    indenter: Indenter,
    stimulus: Motion | None = None,
    tissues: str | Tissues = DEFAULT_TISSUES,
    resolution: Annotated[str, choice(RESOLUTIONS)] = "quick",
    at_mm: Pair | None = None,
    *,
    tilt_deg: Finite = 0.0,
    spin_deg: Finite = 0.0,
    friction: Finite = 0.0,
    grading: Grading | None = None,
    settings: PressSettings | None = None,
    times_ms: Sequence[float] = (),
    receptor_depths_mm: Sequence[float] = (),
    whole: Flag = False,
    progress: Progress | None = None,
) -> Touch:
    """Describe a touch without solving it: `indent` takes the same arguments and solves it."""
    x, z = at_mm or finger.contact_mm
    stimulus = instance("stimulus", stimulus or RampAndHold(), Motion)
    # The grading depends on this point, so finger, indenter and point are checked first.
    check_path(finger, stimulus, (x, z))
    settings = settings or settings_of(resolution)
    grading = grading or finger.own_grading(x, z)
    if grading is None:
        grading = grading_below(finger, indenter, resolution, (x, z), stimulus, tilt_deg, spin_deg)
    else:
        check_sizes(grading, indenter, spin_deg)
    return Touch(
        finger=finger,
        indenter=indenter,
        stimulus=stimulus,
        tissues=tissues if isinstance(tissues, Tissues) else named_tissues(tissues),
        grading=grading,
        settings=replace(settings, times_ms=tuple(times_ms)) if len(times_ms) else settings,
        at_mm=(x, z),
        tilt_deg=tilt_deg,
        friction=friction,
        spin_deg=spin_deg,
        receptor_depths_mm=tuple(receptor_depths_mm),
        whole=whole,
        progress=progress,
    )


def _with_arguments_of(
    described: Callable[_Given, Touch],
) -> Callable[[Callable[..., SkinResponse]], Callable[_Given, SkinResponse]]:
    """Give a function the arguments of another one, for `help`, editors and type checkers too."""

    def made(function: Callable[..., SkinResponse]) -> Callable[_Given, SkinResponse]:
        arguments = signature(described).replace(return_annotation="SkinResponse")
        function.__signature__ = arguments  # type: ignore[attr-defined]
        function.__annotations__ = {**described.__annotations__, "return": "SkinResponse"}
        return function

    return made


@checked
@_with_arguments_of(touch_of)
def indent(*args: Any, **given: Any) -> SkinResponse:
    """Press an indenter into a finger and return the response of the skin.

    Parameters
    ----------
    finger : Fingertip or FingerMesh
        The finger.
    indenter : Indenter
        `Line`, `Cylinder`, `Bar`, `Sphere`, `FlatPunch`, `Plate`, `Edge`, `Gap`, `Grating`, or a body of your
        own derived from `Indenter`.
    stimulus : RampAndHold, ForceRampAndHold or Trajectory, optional
        The motion, by depth or by force; the paper's by default.
    tissues : str or Tissues
        "human" (one set for deflection, force, firing and percept), "paper" (closest to the paper's numbers),
        "trial1", "trial2", "trial3" (paper, section 2.2.1), "trial2_wu", "trial3_wu",
        "trial3_stiffening", "maeno1998", "wu2007", "gerling2014_fit", or tissues of your own. The default
        afferent was fitted with the default tissues; `Afferent.for_tissues` has the one for others.
    resolution : {"quick", "standard", "paper"}
        How fine the mesh and the steps are.
    at_mm : (float, float), optional
        x and z of the indenter's axis on the finger; by default the middle of its pad. Half of the finger is
        solved on the midline. [mm]
    tilt_deg : float
        Rotation of the indenter about z, see `Touch`. [degrees]
    spin_deg : float
        Rotation of the indenter about its direction of pressing, see `Touch`. Without a `grading` both halves
        of the finger are meshed if the turned indenter is not its own mirror image. [degrees]
    friction : float
        Coulomb's coefficient between skin and indenter; the paper mentions none.
    grading : Grading, optional
        Mesh to use instead of the one that `resolution` grades about the indenter.
    settings : PressSettings, optional
        Steps and tolerances instead of those of `resolution`; `PressSettings(sed_tolerance=0.01)` chooses
        steps that keep the error of SED in time below 1 % of its largest value.
    times_ms : sequence of float
        Times that the response has beside those that the motion and the settings choose. [ms]
    receptor_depths_mm : sequence of float
        Depths of end organs at which all quantities shall be kept, see `SkinResponse.sample`. [mm]
    whole : bool
        Whether to keep all nodes and elements over time as well, see `Touch.solve`.
    progress : Progress, optional
        Shown how far the press is, such as `fp.notebook_progress()`.

    Raises
    ------
    ConvergenceError
        If the mechanics cannot be solved.

    Examples
    --------
    >>> import fingerpad as fp
    >>> skin = fp.indent(fp.Fingertip(), fp.Sphere(curvature_per_m=287), fp.RampAndHold(depth_mm=0.3))
    >>> print(f"{skin.surface_profile().deflection_mm.max():.1f} mm deep")
    0.3 mm deep
    """
    return touch_of(*args, **given).solve()


def settings_of(resolution: str) -> PressSettings:
    ramp_steps, hold_steps = STEPS[resolution]
    return PressSettings(ramp_steps, hold_steps)
