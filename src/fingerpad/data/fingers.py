"""Fingertips other than the paper's: sizes of people and macaques, and skin of old age.

A size that is not listed here follows from the paper's finger in proportion (`Fingertip.of`).
"""

from fingerpad.data.published import Published, Source

# fmt: off
_DANDEKAR = Source(
    "Dandekar, Raju and Srinivasan 2003, J Biomech Eng 125:682, caption of the figure of both meshes: "
    "monkey fingertips are about 8 to 10 mm wide, human ones 16 to 20 mm", "read")

CREASE_TO_TIP = Published(
    "length of the paper's distal phalanx, from the crease of the last joint to the tip", 25.0, "mm",
    "the crease is not in the model; it is put 18 mm proximal of the tip of the bone, as long as the "
    "distal phalanx of an adult's index finger", "assumed")
SMALL_WIDTH = _DANDEKAR("width of a small adult fingertip", 16.0, "mm")
LARGE_WIDTH = Published("width of a large adult fingertip", 22.0, "mm",
    "Greiner 1991, hand anthropometry of U.S. Army personnel: distal joint of the index finger, about the "
    "95th percentile of men", "recalled")
CHILD_WIDTH = Published("width of a child's fingertip, mean of 3 to 10 years", 15.0, "mm",
    "Annals of Anatomy 192:156 (2010), abstract: mean diameter of the index fingers of 160 children, from "
    "girths", "read")
MACAQUE_WIDTH = _DANDEKAR("width of a macaque's fingertip", 9.0, "mm")

_BRANCHET = Source(
    "Branchet et al. 1990, Gerontology 36:28, abstract: biopsies of the upper inner arm; epidermis 7.2 % "
    "in men and 5.7 % in women, dermis 6 %, of the original value per decade", "read")
EPIDERMIS_LOSS = _BRANCHET(
    "loss of thickness of the living epidermis, mean of both sexes", 0.0645, "1/decade")
DERMIS_LOSS = _BRANCHET("loss of thickness of the dermis", 0.06, "1/decade")
AGED_DECADES = Published("decades between the paper's skin and aged skin", 4.0, "decade",
    "from 30 to 70 years; that the finger thins as the arm does is assumed too", "assumed")
