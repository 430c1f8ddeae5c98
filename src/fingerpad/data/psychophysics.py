"""Spheres of the discrimination task, the model observer, the population, and observed hit rates."""

from fingerpad.data.published import Published, Source

# fmt: off
_PAPER = Source("Gerling et al. 2014, section 2.2.3", "paper")
_GOODWIN = Source("Goodwin, John & Marceglia 1991, as quoted by Gerling et al. 2014, section 2.2.3", "paper")
_LOST = Source("lost; placed between the known spheres", "assumed")

SPHERE_287 = _PAPER("curvature of sphere 1 of 7, the standard", 287.0, "1/m")
SPHERE_296 = _PAPER("curvature of sphere 2 of 7, the nearest comparison", 296.0, "1/m")
SPHERE_305 = Published("curvature of sphere 3 of 7", 305.0, "1/m", "Goodwin, John & Marceglia 1991", "read")
SPHERE_316 = _LOST("curvature of sphere 4 of 7", 316.0, "1/m")
SPHERE_328 = _LOST("curvature of sphere 5 of 7", 328.0, "1/m")
SPHERE_340 = _LOST("curvature of sphere 6 of 7", 340.0, "1/m")
SPHERE_365 = _PAPER("curvature of sphere 7 of 7, the farthest comparison", 365.0, "1/m")
SPHERES = (SPHERE_287, SPHERE_296, SPHERE_305, SPHERE_316, SPHERE_328, SPHERE_340, SPHERE_365)
SPHERE_CURVATURES = Published(
    "curvatures of the seven spheres, the standard first", tuple(sphere.value for sphere in SPHERES), "1/m",
    "287, 296, 365 from the paper, 305 read, 316, 328, 340 stand-ins for lost values", "assumed")

GOODWIN_CURVATURES = _GOODWIN("comparison spheres with a published hit rate", (296.0, 365.0), "1/m")
GOODWIN_HIT_RATES = _GOODWIN(
    "fraction of trials in which they were told from the standard", (0.58, 0.95), "1")
GOODWIN_TRIALS = Published("trials behind each of these fractions, for their binomial intervals", 100.0, "1",
    "not known to us; the smallest number of trials of which 58 % and 95 % are whole numbers", "assumed")

NOISE_SIGMA = Published("standard deviation sigma_1 of the multiplicative noise that fitted best", 0.055, "1",
    "Gerling et al. 2014, Figure 7", "paper")
NOISE_SIGMA_RANGE = _PAPER("range of sigma_1 that was tried", (0.015, 0.085), "1")
NOISE_SIGMA_SHOWN = Published("other values of sigma_1 that were shown", (0.025, 0.085), "1",
    "Gerling et al. 2014, Figure 7", "paper")
DECISION_CRITERION = _PAPER("decision criterion beta", 0.5, "1")
DECISION_CRITERION_SIGMA = _PAPER("standard deviations of the varied decision criterion", (0.01, 0.02), "1")
REPETITIONS = _PAPER("noise draws per sphere, sets per sphere and hit rates per sphere", 100.0, "1")
REPETITIONS_VARIED_CRITERION = _PAPER("gradient sums per sphere when the criterion varies", 5000.0, "1")

_GOODWIN_THRESHOLDS = Source("Goodwin, John & Marceglia 1991, abstract", "recalled")
THRESHOLD_STANDARDS = _GOODWIN_THRESHOLDS("standards of the curvature thresholds", (144.0, 287.0), "1/m")
THRESHOLD_COMPARISONS = _GOODWIN_THRESHOLDS(
    "spheres told from these standards in 75 % of trials", (158.0, 319.0), "1/m")
WEBER_FRACTIONS = Published(
    "range of the Weber fractions of curvature under a still finger", (0.10, 0.14), "1",
    "Goodwin, John & Marceglia 1991 and later studies of passive touch", "recalled")

RECEPTOR_DENSITY = Published("density of SAI receptors", 100.0, "1/cm2",
    "Gerling et al. 2014, section 2.1.4", "paper")
RECEPTOR_COUNT = Published("receptors in the population", 18.0, "1", "Gerling et al. 2014, Figure 3", "paper")
HUMAN_RECEPTOR_DENSITY = Published("density of SAI receptors in the human fingertip", 70.0, "1/cm2",
    "Johansson & Vallbo 1979", "recalled")
SENSITIVITY_SPREAD = Published(
    "standard deviation of the logarithm of the sensitivity of SAI afferents", 0.4, "1",
    "called large, without a number, in the abstracts of Goodwin & Wheat 1999 and Wheat & Goodwin 2001",
    "assumed")
INTERVAL_VARIATION = Published(
    "coefficient of variation of SAI interspike intervals and its spread, mouse", (0.78, 0.09), "1",
    "recordings of the authors' laboratory in mouse (another species)", "read")
