"""Results that the paper reports, for comparison only; no computation uses them."""

from fingerpad.data.published import Published

_ABSTRACT = "Gerling et al. 2014, abstract and section 4"
_FIT = "Gerling et al. 2014, section 3.2"
_TABLE_4 = "Gerling et al. 2014, section 3.2 and caption of Table 4"

FSS_OUT_OF_SAMPLE = Published(
    "fractional sum of squares, mean over the six testing sets", 0.81, "1", _ABSTRACT, "paper"
)
FOLD_3_FSS_START = Published("fold 3, start 2: FSS before the fit", 0.77, "1", _TABLE_4, "paper")
FOLD_3_FSS_FITTED = Published(
    "fold 3, start 2: FSS after the fit, training set", 0.82, "1", _TABLE_4, "paper"
)
FOLD_3_FSS_TEST = Published("fold 3, start 2: FSS after the fit, testing set", 0.837, "1", _TABLE_4, "paper")
FOLD_3_ITERATIONS = Published("fold 3, start 2: iterations of the fit", 6.0, "1", _TABLE_4, "paper")

DYNAMIC_RATE_MINIMUM = Published("smallest predicted dynamic rate", 54.0, "1/s", _FIT, "paper")
DYNAMIC_RATE_MAXIMUM = Published("largest predicted dynamic rate", 212.0, "1/s", _FIT, "paper")
DYNAMIC_RATE_DIFFERENCE = Published(
    "rise of the dynamic rate at an edge; the text calls it a modulation index", 157.0, "1/s", _FIT, "paper"
)
STATIC_RATE_DIFFERENCE = Published(
    "rise of the static rate at an edge; the text calls it a modulation index", 52.0, "1/s", _FIT, "paper"
)

MESH_NODES = Published(
    "nodes of the mesh, about", 232_000.0, "1", "Gerling et al. 2014, section 2.1.1", "paper"
)
MESH_ELEMENTS = Published(
    "elements of the mesh, about", 276_000.0, "1", "Gerling et al. 2014, section 2.1.1", "paper"
)
ELEMENT_EDGE = Published(
    "element edge at the surface and the epidermal-dermal border",
    0.1,
    "mm",
    "Gerling et al. 2014, section 2.1.1",
    "paper",
)

_GRATING = "Lesniak & Gerling 2009 and the recordings quoted there"
GRATING_MODULATION_IN_VIVO = Published(
    "modulation index in vivo, gratings of 3 and 5 mm", (0.71, 0.72), "1", _GRATING, "read"
)
GRATING_MODULATION_EARLIER_MODEL = Published(
    "modulation index of the laboratory's earlier model, gratings of 3 and 5 mm",
    (0.46, 0.59),
    "1",
    _GRATING,
    "read",
)
EARLIER_MODEL_R2 = Published("R2 of the laboratory's earlier model", 0.80, "1", _GRATING, "read")
LATER_DEFLECTION_R2 = Published(
    "R2 of the surface deflection in the laboratory's later model",
    0.93,
    "1",
    "later publications of the authors' laboratory",
    "read",
)
