"""Geometry of the fingertip: x proximal -> distal, y dorsal positive, z lateral, all in mm.

The outline, the bone and the nail were read from the model that the authors' laboratory made public
later; the layer thicknesses are printed in the paper. The volar skin lies at negative y.
"""

from fingerpad.data.published import Published, Source

# fmt: off
_MODEL = Source(
    "fingertip model published later by the authors' laboratory, read at stations along x", "read")
_FIGURE_1 = Source("Gerling et al. 2014, Figure 1", "paper")

STATIONS_X = _MODEL(
    "stations of the outline along the finger",
    (0.0, 5.0, 10.0, 15.0, 17.37, 20.0, 22.0, 24.0, 26.0, 28.0, 30.0, 31.0), "mm")
VOLAR_Y = _MODEL(
    "height of the volar skin at the stations of the outline",
    (-9.70, -10.12, -10.29, -10.11, -9.85, -9.41, -9.03, -8.60, -8.04, -7.17, -5.72, -4.34), "mm")
DORSAL_Y = _MODEL(
    "height of the dorsal skin at the stations of the outline",
    (6.25, 6.16, 5.84, 5.05, 4.00, 4.00, 4.01, 3.89, 3.66, 3.23, 2.43, 1.67), "mm")
HALF_WIDTH_X = _MODEL(
    "stations of the half-width along the finger",
    (0.0, 5.0, 12.0, 15.0, 17.37, 20.0, 22.0, 24.0, 26.0, 28.0, 30.0, 31.0), "mm")
HALF_WIDTH_Z = _MODEL(
    "half-width of the finger at its stations",
    (9.52, 9.73, 9.89, 9.90, 9.75, 9.60, 9.42, 9.13, 8.59, 7.76, 6.34, 4.79), "mm")
LENGTH = _MODEL("length from the cut at the middle phalanx to the tip", 31.78, "mm")
FULL_WIDTH = _MODEL("full width of the finger", 19.84, "mm")
CONTACT_POINT = _MODEL("point of the volar midline that the laboratory indented (x, y)", (17.37, -9.85), "mm")

STRATUM_CORNEUM = _FIGURE_1("thickness of the stratum corneum", 0.371, "mm")
LIVING_EPIDERMIS = _FIGURE_1("thickness of the living epidermis", 0.100, "mm")
DERMIS = _FIGURE_1("thickness of the dermis", 1.153, "mm")
RECEPTOR_DEPTH = Published("depth of the end organs, the epidermal-dermal border", 0.471, "mm",
    "Gerling et al. 2014, section 2.1.1", "paper")

BONE_STATIONS_X = _MODEL(
    "stations of the bone along the finger", (5.0, 10.0, 15.0, 17.37, 20.0, 22.0, 24.0), "mm")
BONE_VOLAR_Y = _MODEL(
    "volar side of the bone at its stations", (-3.96, -3.42, -3.67, -4.31, -4.19, -3.50, -2.65), "mm")
BONE_DORSAL_Y = _MODEL(
    "dorsal side of the bone at its stations", (1.14, 0.52, 0.42, 0.31, 0.22, 0.05, -0.35), "mm")
SPINE_Y = Published("height of the straight axis of the bone", -2.0, "mm",
    "middle of the bone's read sides, rounded", "read")
BONE_HEIGHT = Published("semi-axis of the bone along y", 2.3, "mm",
    "half the distance of the bone's read sides, rounded", "read")
BONE_WIDTH = Published("semi-axis of the bone along z", 2.6, "mm",
    "not known; a little more than the bone's height, as in distal phalanges", "assumed")
SPINE_END_X = Published(
    "distal end of the straight axis of the bone, where its rounded cap begins", 20.0, "mm",
    "the read sides of the bone draw together from here to its tip", "read")
BONE_TIP_X = _MODEL("distal end of the bone", 25.1, "mm")

NAIL_X = _MODEL("proximal and distal end of the nail plate", (16.5, 29.25), "mm")
NAIL_THICKNESS = _MODEL("thickness of the nail plate", 0.46, "mm")
NAIL_TOP_Y = _MODEL("top of the nail plate, about", 4.5, "mm")
NAIL_HALF_WIDTH = Published("half-width of the nail plate", 6.0, "mm",
    "not known; about two thirds of the finger's half-width, as on adult fingers", "assumed")
