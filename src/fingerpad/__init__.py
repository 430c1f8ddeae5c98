"""fingerpad: from a touch on the skin to spikes to a percept.

Examples
--------
>>> import fingerpad as fp
>>> skin = fp.indent(fp.Fingertip(), fp.Sphere(curvature_per_m=287), fp.RampAndHold(depth_mm=0.5))
>>> response = fp.Population.grid(density_per_cm2=100).respond(skin)
>>> len(response.spikes)
18

Notes
-----
The public names are loaded when they are first used, so that this import takes hundredths of a second. Below
they stand three times: for people and type checkers, for `import *`, and for the loading.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

__version__ = "0.1.0"

if TYPE_CHECKING:
    from fingerpad.core.errors import (
        ConvergenceError,
        FingerpadError,
        InertiaWarning,
        InputError,
        MaterialWarning,
        StoreError,
        TissuesWarning,
    )
    from fingerpad.core.phases import Phase
    from fingerpad.core.progress import notebook_progress
    from fingerpad.core.signals import CurrentTraces, HitRates, ResponseMap, SedTraces, SpikeTrains
    from fingerpad.experiments.cluster import Cluster
    from fingerpad.experiments.descriptions.touch import TouchDescription, read_touch_description
    from fingerpad.export.dataset import read_touch, touch_dataset, write_touch
    from fingerpad.export.sweep import run_sweep
    from fingerpad.export.sweep_dataset import observe_sweep, open_sweep, setting_spikes, setting_touch
    from fingerpad.export.sweep_tables import (
        read_sweep_table,
        setting_response,
        write_sweep_spikes,
        write_sweep_table,
    )
    from fingerpad.export.touch_outputs import run_touch
    from fingerpad.export.view import save_view
    from fingerpad.export.vtu import read_vtu_series
    from fingerpad.geometry.composed import Union, ridges
    from fingerpad.geometry.dots import Dots, braille
    from fingerpad.geometry.edged_indenters import Edge, Gap, Grating
    from fingerpad.geometry.embossed import Embossed, embossed_text
    from fingerpad.geometry.fingertip import Fingertip
    from fingerpad.geometry.free_mesh import FingerMesh
    from fingerpad.geometry.grading import Grading
    from fingerpad.geometry.indenters import Bar, Cylinder, FlatPunch, Indenter, Line, Plate, Sphere
    from fingerpad.geometry.mesh_files import read_finger
    from fingerpad.geometry.motion import Cycles, ForceRampAndHold, RampAndHold
    from fingerpad.geometry.motions import chirp, repeated, sine, staircase, stroke
    from fingerpad.geometry.sampled_motions import reduced, sampled
    from fingerpad.geometry.surface import Surface, height_surface
    from fingerpad.geometry.surface_files import read_height_map, read_surface
    from fingerpad.geometry.trajectory import Trajectory
    from fingerpad.geometry.trajectory_files import read_trajectory
    from fingerpad.mechanics.materials import (
        Energy,
        Hencky,
        Hyperfoam,
        Material,
        Ogden,
        Polynomial,
        Prony,
        Tissues,
    )
    from fingerpad.mechanics.press_settings import PressSettings
    from fingerpad.mechanics.tissues import named_tissues
    from fingerpad.neuron.afferent import Afferent
    from fingerpad.neuron.afferent_stream import AfferentStream
    from fingerpad.neuron.afferent_types import PC, RA, SAI, SAII, OwnAfferent
    from fingerpad.neuron.end_organs import EndOrgans
    from fingerpad.neuron.mixed_population import MixedPopulation, MixedResponse
    from fingerpad.neuron.population import Population
    from fingerpad.reduction.building import reduce_touch
    from fingerpad.reduction.files import read_reduced, write_reduced
    from fingerpad.reduction.model import ReducedModel
    from fingerpad.reduction.streaming import ReducedSample, ReducedTouch
    from fingerpad.reduction.training import ReducedRange, ReducedTraining
    from fingerpad.report.touch import save_figure
    from fingerpad.skin.indentation import Touch, indent, touch_of
    from fingerpad.skin.sampling import SkinResponse, SurfaceProfile

__all__ = [
    "PC",
    "RA",
    "SAI",
    "SAII",
    "Afferent",
    "AfferentStream",
    "Bar",
    "Cluster",
    "ConvergenceError",
    "CurrentTraces",
    "Cycles",
    "Cylinder",
    "Dots",
    "Edge",
    "Embossed",
    "EndOrgans",
    "Energy",
    "FingerMesh",
    "FingerpadError",
    "Fingertip",
    "FlatPunch",
    "ForceRampAndHold",
    "Gap",
    "Grading",
    "Grating",
    "Hencky",
    "HitRates",
    "Hyperfoam",
    "Indenter",
    "InertiaWarning",
    "InputError",
    "Line",
    "Material",
    "MaterialWarning",
    "MixedPopulation",
    "MixedResponse",
    "Ogden",
    "OwnAfferent",
    "Phase",
    "Plate",
    "Polynomial",
    "Population",
    "PressSettings",
    "Prony",
    "RampAndHold",
    "ReducedModel",
    "ReducedRange",
    "ReducedSample",
    "ReducedTouch",
    "ReducedTraining",
    "ResponseMap",
    "SedTraces",
    "SkinResponse",
    "Sphere",
    "SpikeTrains",
    "StoreError",
    "Surface",
    "SurfaceProfile",
    "Tissues",
    "TissuesWarning",
    "Touch",
    "TouchDescription",
    "Trajectory",
    "Union",
    "braille",
    "chirp",
    "embossed_text",
    "height_surface",
    "indent",
    "named_tissues",
    "notebook_progress",
    "observe_sweep",
    "open_sweep",
    "read_finger",
    "read_height_map",
    "read_reduced",
    "read_surface",
    "read_sweep_table",
    "read_touch",
    "read_touch_description",
    "read_trajectory",
    "read_vtu_series",
    "reduce_touch",
    "reduced",
    "repeated",
    "ridges",
    "run_sweep",
    "run_touch",
    "sampled",
    "save_figure",
    "save_view",
    "setting_response",
    "setting_spikes",
    "setting_touch",
    "sine",
    "staircase",
    "stroke",
    "touch_dataset",
    "touch_of",
    "write_reduced",
    "write_sweep_spikes",
    "write_sweep_table",
    "write_touch",
]

_HOMES = {
    "geometry.composed": ("Union", "ridges"),
    "experiments.descriptions.touch": ("TouchDescription", "read_touch_description"),
    "experiments.cluster": ("Cluster",),
    "export.sweep": ("run_sweep",),
    "export.sweep_dataset": ("observe_sweep", "open_sweep", "setting_spikes", "setting_touch"),
    "export.sweep_tables": (
        "read_sweep_table",
        "setting_response",
        "write_sweep_spikes",
        "write_sweep_table",
    ),
    "export.touch_outputs": ("run_touch",),
    "export.vtu": ("read_vtu_series",),
    "geometry.dots": ("Dots", "braille"),
    "geometry.surface": ("Surface", "height_surface"),
    "geometry.surface_files": ("read_height_map", "read_surface"),
    "export.dataset": ("read_touch", "touch_dataset", "write_touch"),
    "export.view": ("save_view",),
    "neuron.afferent": ("Afferent",),
    "neuron.afferent_stream": ("AfferentStream",),
    "reduction.building": ("reduce_touch",),
    "reduction.files": ("read_reduced", "write_reduced"),
    "reduction.model": ("ReducedModel",),
    "reduction.streaming": ("ReducedSample", "ReducedTouch"),
    "reduction.training": ("ReducedRange", "ReducedTraining"),
    "neuron.afferent_types": ("PC", "RA", "SAI", "SAII", "OwnAfferent"),
    "neuron.end_organs": ("EndOrgans",),
    "neuron.mixed_population": ("MixedPopulation", "MixedResponse"),
    "geometry.edged_indenters": ("Edge", "Gap", "Grating"),
    "geometry.embossed": ("Embossed", "embossed_text"),
    "core.errors": (
        "ConvergenceError",
        "FingerpadError",
        "InertiaWarning",
        "InputError",
        "MaterialWarning",
        "StoreError",
        "TissuesWarning",
    ),
    "geometry.fingertip": ("Fingertip",),
    "geometry.free_mesh": ("FingerMesh",),
    "geometry.mesh_files": ("read_finger",),
    "geometry.grading": ("Grading",),
    "skin.indentation": ("Touch", "indent", "touch_of"),
    "geometry.indenters": ("Bar", "Cylinder", "FlatPunch", "Indenter", "Line", "Plate", "Sphere"),
    "mechanics.materials": (
        "Energy",
        "Hencky",
        "Hyperfoam",
        "Material",
        "Ogden",
        "Polynomial",
        "Prony",
        "Tissues",
    ),
    "mechanics.press_settings": ("PressSettings",),
    "mechanics.tissues": ("named_tissues",),
    "neuron.population": ("Population",),
    "report.touch": ("save_figure",),
    "skin.sampling": ("SkinResponse", "SurfaceProfile"),
    "core.signals": ("CurrentTraces", "HitRates", "ResponseMap", "SedTraces", "SpikeTrains"),
    "geometry.motion": ("Cycles", "ForceRampAndHold", "RampAndHold"),
    "geometry.motions": ("chirp", "repeated", "sine", "staircase", "stroke"),
    "core.phases": ("Phase",),
    "core.progress": ("notebook_progress",),
    "geometry.sampled_motions": ("reduced", "sampled"),
    "geometry.trajectory": ("Trajectory",),
    "geometry.trajectory_files": ("read_trajectory",),
}
"""Public names by the module that defines them."""

_HOME = {name: module for module, names in _HOMES.items() for name in names}

# Hidden from type checkers, to which it would mean that any name is there.
if not TYPE_CHECKING:

    def __getattr__(name: str) -> Any:
        """Fetch a public name when it is first used: Numba and SciPy take most of a second to load."""
        if name not in _HOME:
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
        value = getattr(import_module(f"{__name__}.{_HOME[name]}"), name)
        globals()[name] = value
        return value


def __dir__() -> list[str]:
    """Names of the module, those not fetched yet included."""
    return sorted({*globals(), *__all__})
