"""The afferents of a request: their type and numbers, where they end in the skin, and how they respond."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TypeAlias, cast

import numpy as np
from pydantic import BeforeValidator, Discriminator, Field, Strict, Tag

from fingerpad.core.errors import InputError, Place, StoreError, shown
from fingerpad.core.files import read_text
from fingerpad.core.random_streams import seed_of
from fingerpad.core.regions import PATTERNS, Layout
from fingerpad.core.signals import ResponseMap, Skin
from fingerpad.core.values import (
    Count,
    Finite,
    IntArray,
    NotNegative,
    Pair,
    Positive,
    Seed,
    Share,
    Text,
    choice,
)
from fingerpad.data import psychophysics
from fingerpad.data.afferents import TYPES
from fingerpad.data.tissues import DEFAULT_TISSUES
from fingerpad.experiments import schemas
from fingerpad.experiments.requests.parts import (
    NAMED,
    OBJECT,
    SPELLED,
    Part,
    at,
    object_of_python,
    with_message,
)
from fingerpad.geometry.fingertip import Finger, Fingertip
from fingerpad.mechanics.materials import Tissues
from fingerpad.neuron.afferent import EXTENSIONS, PARAMETER_NAMES, Afferent, AnyAfferent, checked_afferent
from fingerpad.neuron.afferent_types import OwnAfferent, afferent_of, afferent_types
from fingerpad.neuron.escape_rate import EscapeRate
from fingerpad.neuron.population import Population, sensitivities
from fingerpad.neuron.spikes import Windows
from fingerpad.psychophysics.encoding import neighbours_of
from fingerpad.skin.fields import sampled_fields

DEFAULT = "default"  # Value of `afferent` for the one that was fitted with the tissues.

GRID = "grid"
NAIL_ROWS = "nail rows"
LAYOUT_NAMES = (GRID, *PATTERNS, NAIL_ROWS)
PAD = "pad"
SHAPES = ("rectangle", "ellipse", "polygon", PAD)


class RegionSettings(Part):
    """Part of the skin that afferents lie in, unrolled; an area there is the same area of skin."""

    shape: Annotated[str, choice(SHAPES)]  #: Kind of shape.
    length_mm: Positive | None = None
    width_mm: Positive | None = None  #: Extent of a rectangle or an ellipse along the finger and across. [mm]
    corners_mm: Annotated[tuple[Pair, ...], Strict(False)] | None = None
    """Of a polygon: along the finger, distal positive, and across, from the middle of the pad. [mm]"""


class PopulationSettings(Part):
    """The afferents."""

    layout: Annotated[str, choice(LAYOUT_NAMES)] = GRID
    """"grid": the paper's rows and columns; a pattern that fills a region; or "nail rows", along the edge of
    the nail."""
    density_per_cm2: Positive = psychophysics.RECEPTOR_DENSITY.value  #: Afferents per area of skin. [1/cm2]
    densities_per_cm2: (
        Annotated[
            dict[Annotated[str, choice(TYPES)], Positive],
            Field(min_length=1),
            with_message(f"a density above 0 of each type, {', '.join(TYPES)}"),
        ]
        | None
    ) = None
    """Instead of one density, that of each type of a mixed population, which all have this layout. [1/cm2]"""
    rows: Count | None = None
    columns: Count | None = None
    """Of a grid: along the finger and across, the paper's by default; or how many rows along the nail."""
    region: RegionSettings | None = None  #: What any other layout fills.
    depth_mm: Positive | None = None
    """Depth of the end organs below the skin; the border of epidermis and dermis by default. [mm]"""
    offset_mm: Pair = (0.0, 0.0)
    """Middle of grid, rectangle or ellipse from the middle of the pad, along the finger and across. [mm]"""
    jitter: NotNegative | None = None
    """Displacement of afferents in a jittered layout: standard deviation over the pitch."""
    separation: NotNegative | None = None  #: Least distance in a Poisson-disc layout over 1/sqrt(density).
    seed: Seed = 0  #: Of random places and sensitivities; another one is another finger.
    sensitivity_spread: NotNegative = 0.0
    """How much afferents differ in their gains, as of `fingerpad.neuron.population.sensitivities`."""


class AfferentSettings(Part):
    """The afferent by its numbers; what is absent is as in the afferent of the tissues."""

    intercept_ma: Finite | None = None
    dynamic_gain: Finite | None = None
    static_gain: Finite | None = None
    time_constant_ms: Positive | None = None
    capacitance_mf: Positive | None = None
    threshold_mv: Positive | None = None  #: As of `fingerpad.Afferent`.
    refractory_ms: NotNegative | None = None  #: Rest after each spike. [ms]
    dynamic_quantity: Annotated[str, choice(sampled_fields())] | None = None
    static_quantity: Annotated[str, choice(sampled_fields())] | None = None  #: What the two terms follow.
    adapting_share: Share | None = None
    adapting_ms: Positive | None = None
    saturation_per_ma: NotNegative | None = None
    end_organs: Count | None = None
    reach_mm: NotNegative | None = None
    noise_offset_hz: NotNegative | None = None  #: As of `fingerpad.Afferent`.


def _form_of_afferent(value: Any) -> str:
    if isinstance(value, str):
        return NAMED
    return SPELLED if isinstance(value, dict | AfferentSettings) else OBJECT


if TYPE_CHECKING:
    AfferentChoice: TypeAlias = Any
    OwnPopulation: TypeAlias = Any
else:
    OwnPopulation = object_of_python(Population)
    AfferentChoice = Annotated[
        Annotated[Text, Tag(NAMED)]
        | Annotated[AfferentSettings, Tag(SPELLED)]
        | Annotated[object_of_python(AnyAfferent), Tag(OBJECT)],
        Discriminator(_form_of_afferent),
    ]
"""The default, a type of afferents by its name, a file of results, numbers, or an afferent of Python."""


class RateWindowSettings(Part):
    """Windows in which spikes count."""

    dynamic: Pair | None = None
    static: Pair | None = None
    """Start and end of the windows of the two rates; without them they follow the phases. [ms]"""

    @property
    def both(self) -> tuple[tuple[float, float] | None, tuple[float, float] | None]:
        """The dynamic and the static window."""
        return self.dynamic, self.static


class AfferentsSettings(PopulationSettings):
    """The afferents that respond."""

    afferent: AfferentChoice = DEFAULT
    """"default", the one that was fitted with the tissues; a type by its name, SAI, RA, PC or SAII; a file of
    results (`fit.json` of `fingerpad fit`, `results.json` of `fingerpad reproduce`); or numbers."""
    population: OwnPopulation | None = None
    """In Python, or by module:object: a population instead of a layout and an afferent."""
    noise: NotNegative = 0.0
    """Width of a soft threshold over the threshold: spikes are random, drawn with `seed`. 0 is a sharp
    threshold without randomness."""
    windows_ms: RateWindowSettings = RateWindowSettings()  #: When spikes count.


AFFERENT_OBJECTS = ("afferents", "afferents.afferent", "afferents.population")
"""Keys of a request with a block `afferents` that may name an object."""


def as_settings(value: Any) -> Any:
    """Return the block of a population, or of an afferent, that is given in the place of the block."""
    if isinstance(value, Population):
        return {"population": value}
    return value if isinstance(value, dict | Part) else {"afferent": value}


Afferents = Annotated[AfferentsSettings, BeforeValidator(as_settings)]
"""The block `afferents` of a request, or a population, or an afferent."""


def file_of(chosen: Any) -> str | None:
    """Name of the file of results that an afferent is read from; None if it is from none."""
    return chosen if isinstance(chosen, str) and chosen not in (DEFAULT, *TYPES) else None


def files_of(chosen: Any, beside: Path) -> list[Path]:
    """Files that an afferent is read from, from the folder `beside`: one or none."""
    file = file_of(chosen)
    return [] if file is None else [beside / file]


def chosen_afferent(chosen: Any, tissues: str | Tissues, beside: Path = Path()) -> AnyAfferent:
    """Make the afferent of a request."""
    fitted = Afferent.for_tissues(tissues)
    if not isinstance(chosen, AfferentSettings | str):
        return checked_afferent(chosen)
    if isinstance(chosen, AfferentSettings):
        return replace(fitted, **chosen.given)
    if file := file_of(chosen):
        return fitted_afferent(Path(beside) / file, tissues)
    return fitted if chosen == DEFAULT else afferent_of(chosen, tissues)


_OF_LAYOUT = {
    "rows": (GRID, NAIL_ROWS),
    "columns": (GRID,),
    "region": PATTERNS,
    "offset_mm": (GRID, *PATTERNS),
    "jitter": ("jittered",),
    "separation": ("poisson-disc",),
}


def population_of(
    settings: AfferentsSettings,
    tissues: str | Tissues,
    beside: Path = Path(),
    finger: Finger | None = None,
    place: Place = ("afferents",),
) -> Population:
    """Lay out the afferents of a request."""
    if settings.population is not None:
        of_layout = set(AfferentsSettings.model_fields) - {"population", "noise", "windows_ms", "seed"}
        for key in sorted(of_layout & set(settings.given)):
            raise InputError((*place, key), "must not be given beside a population", remedy="leave it out")
        found = cast(Population, settings.population)
    else:
        for key, layouts in _OF_LAYOUT.items():
            if key in settings.given and settings.layout not in layouts:
                belongs = f"it belongs to the layout {' or '.join(layouts)}, not to {settings.layout}"
                raise InputError((*place, key), "must not be given", remedy=belongs)
        with at(*place, "afferent"):
            afferent = chosen_afferent(settings.afferent, tissues, beside)
        if settings.densities_per_cm2 is None:
            found = _laid(settings, afferent, place, finger)
        else:
            found = _mixed(settings, settings.densities_per_cm2, afferent, tissues, place, finger)
    _check_noise(settings, found, place)
    return found


def _mixed(
    settings: AfferentsSettings,
    densities_per_cm2: dict[str, float],
    afferent: AnyAfferent,
    tissues: str | Tissues,
    place: Place,
    finger: Finger | None,
) -> Population:
    """Lay out the afferents of several types."""
    chosen, types = settings.afferent, afferent_types(tissues)
    if "density_per_cm2" in settings.given or (isinstance(chosen, str) and chosen in TYPES):
        words = "must have density_per_cm2 and the type of one afferent, or densities_per_cm2 of several"
        raise InputError(place or "afferents", words, "both", "leave one out")
    if not (isinstance(chosen, str) and chosen == DEFAULT):
        types["SAI"] = afferent
    parts = {}
    for number, (name, density) in enumerate(densities_per_cm2.items()):
        one = {"density_per_cm2": density, "seed": seed_of(settings.seed, number)}
        parts[name] = _laid(settings.model_copy(update=one), types[name], place, finger)
    return Population.mixed(parts)


def _laid(
    settings: PopulationSettings, afferent: AnyAfferent, place: Place, finger: Finger | None
) -> Population:
    """Lay out the afferents of one type."""
    finger = finger or Fingertip()
    if settings.layout == GRID:
        (x, z), (along, across) = finger.contact_mm, settings.offset_mm
        rows_columns = settings.chosen("rows", "columns")
        centre_mm = (x + along, z + across)
        laid = Population.grid(
            settings.density_per_cm2, **rows_columns, centre_mm=centre_mm, afferent=afferent
        )
    elif not isinstance(finger, Fingertip):
        words = "must be grid on a mesh, whose skin has no plane"
        raise InputError((*place, "layout"), words, settings.layout)
    elif settings.layout == NAIL_ROWS:
        # Only what needs it loads the module that unrolls the skin.
        from fingerpad.skin.unrolled_skin import NailEdge

        nail = NailEdge(finger)
        with at(*place):
            rows = nail.rows(settings.rows or 1, settings.density_per_cm2)
        laid = Population.of_layout(rows, nail.points, afferent)
    else:
        laid = Population.of_layout(*_in_region(settings, place, finger), afferent)
    laid = replace(laid, depth_mm=settings.depth_mm)
    if settings.sensitivity_spread == 0.0:
        return laid
    return replace(laid, sensitivity=sensitivities(len(laid), settings.sensitivity_spread, settings.seed))


def _in_region(settings: PopulationSettings, place: Place, finger: Fingertip) -> tuple[Layout, Any]:
    """Pattern in a region of the unrolled skin, and what places its points on the skin."""
    from fingerpad.core import regions
    from fingerpad.skin.unrolled_skin import UnrolledSkin

    if settings.region is None:
        missing = f"must be given for the layout {settings.layout}"
        raise InputError((*place, "region"), missing, remedy="it is missing")
    skin, density, seed = UnrolledSkin(finger), settings.density_per_cm2, settings.seed
    region = _region(settings.region, settings.offset_mm, skin, (*place, "region"))
    with at(*place):
        if settings.layout == "rectangular":
            layout = regions.rectangular(region, density)
        elif settings.layout == "hexagonal":
            layout = regions.hexagonal(region, density)
        elif settings.layout == "uniform":
            layout = regions.uniform(region, density, seed)
        elif settings.layout == "jittered":
            layout = regions.jittered(region, density, seed, **settings.chosen("jitter"))
        else:
            apart = settings.chosen("separation")
            layout = regions.poisson_disc(region, density, seed, **apart, place=skin.points)
    return layout, skin.points


_OF_SHAPE = {
    "rectangle": ("length_mm", "width_mm"),
    "ellipse": ("length_mm", "width_mm"),
    "polygon": ("corners_mm",),
    PAD: (),
}


def _region(settings: RegionSettings, offset_mm: tuple[float, ...], skin: Any, place: Place) -> Any:
    """Part of the unrolled skin that is meant."""
    from fingerpad.core.regions import Ellipse, Polygon, Rectangle

    shape, wanted, given = settings.shape, _OF_SHAPE[settings.shape], set(settings.given) - {"shape"}
    for key in wanted:
        if key not in given:
            raise InputError((*place, key), f"must be given for a {shape}", remedy="it is missing")
    for key in sorted(given - set(wanted)):
        sizes = ", ".join(wanted) or "no size"
        raise InputError((*place, key), "must not be given", remedy=f"a {shape} has {sizes}")
    along, across = offset_mm
    length, width = settings.length_mm or 0.0, settings.width_mm or 0.0
    with at(*place):
        if shape == PAD:
            return skin.pad()
        if shape == "polygon":
            return Polygon(tuple((along + x, across + z) for x, z in settings.corners_mm or ()))
        if shape == "ellipse":
            return Ellipse(0.5 * length, 0.5 * width, (along, across))
        return Rectangle(length, width, (along, across))


def population_neighbours(settings: AfferentsSettings, population: Population) -> IntArray:
    """Return who is whose neighbour in a population that was laid out by `settings`, (n_pairs, 2).

    Afferents of a mixed population have neighbours of their own type.
    """
    if population.parts:
        parts = list(population.parts.values())
        pairs = [population_neighbours(settings, part) for part in parts]
        starts = np.cumsum([0, *map(len, parts)])[:-1]
        return np.concatenate([start + own for start, own in zip(starts, pairs, strict=True)])
    places = np.asarray(population.places_mm)
    if settings.population is not None:  # it may have any layout
        lattice = neighbours_of(places, population.pitch_mm, "rectangular")
        return lattice if len(lattice) else neighbours_of(places, population.pitch_mm, "poisson-disc")
    pattern = "rectangular" if settings.layout in (GRID, NAIL_ROWS) else settings.layout
    return neighbours_of(places, population.pitch_mm, pattern)


def check_windows(windows_ms: Windows, end_ms: float, of: str = "the touch") -> None:
    """Raise `InputError` unless both windows of the rates lie within a touch."""
    for key, (start, end) in zip(("dynamic", "static"), windows_ms, strict=True):
        if not 0.0 <= start < end:
            words, came = "must be a start from 0 on and a later end", f"{start:g}, {end:g}"
            raise InputError(("windows_ms", key), words, came)
        if end > end_ms:
            words, came = f"must end with the stimuli, not at {end:g} ms", f"{of} ends at {end_ms:g} ms"
            raise InputError(("windows_ms", key), words, remedy=came)


CHOSEN = "fingerpad fit of chosen numbers"  # Format of a fit of some numbers of one type.


def fitted_afferent(path: Path, tissues: str | Tissues = DEFAULT_TISSUES) -> AnyAfferent:
    """Afferent of a file of results: `fit.json`, or `results.json` of a reproduction."""
    try:
        read_text(path)  # names a file that cannot be read
        values = schemas.read(path, "fingerpad fit", CHOSEN, "fingerpad reproduction")
        if "fitted" in values:
            return afferent_of(values["type"], tissues, **values["fitted"])
        column = "human" if tissues == "human" else "paper"
        fitted = values["fit"] if "fit" in values else values[column]["single_unit"]
        named = values if "fit" in values else fitted
        parameters = [fitted["parameters"][name] for name in PARAMETER_NAMES]
        others = {name: named[name] for name in ("dynamic_quantity", "static_quantity")}
    except StoreError as error:
        raise InputError(str(error)) from error
    except (LookupError, TypeError) as error:
        raise InputError(
            f"{path} must hold the parameters of a fit: {shown(error.args[0])} is missing there."
        ) from error
    own = Afferent.for_tissues(tissues)
    if "fit" not in values and all(getattr(own, name) == followed for name, followed in others.items()):
        # A reproduction fits the afferent of its tissues with its end organs and its adaptation.
        others |= {name: getattr(own, name) for name in EXTENSIONS}
    try:
        return Afferent.from_parameters(parameters, **others, initial_mv=named.get("initial_mv"))
    except InputError as error:
        raise InputError(f"{path}: {error}") from error


def respond_to(
    settings: AfferentsSettings, population: Population, skin: Skin, windows_ms: Windows | None = None
) -> ResponseMap:
    """Responses of afferents to a skin, random if they have noise."""
    windows = windows_ms or settings.windows_ms.both
    if settings.noise == 0.0:
        return population.respond(skin, *windows)
    afferent = cast(Afferent, population.afferent)
    membrane = EscapeRate(afferent.membrane, settings.noise)
    noisy = OwnAfferent(
        lambda traces: membrane.spikes(afferent.current(traces), settings.seed),
        dynamic_quantity=afferent.dynamic_quantity,
        static_quantity=afferent.static_quantity,
    )
    there = population.on(skin)
    return replace(there, afferent=noisy, ends=there.branches).respond(skin, *windows)


def parameters_of(population: Population) -> dict[str, float | str]:
    """Parameters of the afferents by name, with the type in a mixed population; a function by its name."""
    found: dict[str, float | str] = {}
    for kind, part in population.parts.items() or [("", population)]:
        for name in getattr(part.afferent, "__dataclass_fields__", ()):
            value = getattr(part.afferent, name)
            if value is not None:
                plain = isinstance(value, float | int | str)
                shown_as = value if plain else getattr(value, "__qualname__", repr(value))
                found[f"{kind}.{name}" if kind else name] = shown_as
    return found


def _check_noise(settings: AfferentsSettings, population: Population, place: Place) -> None:
    """Raise `InputError` if a soft threshold is asked for afferents that have none."""
    afferent = None if population.parts else population.afferent
    plain = isinstance(afferent, Afferent) and afferent.smoothing_ms == 0.0
    if settings.noise > 0.0 and not plain:
        words = "must be 0 for other types and mixed populations, because a soft threshold is that of "
        raise InputError((*place, "noise"), words + "the default afferent alone", f"{settings.noise:g}")
