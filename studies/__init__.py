"""Research on the model itself, run by `python -m studies NAME`; not installed.

| command | what it does |
| --- | --- |
| `held-out` | predicts what no search has used, and compares it with what was published |
| `sai-search` | finds an SAI afferent by rates under a bar and areas of receptive fields |
| `mesh-refinement` | measures the error of the meshes of the paper's finger against finer ones |
| `results` | writes the pages that show the numbers of a reproduction |

A study writes NAME.md, its page of docs/ with new blocks, and NAME.json, its numbers. It keeps finished
indentations in indentations/, so that studies and reproductions of one folder share them. Studies that are
answered were deleted: the pages of decisions have their answers, and commits 0b18c70 and fe3b9dbe have their
scripts.
"""
