"""A population of afferents, of one type or several: their end organs, and their responses to a touch."""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterator, Mapping
from dataclasses import field, replace
from functools import cached_property
from types import MappingProxyType
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
from numpy.typing import ArrayLike
from pydantic import SkipValidation

from fingerpad.core.checked import checked, value_class
from fingerpad.core.errors import InputError, TissuesWarning, level_of_caller, shown
from fingerpad.core.random_streams import Purpose, normals, seed_of
from fingerpad.core.regions import MOST_RECEPTORS, Layout, Place, around_zero
from fingerpad.core.signals import INTERVAL, ResponseMap, Skin, Traces, traces_below
from fingerpad.core.values import (
    Count,
    Finite,
    FiniteMatrix,
    FiniteVector,
    FloatArray,
    NotNegative,
    NotNegativeWhole,
    Pair,
    Positive,
    Whole,
    count_from,
    float_array,
    positive,
)
from fingerpad.data import fingertip, psychophysics
from fingerpad.data.afferents import TYPES
from fingerpad.data.tissues import DEFAULT_TISSUES
from fingerpad.neuron.afferent import Afferent, AnyAfferent, checked_afferent, type_of
from fingerpad.neuron.afferent_types import afferent_types
from fingerpad.neuron.end_organs import EndOrgans
from fingerpad.neuron.spikes import RATE_OF, Window, first_spike_latency_ms, rate_windows_ms

if TYPE_CHECKING:
    from fingerpad.core.regions import Region

PUBLISHED_DENSITIES: Mapping[str, float] = MappingProxyType(
    {name: row.density_per_cm2 for name, row in TYPES.items()}
)
"""Densities of the types in the human fingertip. [1/cm2]"""

MM_PER_CM = 10.0
LARGEST_SPREAD = 9.0
CENTRE_MM = (fingertip.CONTACT_POINT.value[0], 0.0)
"""Centre of the default layout: the contact point of the paper's finger, on the midline. [mm]"""


@checked
def sensitivities(
    count: Annotated[int, count_from(1, MOST_RECEPTORS)], spread: NotNegative, seed: Whole
) -> FloatArray:
    """Draw the relative sensitivity of each afferent, a factor above 0 of both gains, (count,). [1]

    They are log-normal with mean 1: exp(spread n - spread^2/2), n from Normal(0, 1).

    Parameters
    ----------
    count : int
        Number of afferents.
    spread : float
        Standard deviation of the logarithm; 0 for equal afferents. A published value is
        `fingerpad.data.psychophysics.SENSITIVITY_SPREAD`.
    seed : int
        Seed of the random numbers; those of an afferent depend on its number only.

    Examples
    --------
    >>> sensitivities(3, spread=0.0, seed=7).tolist()
    [1.0, 1.0, 1.0]
    >>> bool((sensitivities(5, 0.4, seed=7)[:3] == sensitivities(3, 0.4, seed=7)).all())
    True
    """
    if spread > LARGEST_SPREAD:
        raise InputError("spread", f"must be at most {LARGEST_SPREAD:g}, a factor of 10^4", f"{spread:g}")
    drawn = normals(seed, 1, count, Purpose.SENSITIVITY, 1)[0, :, 0]
    return np.exp(spread * drawn - 0.5 * spread**2)


def _end_organs(afferent: AnyAfferent, places_mm: FloatArray, place: Place | None = None) -> EndOrgans | None:
    """End organs of afferents that have several."""
    count, reach_mm = getattr(afferent, "end_organs", 1), getattr(afferent, "reach_mm", 0.0)
    return EndOrgans.about(places_mm, count, reach_mm, place) if count > 1 and reach_mm > 0.0 else None


@value_class
class Population:
    """Afferents at different positions of the skin, with their sensitivities and end organs.

    All are of one type, unless the population was made by `mixed` or `at_densities`.
    """

    positions_mm: FiniteMatrix
    """x (distal positive) and z (lateral) of each end organ on the volar side, or x, y and z of the skin
    above it on any side, (n_receptors, 2 or 3). [mm]"""
    pitch_mm: Positive  #: Distance between neighbours of the layout. [mm]
    afferent: SkipValidation[AnyAfferent] = field(default_factory=Afferent)
    """All afferents: `Afferent()` (SAI), `RA()`, `PC()`, `SAII()` or an `OwnAfferent`."""
    sensitivity: FiniteVector | None = None
    """Factor of each afferent on what it follows, as from `sensitivities`, (n_receptors,); default: 1. [1]"""
    places_mm: FiniteMatrix | None = None
    """Positions in the plane of the layout, by which neighbours are found, (n_receptors, 2); default: x and
    z. [mm]"""
    ends: EndOrgans | None = None
    """Several end organs of each afferent; by default those of `Afferent.end_organs` about its position, and
    one at it where positions have three coordinates or the afferent says nothing of end organs."""
    centre_mm: Pair | None = None
    """Middle of the pad about which the positions lie, if they follow the finger that is touched: `on` moves
    them to the middle of its pad. By default they stay. [mm]"""
    depth_mm: Positive | None = None
    """Depth of the end organs below the skin; by default the border of epidermis and dermis. Quantities of
    the tissue other than strain energy density are kept at the depths that `indent` was given. [mm]"""
    parts: Mapping[str, Population] = field(default_factory=lambda: MappingProxyType({}))
    """Of a mixed population, the afferents of each type, which follow each other; from `mixed`."""

    def __post_init__(self) -> None:
        positions, factors = self.positions_mm, self.sensitivity
        if positions.shape[1] not in (2, 3) or len(positions) == 0:
            raise InputError(
                "positions_mm", "must have rows of x and z, or of x, y and z", f"shape {positions.shape}"
            )
        checked_afferent(self.afferent)
        if self.ends is not None and len(self.ends) != len(positions):
            raise InputError("ends", f"needs one row per afferent, {len(positions)}", str(len(self.ends)))
        if factors is not None and (factors.size != len(positions) or (factors <= 0.0).any()):
            got = f"{factors.size}, the smallest {factors.min(initial=math.inf):g}"
            raise InputError("sensitivity", f"needs one factor above 0 per receptor, {len(positions)}", got)
        places = positions[:, [0, -1]] if self.places_mm is None else self.places_mm
        if places.shape != (len(positions), 2):
            raise InputError("places_mm", f"needs a pair per receptor, {len(positions)}", str(places.shape))
        object.__setattr__(self, "places_mm", float_array("places_mm", places, 2))

    def __repr__(self) -> str:
        if self.parts:
            return f"Population({', '.join(f'{len(part)} {name}' for name, part in self.parts.items())})"
        unequal = "" if self.sensitivity is None else ", each with its sensitivity"
        kind = type_of(self.afferent)
        return f"Population({len(self)} afferents of type {kind}, {self.pitch_mm:.3g} mm apart{unequal})"

    def __getitem__(self, name: str) -> Population:
        if name not in self.parts:
            raise InputError(
                "type", f"must be one of {', '.join(self.parts) or 'a mixed population'}", repr(name)
            )
        return self.parts[name]

    def __iter__(self) -> Iterator[str]:
        """Names of the types of a mixed population."""
        return iter(self.parts)

    def __len__(self) -> int:
        return len(self.positions_mm)

    @classmethod
    @checked
    def of_layout(
        cls,
        layout: Layout,
        place: Place | None = None,
        afferent: AnyAfferent | None = None,
        sensitivity: ArrayLike | None = None,
        ends: EndOrgans | None = None,
        depth_mm: Positive | None = None,
    ) -> Population:
        """Place an afferent at each position of a layout.

        Parameters
        ----------
        layout : Layout
            From `fingerpad.core.regions`.
        place : callable, optional
            From positions in the plane of the layout (n, 2) to points of the skin (n, 3), such as
            `UnrolledSkin.points`; by default the plane is x and z, the volar view of the skin.
        afferent : AnyAfferent, optional
            Default: `Afferent()`.
        sensitivity : array_like (n_receptors,), optional
            As in `Population`.
        ends, depth_mm : optional
            As in `Population`, such as `EndOrgans.scattered(layout.places_mm, ..., place=place)`.

        Examples
        --------
        >>> from fingerpad.core.regions import Ellipse, hexagonal
        >>> disc = Ellipse(3.0, 3.0, centre_mm=(17.37, 0.0))
        >>> len(Population.of_layout(hexagonal(disc, density_per_cm2=100.0)))
        31
        """
        positions = layout.places_mm if place is None else place(layout.places_mm)
        factors = None if sensitivity is None else float_array("sensitivity", sensitivity, 1)
        responding = afferent or Afferent()
        if ends is None:
            ends = _end_organs(responding, layout.places_mm, place)
        return cls(positions, layout.pitch_mm, responding, factors, layout.places_mm, ends, depth_mm=depth_mm)

    @classmethod
    @checked
    def grid(
        cls,
        density_per_cm2: Positive = psychophysics.RECEPTOR_DENSITY.value,
        rows: Count = 3,
        columns: Count = 6,
        centre_mm: Pair | None = None,
        afferent: AnyAfferent | None = None,
        finger: Any = None,
        depth_mm: Positive | None = None,
    ) -> Population:
        """Place afferents on a square lattice that is symmetric about a point, ordered by x, then by z.

        The paper's 18 receptors are 3 along the finger by 6 across; it draws 9 of them, because of symmetry.

        Parameters
        ----------
        density_per_cm2 : float, optional
            Receptors per area; the pitch is the inverse of its square root. [1/cm2]
        rows, columns : int, optional
            Receptors along x and along z.
        centre_mm : (float, float), optional
            x and z of the centre of the lattice; by default the middle of the pad of the finger. [mm]
        afferent : Afferent, optional
            Default: `Afferent()`.
        finger : Fingertip, optional
            The finger in whose pad they lie. Without finger and centre, the lattice lies in the middle of the
            pad of the paper's finger, and `respond` moves it to that of the finger that is touched.
        depth_mm : float, optional
            As in `Population`. [mm]

        Examples
        --------
        >>> population = Population.grid(100.0, rows=1, columns=2, centre_mm=(17.0, 0.0))
        >>> population.pitch_mm, population.positions_mm.tolist()
        (1.0, [[17.0, -0.5], [17.0, 0.5]])
        """
        pitch_mm = MM_PER_CM / math.sqrt(density_per_cm2)
        follows = centre_mm is None and finger is None
        if finger is not None and not hasattr(finger, "contact_mm"):
            raise InputError(
                "finger", "must be one such as Fingertip() or Fingertip.of('child')", shown(finger)
            )
        centre_x, centre_z = centre_mm or (CENTRE_MM if finger is None else finger.contact_mm)
        if rows * columns > MOST_RECEPTORS:
            raise InputError(
                f"rows times columns must be at most {MOST_RECEPTORS:,} receptors: got {rows} by {columns}."
            )
        x, z = centre_x + pitch_mm * around_zero(rows), centre_z + pitch_mm * around_zero(columns)
        positions = np.stack(np.meshgrid(x, z, indexing="ij"), axis=-1).reshape(-1, 2)
        centre_mm = CENTRE_MM if follows else None
        return cls(positions, pitch_mm, afferent or Afferent(), centre_mm=centre_mm, depth_mm=depth_mm)

    @classmethod
    def mixed(cls, parts: Mapping[str, Population]) -> Population:
        """Join populations of several types in the same skin.

        Parameters
        ----------
        parts : mapping of str to Population
            One per type, by any name.

        Examples
        --------
        >>> from fingerpad.neuron.afferent_types import RA
        >>> both = Population.mixed({"SAI": Population.grid(), "RA": Population.grid(afferent=RA())})
        >>> len(both), both["RA"].afferent.type, both.types[0], both.types[-1]
        (36, 'RA', 'SAI', 'RA')
        """
        if not parts:
            raise InputError("parts", "must hold at least one Population", "none")
        several = list(parts.values())
        factors = [np.ones(len(part)) if part.sensitivity is None else part.sensitivity for part in several]
        unequal = any(part.sensitivity is not None for part in several)
        return cls(
            np.concatenate([part.positions_mm for part in several]),
            min(part.pitch_mm for part in several),
            several[0].afferent,
            np.concatenate(factors) if unequal else None,
            np.concatenate([np.asarray(part.places_mm) for part in several]),
            parts=MappingProxyType(dict(parts)),
        )

    @classmethod
    @checked
    def at_densities(
        cls,
        region: Region,
        densities_per_cm2: Mapping[str, float] | None = None,
        afferents: Mapping[str, AnyAfferent] | None = None,
        place: Place | None = None,
        spread: Finite = 0.0,
        seed: NotNegativeWhole = 0,
    ) -> Population:
        """Place afferents of each type at random, evenly, at a density each.

        Parameters
        ----------
        region : Region
            Part of a plane, from `fingerpad.core.regions` or `UnrolledSkin.pad`.
        densities_per_cm2 : mapping of str to float, optional
            Density of each type; the published ones by default. A type that is left out has no afferents.
            [1/cm2]
        afferents : mapping of str to AnyAfferent, optional
            Afferents of types whose parameters are not the default ones, or of types of one's own.
        place : callable, optional
            From the plane to points of the skin, as in `of_layout`.
        spread : float, optional
            Standard deviation of the logarithm of the sensitivity, as in `sensitivities`; 0 for equal ones.
        seed : int, optional
            Seed of positions and sensitivities. Each type has random numbers of its own.

        Examples
        --------
        >>> from fingerpad.core.regions import Ellipse
        >>> Population.at_densities(Ellipse(5.0, 5.0, centre_mm=(17.37, 0.0)), seed=1)
        Population(55 SAI, 110 RA, 16 PC, 8 SAII)
        """
        # Files of touches load this module, and only a layout at random needs that one.
        from fingerpad.core.regions import poisson_disc

        if not hasattr(region, "area_mm2"):
            raise InputError(
                "region", "must be one of fingerpad.core.regions or UnrolledSkin(finger).pad()", repr(region)
            )
        known = afferent_types() | dict(afferents or {})
        parts = {}
        densities = PUBLISHED_DENSITIES if densities_per_cm2 is None else densities_per_cm2
        for number, (name, density) in enumerate(densities.items()):
            if name not in known:
                raise InputError(
                    f"densities_per_cm2 has type {name!r} without an afferent: the types are "
                    f"{', '.join(known)}; give one in afferents={{{name!r}: ...}}."
                )
            positive(f"densities_per_cm2[{name!r}] of a type that is not left out", density, "1/cm2")
            layout = poisson_disc(region, density, seed=seed_of(seed, number))
            unequal = sensitivities(len(layout), spread, seed_of(seed, number)) if spread else None
            parts[name] = cls.of_layout(layout, place, known[name], unequal)
        return cls.mixed(parts)

    def on(self, skin: object) -> Population:
        """Return this population as it lies on a skin: about its `pad_mm`, if it has a `centre_mm`."""
        if self.parts:
            return self.mixed({name: part.on(skin) for name, part in self.parts.items()})
        pad_mm = getattr(skin, "pad_mm", None)
        if pad_mm is None or self.centre_mm in (None, pad_mm) or self.ends is not None:
            return self
        places = pad_mm + (self.positions_mm - self.centre_mm)
        return replace(self, positions_mm=places, places_mm=places, centre_mm=pad_mm)

    def followed(self, skin: Skin) -> Traces:
        """Sample what the afferents of a population of one type follow, (n_afferents,) traces."""
        traces = traces_below(skin, self.sites_mm, *self.quantities, self.depth_mm)
        return traces if self.branches is None else self.branches.combined(traces)

    def respond(
        self, skin: Skin, dynamic_window_ms: Window | None = None, static_window_ms: Window | None = None
    ) -> ResponseMap:
        """Sample the skin at every receptor and simulate each afferent.

        Parameters
        ----------
        skin : Skin
            Any object with `sed(sites)`, such as a solved indentation.
        dynamic_window_ms, static_window_ms : (float, float), optional
            Windows of the two firing rates, by default as of `Afferent.rates`. [ms]

        Warns
        -----
        TissuesWarning
            If the afferent is the default one and the skin has another set of tissues that ships.
        """
        there = self.on(skin)
        parts = there.parts or {"": there}
        maps: dict[str, ResponseMap] = {}
        # Afferents that follow the same quantities are sampled at once.
        kinds = {
            name: (part.quantities, part.depth_mm, part.sites_mm.shape[1]) for name, part in parts.items()
        }
        for kind in dict.fromkeys(kinds.values()):
            some = {name: part for name, part in parts.items() if kinds[name] == kind}
            sites = np.concatenate([part.sites_mm for part in some.values()])
            traces, start = traces_below(skin, sites, *kind[0], kind[1]), 0
            for name, part in some.items():
                part._check_tissues(skin)
                end = start + len(part.sites_mm)
                below = traces.part(slice(start, end)) if len(some) > 1 else traces
                maps[name] = part.respond_to(below, dynamic_window_ms, static_window_ms)
                start = end
        return ResponseMap.joined({name: maps[name] for name in parts}) if there.parts else maps[""]

    def _check_tissues(self, skin: Skin) -> None:
        """Warn if the default afferent responds to tissues with which it was not fitted."""
        tissues = getattr(skin, "tissues_name", "")
        if tissues not in ("", DEFAULT_TISSUES) and self.afferent == Afferent():
            warnings.warn(
                f"The default afferent was fitted with the tissues {DEFAULT_TISSUES!r}, and the skin has "
                f"{tissues!r}: give the population afferent=fp.Afferent.for_tissues({tissues!r}).",
                TissuesWarning,
                stacklevel=level_of_caller(),
            )

    @property
    def types(self) -> tuple[str, ...]:
        """Type of each afferent of a mixed population; empty where all are of one type."""
        return tuple(name for name, part in self.parts.items() for _ in range(len(part)))

    @property
    def sites_mm(self) -> FloatArray:
        """Where the skin is sampled, (n_sites, 2 or 3): the end organs, afferent by afferent. [mm]"""
        if self.parts:
            return np.concatenate([part.sites_mm for part in self.parts.values()])
        return self.positions_mm if self.branches is None else self.branches.sites_mm

    @cached_property
    def branches(self) -> EndOrgans | None:
        """End organs: those given, or those that the afferents have about their positions."""
        if self.ends is not None or self.positions_mm.shape[1] > 2:
            return self.ends
        return _end_organs(self.afferent, self.positions_mm)

    @property
    def kept_depths_mm(self) -> tuple[float, ...]:
        """Depths at which a press must keep quantities for these afferents, as of `indent`. [mm]"""
        several = self.parts.values() or [self]
        return tuple(sorted({part.depth_mm for part in several if part.depth_mm is not None}))

    @property
    def noise_offset_hz(self) -> float:
        """Largest offset of the noise of its afferents, as of `Afferent`. [spikes/s]"""
        several = self.parts.values() or [self]
        return max(float(getattr(part.afferent, "noise_offset_hz", 0.0)) for part in several)

    @property
    def quantities(self) -> tuple[str, str]:
        """Quantities of the dynamic and of the static term of the afferents of one type."""
        return self.afferent.dynamic_quantity, self.afferent.static_quantity

    def respond_to(
        self, traces: Traces, dynamic_window_ms: Window | None = None, static_window_ms: Window | None = None
    ) -> ResponseMap:
        """Simulate each afferent of a population of one type under known traces of `quantities`."""
        if self.parts:
            raise InputError(
                "traces", "must be of one type of afferents", remedy="give those of population[type]"
            )
        sites = self.sites_mm
        if traces.n_sites != len(sites):
            raise InputError(
                "skin.sed", "must give one trace per receptor", f"{traces.n_sites} for {len(sites)}"
            )
        if self.branches is not None:
            traces = self.branches.combined(traces)
        measure = getattr(self.afferent, "rate_measure", INTERVAL)
        windows_ms = rate_windows_ms(
            traces.phases, dynamic_window_ms, static_window_ms, traces.times_ms[-1], measure
        )
        # What an afferent follows and its gains enter as a product: scaling the one scales the others.
        spikes = self.afferent.spikes(traces if self.sensitivity is None else traces.scaled(self.sensitivity))
        return ResponseMap(
            positions_mm=self.positions_mm,
            pitch_mm=self.pitch_mm,
            spikes=spikes,
            dynamic_rate_hz=RATE_OF[measure](spikes, windows_ms[0]),
            static_rate_hz=RATE_OF[measure](spikes, windows_ms[1]),
            first_spike_latency_ms=first_spike_latency_ms(spikes, traces.onset_ms),
            duration_ms=float(traces.times_ms[-1]),
            phases=traces.phases,
            windows_ms=windows_ms,
            rate_measure=measure,
            quantity=self.afferent.static_quantity,
        )
