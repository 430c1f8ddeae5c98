"""Values of options, for the help. The modules behind the commands check them."""

from fingerpad.skin.fields import sampled_fields

RESOLUTIONS = ("quick", "standard", "paper")
INDENTERS = {
    "sphere": "Sphere",
    "cylinder": "Cylinder",
    "bar": "Bar",
    "line": "Line",
    "punch": "FlatPunch",
    "plate": "Plate",
    "edge": "Edge",
    "gap": "Gap",
    "grating": "Grating",
}
"""Each with its class."""

MATERIALS = (
    "trial1",
    "trial2",
    "trial3",
    "trial2_wu",
    "trial3_wu",
    "trial3_stiffening",
    "maeno1998",
    "wu2007",
    "gerling2014_fit",
)
FORMATS = ("vtu", "abaqus", "calculix", "febio")
FITTING_METHODS = ("least_squares", "response_surface", "closed_form", "cma_es", "likelihood")
QUANTITIES = tuple(sampled_fields())
