"""fingerpad: from a touch on the skin to spikes to a percept.

Examples
--------
>>> import fingerpad as fp
>>> skin = fp.indent(fp.Fingertip(), fp.Sphere(curvature_per_m=287), fp.RampAndHold(depth_mm=0.5))
>>> response = fp.Population.grid(density_per_cm2=100).respond(skin)
>>> len(response.spikes)
18
"""

__version__ = "0.1.0"

from fingerpad.afferent import Afferent
from fingerpad.errors import ConvergenceError, FingerpadError, InputError, MaterialWarning, StoreError
from fingerpad.fingertip import Fingertip
from fingerpad.grading import Grading
from fingerpad.indentation import Touch, indent, touch_of
from fingerpad.indenters import Bar, Cylinder, FlatPunch, Line, Plate, Sphere
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
from fingerpad.mechanics.press import PressSettings
from fingerpad.mechanics.tissues import named_tissues
from fingerpad.population import Population
from fingerpad.sampling import SkinResponse, SurfaceProfile
from fingerpad.signals import CurrentTraces, HitRates, ResponseMap, SedTraces, SpikeTrains
from fingerpad.stimulus import ForceRampAndHold, RampAndHold

__all__ = [
    "Afferent",
    "Bar",
    "ConvergenceError",
    "CurrentTraces",
    "Cylinder",
    "Energy",
    "FingerpadError",
    "Fingertip",
    "FlatPunch",
    "ForceRampAndHold",
    "Grading",
    "Hencky",
    "HitRates",
    "Hyperfoam",
    "InputError",
    "Line",
    "Material",
    "MaterialWarning",
    "Ogden",
    "Plate",
    "Polynomial",
    "Population",
    "PressSettings",
    "Prony",
    "RampAndHold",
    "ResponseMap",
    "SedTraces",
    "SkinResponse",
    "Sphere",
    "SpikeTrains",
    "StoreError",
    "SurfaceProfile",
    "Tissues",
    "Touch",
    "indent",
    "named_tissues",
    "touch_of",
]
