"""Research on the model itself, run by `python -m studies NAME`; not installed.

| command | what it studies |
| --- | --- |
| `tissue-search` | tissues and drives on four levels, effect of each parameter, order of the trials |
| `bar-readings` | readings of Eqs. 7-8, and bar or ridge of a grating, on the rates under the bar |
| `held-out` | predictions of `human` that no search has used, inside or outside of what was published |
| `tissue-posterior` | one posterior of tissues, afferent and noise, with bands on all figures |
| `drives` | quantities that drive the afferent, explanations of the dynamic rates, sampling depths |
| `methods` | start points and units, methods of fitting, models and their limits |
| `spike-fit` | fits to spike trains, variability of interspike intervals |
| `mesh-refinement`, `paper-size` | errors of the meshes against finer ones |
| `mesh-noise` | meshes of one resolution with shifted element boundaries |
| `population-timing` | order of first spikes and population rate about the contact |
| `code-efficiency` | codes of a population against the ideal observer |
| `sed-readings` | readings of SED at the epidermal-dermal border: FSS, rates and noise of each |
| `results` | the pages that show the numbers of a reproduction |

The uncertainty of the fit and curvature thresholds are part of `fingerpad reproduce --extended`. A command
writes NAME.md with its figures in images/, NAME.json, and keeps finished indentations in indentations/, so
that studies and reproductions of one folder share them.
"""
