"""Stiffness and relaxation of the tissues: moduli in kPa, times in s as published.

The paper's Tables 1 and 2 are missing from every copy at hand. The hyperelastic coefficients of its
Trials 2 and 3 (polynomial N = 2) are therefore not here; their substitutes are marked as such.
"""

from fingerpad.data.published import Published, Source

# fmt: off
_MAENO = Source("Maeno et al. 1998", "recalled")
_WU = Source("Wu et al. 2004", "recalled")
_LABORATORY = Source(
    "the authors' laboratory, EuroHaptics 2014: fit to deflection and force, mean of four subjects", "read")
_IDENTIFIED = Source(
    "found by us with a reduced model of this fingertip from the observed deflection under a cylinder",
    "assumed")

POISSON_RATIO = _MAENO("Poisson's ratio of every skin layer", 0.48, "1")

DENSITY = Published("density of soft tissue", 1100.0, "kg/m3",
    "skin, as in tables of tissue properties (Duck 1990); subcutaneous fat is a sixth lighter", "recalled")

MAENO_EPIDERMIS_YOUNG = _MAENO("Young's modulus of the epidermis, Maeno", 136.0, "kPa")
MAENO_DERMIS_YOUNG = _MAENO("Young's modulus of the dermis, Maeno", 80.0, "kPa")
MAENO_SUBCUTIS_YOUNG = _MAENO("Young's modulus of the subcutis, Maeno", 34.0, "kPa")

WU_EPIDERMIS_YOUNG = Published("Young's modulus of the stiff epidermis of Trial 2", 2000.0, "kPa",
    "the paper only says that it is stiffer than Maeno's; 1-4 MPa is usual for stratum corneum", "assumed")

BONE_YOUNG = _MAENO("Young's modulus of bone", 17.0e6, "kPa")
BONE_POISSON = _MAENO("Poisson's ratio of bone", 0.30, "1")
NAIL_YOUNG = _MAENO("Young's modulus of nail", 170.0e3, "kPa")
NAIL_POISSON = _MAENO("Poisson's ratio of nail", 0.30, "1")

WU_SKIN_HYPERFOAM_MU = _WU("hyperfoam moduli mu_1..3 of skin, Wu", (-75.94, 11.38, 65.72), "kPa")
WU_SKIN_HYPERFOAM_ALPHA = _WU("hyperfoam exponents alpha_1..3 of skin, Wu", (4.941, 6.425, 4.712), "1")
WU_SUBCUTIS_HYPERFOAM_MU = _WU("hyperfoam moduli mu_1..3 of subcutis, Wu", (-48.95, 9.89, 39.64), "kPa")
WU_SUBCUTIS_HYPERFOAM_ALPHA = _WU(
    "hyperfoam exponents alpha_1..3 of subcutis, Wu", (5.511, 6.571, 5.262), "1")
WU_HYPERFOAM_POISSON = _WU("Poisson's ratio of the hyperfoams, Wu", 0.40, "1")
LONG_TERM_POISSON = _WU(
    "long-term Poisson's ratio of every skin layer, sets paper and human; only the deviator relaxes, so "
    "that it is 0.34 at once", 0.40, "1")

_WU_FITTED = Source(
    "fitted by us to Wu's hyperfoam (recalled) at Poisson's ratio 0.48, in uniaxial compression to 50 %; "
    "least squares with no negative coefficient", "assumed")
WU_SKIN_POLYNOMIAL = _WU_FITTED(
    "polynomial C10, C01, C20, C11, C02 of skin after Wu", (0.5159, 0.0, 0.0, 0.0798, 0.0558), "kPa")
WU_SUBCUTIS_POLYNOMIAL = _WU_FITTED(
    "polynomial C10, C01, C20, C11, C02 of subcutis after Wu", (0.2581, 0.0, 0.0, 0.0227, 0.0403), "kPa")

LABORATORY_EPIDERMIS_SHEAR = _LABORATORY(
    "neo-Hookean shear modulus of the epidermis, laboratory 2014", 1211.6, "kPa")
LABORATORY_DERMIS_SHEAR = _LABORATORY(
    "neo-Hookean shear modulus of the dermis, laboratory 2014", 50.70, "kPa")
LABORATORY_SUBCUTIS_SHEAR = _LABORATORY(
    "neo-Hookean shear modulus of the subcutis, laboratory 2014", 2.373, "kPa")

SOFT_MIX_EPIDERMIS_SHEAR = _IDENTIFIED(
    "neo-Hookean shear modulus of the epidermis, stand-in for Trial 3", 46.0, "kPa")
SOFT_MIX_DERMIS_SHEAR = _IDENTIFIED(
    "neo-Hookean shear modulus of the dermis, stand-in for Trial 3", 25.4, "kPa")
SOFT_MIX_SUBCUTIS_SHEAR = _IDENTIFIED(
    "neo-Hookean shear modulus of the subcutis, stand-in for Trial 3", 4.75, "kPa")

_HUMAN = Source(
    "chosen by us to serve deflection under a cylinder, force of a plate, firing under a shifted bar and "
    "discrimination of spheres at once (docs/decisions/paper-and-human.md)", "assumed")
HUMAN_STRATUM_CORNEUM_SHEAR = _HUMAN("long-term shear modulus of the stratum corneum, set human", 37.0, "kPa")
HUMAN_LIVING_EPIDERMIS_SHEAR = _HUMAN(
    "long-term shear modulus of the living epidermis, set human", 9.0, "kPa")
HUMAN_DERMIS_SHEAR = _HUMAN("long-term shear modulus of the dermis, set human", 7.7, "kPa")
HUMAN_SUBCUTIS_SHEAR = _HUMAN("long-term shear modulus of the subcutis, set human", 1.9, "kPa")

_DANDEKAR = Source(
    "Dandekar 1995, living fingertips, quasi-static; as quoted in later public material", "read")
PLATE_FORCE_1MM = _DANDEKAR(
    "force of a flat plate 1.0 mm deep, lowest and highest of four subjects", (0.11, 0.23), "N")
PLATE_FORCE_2MM = _DANDEKAR(
    "force of a flat plate 2.0 mm deep, lowest and highest of four subjects", (0.50, 1.04), "N")

DEFAULT_TISSUES = "human"
"""Name of the set of tissues that is pressed, and with which `Afferent()` was fitted, unless another one is
asked for."""

STIFFENING_RATIO = Published("C20 over C10 of dermis and subcutis in the stiffening Trial 3", 5.0, "1",
    "tried by us: deflection hardly sees it, firing rates and hit rates do", "assumed")

SKIN_PRONY_SHARES = _WU("Prony shares g_1..2 of skin, Wu", (0.148, 0.252), "1")
SKIN_PRONY_TIMES = _WU("Prony times tau_1..2 of skin, Wu", (2.123, 9.371), "s")
_MOUSE = Source("mouse skin, measured in the authors' laboratory (another species)", "read")
MOUSE_PRONY_SHARES = _MOUSE("Prony shares g_1..2 of mouse skin", (0.391, 0.226), "1")
MOUSE_PRONY_TIMES = _MOUSE("Prony times tau_1..2 of mouse skin", (0.25, 9.371), "s")
