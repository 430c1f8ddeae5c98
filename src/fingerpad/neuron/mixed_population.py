"""Afferents of several types in one skin, at the published densities or others, and their common response."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np

from fingerpad.core.checked import checked, value_class
from fingerpad.core.displayed import Result
from fingerpad.core.errors import InputError
from fingerpad.core.layouts import Place
from fingerpad.core.random_streams import seed_of
from fingerpad.core.signals import ResponseMap, Skin, SpikeTrains, traces_below
from fingerpad.core.values import Finite, FloatArray, NotNegativeWhole, positive
from fingerpad.data import afferents as published
from fingerpad.data.tissues import DEFAULT_TISSUES
from fingerpad.neuron.afferent import AnyAfferent, checked_afferent
from fingerpad.neuron.afferent_types import PC, RA, SAI, SAII
from fingerpad.neuron.population import Population, sensitivities
from fingerpad.neuron.spikes import Window

if TYPE_CHECKING:
    from fingerpad.core.regions import Region

PUBLISHED_DENSITIES: Mapping[str, float] = MappingProxyType(
    dict(zip(published.TYPES, published.DENSITIES.value, strict=True))
)
"""Densities in the human fingertip. [1/cm2]"""


def types_of_afferents(tissues: object = DEFAULT_TISSUES) -> dict[str, AnyAfferent]:
    """Return the four types with their default parameters, by their names: the one table of types."""
    return dict(zip(published.TYPES, (SAI.for_tissues(tissues), RA(), PC(), SAII()), strict=True))


@checked
def one_map(response: ResponseMap | MixedResponse) -> ResponseMap:
    """Return responses as one map, with the types of a mixed population."""
    return response.joined if isinstance(response, MixedResponse) else response


@value_class
class MixedResponse(Result):
    """Responses of a mixed population to one touch.

    Parameters
    ----------
    maps : mapping of str to ResponseMap
        One per type.

    Examples
    --------
    `response["RA"].spikes` are the spikes of the RA afferents, `for name in response` goes through the types.
    """

    maps: Mapping[str, ResponseMap]

    def __repr__(self) -> str:
        counts = {name: each.spike_count for name, each in self.maps.items()}
        parts = (f"{np.count_nonzero(n)} of {n.size} {name} fire {n.sum()}" for name, n in counts.items())
        return f"MixedResponse({', '.join(parts)} spikes)"

    def __getitem__(self, name: str) -> ResponseMap:
        if name not in self.maps:
            raise InputError("type", f"must be one of {', '.join(self.maps)}", repr(name))
        return self.maps[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self.maps)

    def __len__(self) -> int:
        return len(self.maps)

    @property
    def spikes(self) -> SpikeTrains:
        """Spikes of all afferents, type after type."""
        return SpikeTrains.joined([each.spikes for each in self.maps.values()])

    @property
    def types(self) -> np.ndarray:
        """Type of each of these afferents, (n_afferents,)."""
        return np.repeat(list(self.maps), [len(each.spikes) for each in self.maps.values()])

    @property
    def positions_mm(self) -> FloatArray:
        """Position of each of these afferents, (n_afferents, 2 or 3). [mm]"""
        return np.concatenate([each.positions_mm for each in self.maps.values()])

    @property
    def joined(self) -> ResponseMap:
        """One map of all afferents, type after type, with the type of each; its pitch is the smallest."""
        maps = list(self.maps.values())
        measures: dict[str, Any] = {
            name: np.concatenate([each.measures[name] for each in maps]) for name in maps[0].measures
        }
        return replace(
            maps[0],
            positions_mm=self.positions_mm,
            pitch_mm=min(each.pitch_mm for each in maps),
            spikes=self.spikes,
            types=tuple(self.types.tolist()),
            **measures,
        )

    @classmethod
    def of(cls, response: ResponseMap) -> MixedResponse:
        """Part a map by the types of its afferents, as `joined` made it."""
        if not response.types:
            raise InputError("MixedResponse needs the type of each afferent: got a response without types.")
        known = types_of_afferents()
        parts = {
            name: replace(
                part,
                rate_measure=getattr(known.get(name), "rate_measure", part.rate_measure),
                quantity=getattr(known.get(name), "static_quantity", part.quantity),
            )
            for name, part in response.by_type.items()
        }
        return cls(MappingProxyType(parts))


@value_class
class MixedPopulation:
    """Populations of several types in the same skin.

    Parameters
    ----------
    parts : mapping of str to Population
        One per type, by any name.

    Examples
    --------
    >>> from fingerpad.core.regions import Ellipse
    >>> pad = Ellipse(5.0, 5.0, centre_mm=(17.37, 0.0))
    >>> population = MixedPopulation.at_densities(pad, seed=1)
    >>> {name: len(part) for name, part in population.parts.items()}
    {'SAI': 55, 'RA': 110, 'PC': 16, 'SAII': 8}
    """

    parts: Mapping[str, Population]

    def __post_init__(self) -> None:
        if not self.parts:
            raise InputError("MixedPopulation needs at least one Population: got none.")
        object.__setattr__(self, "parts", MappingProxyType(dict(self.parts)))

    def __repr__(self) -> str:
        return f"MixedPopulation({', '.join(f'{len(part)} {name}' for name, part in self.parts.items())})"

    def __len__(self) -> int:
        return sum(len(part) for part in self.parts.values())

    @property
    def types(self) -> tuple[str, ...]:
        """Type of each afferent, type after type."""
        return tuple(name for name, part in self.parts.items() for _ in range(len(part)))

    @property
    def pitch_mm(self) -> float:
        """Smallest pitch of the types. [mm]"""
        return min(part.pitch_mm for part in self.parts.values())

    @property
    def positions_mm(self) -> FloatArray:
        """Position of each afferent, type after type, (n_afferents, 2 or 3). [mm]"""
        return np.concatenate([part.positions_mm for part in self.parts.values()])

    @property
    def sites_mm(self) -> FloatArray:
        """Where the skin is sampled, type after type, (n_sites, 2 or 3). [mm]"""
        return np.concatenate([part.sites_mm for part in self.parts.values()])

    @property
    def sensitivity(self) -> FloatArray | None:
        """Factor of each afferent on what it follows; None if all are equal. [1]"""
        given = [part.sensitivity for part in self.parts.values()]
        if all(factors is None for factors in given):
            return None
        parts = zip(given, self.parts.values(), strict=True)
        return np.concatenate([np.ones(len(part)) if some is None else some for some, part in parts])

    @classmethod
    def at_densities(
        cls,
        region: Region,
        densities_per_cm2: Mapping[str, float] | None = None,
        afferents: Mapping[str, AnyAfferent] | None = None,
        place: Place | None = None,
        spread: Finite = 0.0,
        seed: NotNegativeWhole = 0,
    ) -> MixedPopulation:
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
            From the plane to points of the skin, as in `Population.of_layout`.
        spread : float, optional
            Standard deviation of the logarithm of the sensitivity, as in `sensitivities`; 0 for equal ones.
        seed : int, optional
            Seed of positions and sensitivities. Each type has random numbers of its own.

        Examples
        --------
        >>> from fingerpad.core.regions import Rectangle
        >>> square = Rectangle(10.0, 10.0, centre_mm=(17.0, 0.0))
        >>> len(MixedPopulation.at_densities(square, {"RA": 140.0, "PC": 20.0}))
        160
        """
        # Files of touches load this module, and only a layout at random needs that one.
        from fingerpad.core.patterns import poisson_disc

        if not hasattr(region, "area_mm2"):
            raise InputError(
                "region", "must be one of fingerpad.core.regions or UnrolledSkin(finger).pad()", repr(region)
            )
        known = types_of_afferents() | dict(afferents or {})
        parts = {}
        densities = PUBLISHED_DENSITIES if densities_per_cm2 is None else densities_per_cm2
        for number, (name, density) in enumerate(densities.items()):
            if name not in known:
                raise InputError(
                    f"densities_per_cm2 has type {name!r} without an afferent: the types are "
                    f"{', '.join(known)}; give one in afferents={{{name!r}: ...}}."
                )
            positive(f"densities_per_cm2[{name!r}] of a type that is not left out", density, "1/cm2")
            afferent = checked_afferent(known[name])
            layout = poisson_disc(region, density, seed=seed_of(seed, number))
            unequal = sensitivities(len(layout), spread, seed_of(seed, number)) if spread else None
            parts[name] = Population.of_layout(layout, place, afferent, unequal)
        return cls(parts)

    def respond(
        self, skin: Skin, dynamic_window_ms: Window | None = None, static_window_ms: Window | None = None
    ) -> MixedResponse:
        """Sample the skin at every afferent and simulate all of them.

        Parameters
        ----------
        skin, dynamic_window_ms, static_window_ms
            As in `Population.respond`.
        """
        windows = dynamic_window_ms, static_window_ms
        maps: dict[str, ResponseMap] = {}
        # Afferents that follow the same quantities are sampled at once.
        parts = {name: part.on(skin) for name, part in self.parts.items()}
        kinds = {name: (part.quantities, part.sites_mm.shape[1]) for name, part in parts.items()}
        for kind in dict.fromkeys(kinds.values()):
            quantities, some = kind[0], {name: parts[name] for name in kinds if kinds[name] == kind}
            traces = traces_below(
                skin, np.concatenate([part.sites_mm for part in some.values()]), *quantities
            )
            start = 0
            for name, part in some.items():
                maps[name] = part.respond_to(traces.part(slice(start, start + len(part.sites_mm))), *windows)
                start += len(part.sites_mm)
        return MixedResponse(MappingProxyType({name: maps[name] for name in self.parts}))
