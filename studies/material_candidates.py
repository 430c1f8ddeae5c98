"""Sets of tissues that are tried on all three levels: stand-ins, intermediate sets, and Wu's own tissues.

Gains turn energy into current and the depth is prescribed, so that a factor on all moduli changes the force
and nothing else. What is varied are contrasts between layers, stiffening and compressibility.
"""

from __future__ import annotations

from fingerpad.data import tissues as published
from fingerpad.data.published import Published
from fingerpad.mechanics.materials import Material, Tissues
from fingerpad.mechanics.tissues import NU, named_tissues, skin_prony
from studies.hyperfoam_fit import polynomial_of_hyperfoam
from studies.material_sets import MaterialSet

SOFT_EPIDERMIS_KPA = published.MAENO_EPIDERMIS_YOUNG.value / (2.0 * (1.0 + NU))
STIFF_EPIDERMIS_KPA = published.WU_EPIDERMIS_YOUNG.value / (2.0 * (1.0 + NU))
"""Shear moduli of the two epidermes of the paper's trials. [kPa]"""

DERMIS_KPA = published.SOFT_MIX_DERMIS_SHEAR.value
SUBCUTIS_KPA = published.SOFT_MIX_SUBCUTIS_SHEAR.value

INTERMEDIATE = (
    ("epidermis x 4", 184.0, DERMIS_KPA, SUBCUTIS_KPA, "Trial 3, epidermis alone varied"),
    ("middle of the valley", 350.0, DERMIS_KPA, 7.0, "between Trial 3 and the next, where R² stays high"),
    ("stiff over stiff", 675.7, DERMIS_KPA, 11.5, "Trial 2's epidermis, Maeno's subcutis"),
    ("softer subcutis", 46.0, DERMIS_KPA, 2.373, "Trial 3, subcutis alone varied, to that of 2014"),
    ("half-way to 2014", 236.0, 35.9, 3.357, "logarithmic mean of Trial 3 and the laboratory's fit of 2014"),
)
"""Neo-Hookean shear moduli of epidermis, dermis and subcutis [kPa], all assumed; and what they vary."""

GRID_KPA = ((20.0, 46.0, 184.0, 675.7), (2.373, 4.75, 8.0, 11.5, 18.0))
"""Shear moduli of epidermis and subcutis that are combined over Trial 3's dermis. [kPa]"""


def layered(epidermis_kpa: float, dermis: float | Material, subcutis: float | Material) -> Tissues:
    """Tissues from shear moduli [kPa] or laws of dermis and subcutis, relaxing as in the paper's trials.

    Examples
    --------
    >>> layered(46.0, 25.4, 4.75).subcutis.shear_modulus_kpa
    4.75
    """
    epidermis, inner, fat = (
        layer if isinstance(layer, Material) else Material.neo_hooke(layer, NU, skin_prony())
        for layer in (epidermis_kpa, dermis, subcutis)
    )
    return Tissues(epidermis, epidermis, inner, fat)


def wu_polynomials(curve_poisson: float, poisson: float) -> tuple[Material, Material]:
    """Dermis and subcutis as polynomials N = 2 fitted to Wu's hyperfoams.

    Parameters
    ----------
    curve_poisson : float
        Poisson's ratio of the hyperfoam whose stress is fitted: Wu's 0.40, or another.
    poisson : float
        Poisson's ratio of the polynomial.

    Returns
    -------
    dermis, subcutis : Material

    Examples
    --------
    >>> dermis, subcutis = wu_polynomials(0.48, 0.48)
    >>> round(dermis.shear_modulus_kpa, 2), round(subcutis.shear_modulus_kpa, 2)
    (1.03, 0.52)
    """

    def fitted(mu: Published, alpha: Published) -> Material:
        c10, c01, c20, c11, c02 = polynomial_of_hyperfoam(mu.value, alpha.value, curve_poisson)[0].tolist()
        return Material.polynomial(c10, c01, c20, c11, c02, poisson, skin_prony())

    return (
        fitted(published.WU_SKIN_HYPERFOAM_MU, published.WU_SKIN_HYPERFOAM_ALPHA),
        fitted(published.WU_SUBCUTIS_HYPERFOAM_MU, published.WU_SUBCUTIS_HYPERFOAM_ALPHA),
    )


def candidates() -> tuple[MaterialSet, ...]:
    """All sets that are compared.

    Examples
    --------
    >>> [candidate.name for candidate in candidates()][:4]
    ['Trial 1', 'Trial 2', 'Trial 3', 'laboratory 2014']
    """
    wu = "polynomial N = 2 fitted by us to Wu's hyperfoams (recalled) in compression to 50 %"
    foams = named_tissues("wu2007")
    named = (
        MaterialSet("Trial 1", named_tissues("trial1"), "Maeno, recalled"),
        MaterialSet("Trial 2", named_tissues("trial2"), "as Trial 3 under an epidermis of 2 MPa, assumed"),
        MaterialSet(
            "Trial 3",
            named_tissues("trial3"),
            "Maeno's epidermis, recalled; inner layers assumed, identified from the observed deflection",
        ),
        MaterialSet("laboratory 2014", named_tissues("gerling2014_fit"), "read"),
    )
    from_wu = (
        MaterialSet(
            "Wu polynomial",
            layered(SOFT_EPIDERMIS_KPA, *wu_polynomials(NU, NU)),
            f"Maeno's epidermis, recalled; inner layers {wu}, nu = {NU} in hyperfoam and polynomial",
        ),
        MaterialSet(
            "Wu hyperfoam",
            layered(SOFT_EPIDERMIS_KPA, foams.dermis, foams.subcutis),
            "Maeno's epidermis over Wu's hyperfoams themselves, recalled",
        ),
        MaterialSet(
            "Wu polynomial, stiff epidermis",
            layered(STIFF_EPIDERMIS_KPA, *wu_polynomials(NU, NU)),
            "Trial 2 with Wu's polynomial: epidermis of 2 MPa, assumed",
        ),
    )
    between = tuple(
        MaterialSet(name, layered(epidermis, dermis, subcutis), f"assumed: {basis}")
        for name, epidermis, dermis, subcutis, basis in INTERMEDIATE
    )
    ratio = published.STIFFENING_RATIO.value
    stiffening = MaterialSet(
        "stiffening",
        named_tissues("trial3_stiffening"),
        f"assumed: Trial 3 with C20 = {ratio:g} C10 in dermis and subcutis",
    )
    return (*named, *from_wu, *between, stiffening)


def deflection_candidates() -> tuple[MaterialSet, ...]:
    """List sets that are pressed by the cylinder alone: contrasts, compressibility, Wu's curve.

    Examples
    --------
    >>> deflection_candidates()[0].name
    'epidermis 20, subcutis 2.373'
    """
    epidermes, fats = GRID_KPA
    grid = (
        MaterialSet(
            f"epidermis {epidermis:g}, subcutis {fat:g}", layered(epidermis, DERMIS_KPA, fat), "assumed"
        )
        for epidermis in epidermes
        for fat in fats
    )
    foam_poisson = published.WU_HYPERFOAM_POISSON.value
    wu = (
        MaterialSet(
            f"Wu polynomial, nu {poisson:g}, fitted to the foam of nu {curve:g}",
            layered(SOFT_EPIDERMIS_KPA, *wu_polynomials(curve, poisson)),
            "recalled",
        )
        for curve, poisson in ((foam_poisson, NU), (foam_poisson, foam_poisson))
    )
    return (*grid, *wu, _compressible())


def _compressible() -> MaterialSet:
    """Trial 3 with the Poisson's ratio of Wu's tissues in dermis and subcutis."""
    poisson = published.WU_HYPERFOAM_POISSON.value
    dermis, subcutis = (
        Material.neo_hooke(shear, poisson, skin_prony()) for shear in (DERMIS_KPA, SUBCUTIS_KPA)
    )
    basis = f"assumed: Trial 3 with nu = {poisson:g} in dermis and subcutis"
    return MaterialSet(
        f"Trial 3, nu {poisson:g} inside", layered(SOFT_EPIDERMIS_KPA, dermis, subcutis), basis
    )
