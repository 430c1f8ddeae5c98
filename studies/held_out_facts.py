"""Published facts with which predictions are compared that no search and no fit has used."""

from __future__ import annotations

from fingerpad.data.published import Published, Source

_CURVATURE = Source("Goodwin, Macefield & Bisley 1997, abstract; human SAI afferents", "read")
SPHERE_CURVATURES = _CURVATURE("curvatures of the applied spheres", (0.0, 80.6, 172.0, 340.0, 694.0), "1/m")
SPHERE_FORCES = Published(
    "forces of the applied spheres",
    (0.392, 0.588, 0.785),
    "N",
    f"{_CURVATURE.text}: 40, 60 and 80 g-weight",
    "read",
)

_DECLINE = Source("Journal of Neuroscience 3(12), 2652, 1983, abstract; 21 monkey afferents", "read")
DECLINE_DEPTHS = _DECLINE("depths of the steady indentation", (0.65, 1.3), "mm")
DECLINES = _DECLINE("mean decline of the rate in the first 12 s of it", (0.38, 0.36), "1")
DECLINE_SPEED = _DECLINE("speed of the indentation", 0.4, "mm/s")
DECLINE_TIME = _DECLINE("time of the decline", 12.0, "s")
DECLINE_PROBE = Published(
    "diameter of the flat probe of the steady indentation", 2.0, "mm", "not in the abstract", "assumed"
)

VOLUME_CHANGE = Published(
    "largest decrease of the volume of an indented fingertip, about",
    0.05,
    "1",
    "Srinivasan, Gulati & Dandekar 1992, as told on the pages of the MIT Touch Lab",
    "read",
)

_GRATINGS = Source("Bensmaia, Craig, Yoshioka & Johnson 2006, abstract; monkey SA1 afferents", "read")
GRATINGS = _GRATINGS("orientations of the gratings: across and along the finger", (0.0, 90.0), "degrees")

FINEST_GRATING = Published(
    "width of the finest grooves that SAI afferents resolve, about",
    0.5,
    "mm",
    "Phillips & Johnson 1981 II and later reviews; monkey SAI afferents",
    "recalled",
)
GAP_THRESHOLD = Published(
    "gap that people detect in 75 % of trials", 0.87, "mm", "Johnson & Phillips 1981, summary", "read"
)
