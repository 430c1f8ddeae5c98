"""Values of options, for the help. The modules behind the commands check them."""

from fingerpad.skin.fields import sampled_fields

DEFAULT_TISSUES = "human"
"""Tissues of every command; as in `fingerpad.data.tissues`."""

RESOLUTION_CHOICES = ("quick", "standard", "paper")
INDENTER_CHOICES = ("sphere", "cylinder", "bar", "line", "punch", "plate", "edge", "gap", "grating")
FINGER_CHOICES = ("adult", "small", "large", "child", "macaque", "aged")
TISSUES_CHOICES = (
    "human",
    "paper",
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
FORMAT_CHOICES = ("vtu", "csv", "npz", "netcdf", "zarr", "abaqus", "calculix", "febio")
METHOD_CHOICES = ("least_squares", "response_surface", "closed_form", "cma_es", "likelihood")
QUANTITY_CHOICES = tuple(sampled_fields())
KIND_CHOICES = ("force", "deflection", "rate_curvature", "rate_position", "grating")
LOADING_CHOICES = ("ramp_and_hold", "quasi_static")
