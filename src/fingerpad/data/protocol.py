"""Protocol of the experiments: stimuli, motion and time windows."""

from fingerpad.data.published import Published, Source

_PROTOCOL = "Gerling et al. 2014, section 2.2.2"
# fmt: off
_MECHANICS = Source("Gerling et al. 2014, section 2.2.1", "paper")
_SPHERES = Source("Gerling et al. 2014, section 2.2.3", "paper")

RAMP = Published("duration of the ramp", 50.0, "ms", _PROTOCOL, "paper")
HOLD = Published("duration of the hold", 950.0, "ms", _PROTOCOL, "paper")
DEPTH = Published("depth of indentation", 1.0, "mm", _PROTOCOL, "paper")
DYNAMIC_WINDOW = Published("window of the dynamic firing rate", (30.0, 50.0), "ms", _PROTOCOL, "paper")
STATIC_WINDOW = Published("window of the static firing rate", (600.0, 950.0), "ms", _PROTOCOL, "paper")
FASTEST = Published("speed that no indenter exceeds", 10.0, "m/s",
    "a hand in a blow, and about as fast as shear waves in soft tissue; beyond it a unit is wrong", "assumed")

BAR_WIDTH = Published("width of the bar", 3.0, "mm", _PROTOCOL, "paper")
BAR_FILLET = Published("fillet radius of the bar's edges", 0.3, "mm",
    "later bar model of the authors' laboratory", "read")
GAP_WIDTH = Published("width of a gap", 1.0, "mm", "above the 0.87 mm that people find in 3 of 4", "assumed")
GAPPED_BAR_WIDTH = Published("full width of a bar with a gap", 8.0, "mm",
    "Johnson & Phillips 1981 kept it the same and much larger than the gaps", "assumed")
LIP_RADIUS = Published("radius of the lips of a gap or groove", 0.2, "mm",
    "as small as the elements of a quick mesh across an edge, about which sharper lips tear their skin",
    "assumed")
RIDGE_WIDTH = Published("width of the ridges and grooves of a grating", 1.5, "mm",
    "within what people can feel", "assumed")
BAR_SHIFTS = Published(
    "lateral positions of the bar relative to the receptor",
    tuple(round(-3.5 + 0.2 * step, 1) for step in range(36)), "mm",
    _PROTOCOL + ": 36 shifts in steps of 0.2 mm; first and last as in the recordings it is fitted to",
    "paper")

LINE_DIAMETER = _MECHANICS("diameter of the line load", 0.05, "mm")
CYLINDER_DIAMETER = _MECHANICS("diameter of the cylinder", 3.17, "mm")
DEFLECTION_SPACING = _MECHANICS("spacing of the imaged skin surface", 0.05, "mm")

PUNCH_DIAMETER = Published("diameter of the flat punch", 6.35, "mm",
    "a quarter of an inch, the usual flat probe of compression studies on the finger pad", "assumed")
STANDARD_CURVATURE = _SPHERES("curvature of the standard sphere", 287.0, "1/m")

SPHERE_POSITIONS = _SPHERES(
    "positions of the spheres along the finger, relative to the first", (0.0, 0.2), "mm")

DYNAMIC_WEIGHT = Published("weight of the dynamic rates in the fractional sum of squares", 0.25, "1",
    _PROTOCOL + ", Eq. 12: a third of the static weight; the two add up to 1", "paper")
STATIC_WEIGHT = Published("weight of the static rates in the fractional sum of squares", 0.75, "1",
    _PROTOCOL + ", Eq. 12: three times the dynamic weight; the two add up to 1", "paper")
FOLDS = Published("folds of the cross validation", 6.0, "1", _PROTOCOL, "paper")
