"""Results that the paper reports, for comparison only; no computation uses them."""

from fingerpad.data.published import Published, Source

# fmt: off
_ABSTRACT = Source("Gerling et al. 2014, abstract and section 4", "paper")
_FIT = Source("Gerling et al. 2014, section 3.2", "paper")
_TABLE_4 = Source("Gerling et al. 2014, section 3.2 and caption of Table 4", "paper")

FSS_OUT_OF_SAMPLE = _ABSTRACT("fractional sum of squares, mean over the six testing sets", 0.81, "1")
FOLD_3_FSS_START = _TABLE_4("fold 3, start 2: FSS before the fit", 0.77, "1")
FOLD_3_FSS_FITTED = _TABLE_4("fold 3, start 2: FSS after the fit, training set", 0.82, "1")
FOLD_3_FSS_TEST = _TABLE_4("fold 3, start 2: FSS after the fit, testing set", 0.837, "1")
FOLD_3_ITERATIONS = _TABLE_4("fold 3, start 2: iterations of the fit", 6.0, "1")

DYNAMIC_RATE_MINIMUM = _FIT("smallest predicted dynamic rate", 54.0, "1/s")
DYNAMIC_RATE_MAXIMUM = _FIT("largest predicted dynamic rate", 212.0, "1/s")
DYNAMIC_RATE_DIFFERENCE = _FIT(
    "rise of the dynamic rate at an edge; the text calls it a modulation index", 157.0, "1/s")
STATIC_RATE_DIFFERENCE = _FIT(
    "rise of the static rate at an edge; the text calls it a modulation index", 52.0, "1/s")

_MESH = Source("Gerling et al. 2014, section 2.1.1", "paper")
MESH_NODES = _MESH("nodes of the mesh, about", 232_000.0, "1")
MESH_ELEMENTS = _MESH("elements of the mesh, about", 276_000.0, "1")
ELEMENT_EDGE = _MESH("element edge at the surface and the epidermal-dermal border", 0.1, "mm")

_GRATING = Source("Lesniak & Gerling 2009 and the recordings quoted there", "read")
GRATING_MODULATION_IN_VIVO = _GRATING("modulation index in vivo, gratings of 3 and 5 mm", (0.71, 0.72), "1")
GRATING_MODULATION_EARLIER_MODEL = _GRATING(
    "modulation index of the laboratory's earlier model, gratings of 3 and 5 mm", (0.46, 0.59), "1")
EARLIER_MODEL_R2 = _GRATING("R2 of the laboratory's earlier model", 0.80, "1")
LATER_DEFLECTION_R2 = Published("R2 of the surface deflection in the laboratory's later model", 0.93, "1",
    "later publications of the authors' laboratory", "read")
