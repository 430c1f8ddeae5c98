"""What each number of the solver is for: presses with the number and without it.

`python -m tests.verification.solver_numbers [PART PARTS]` presses what has no row yet, keeps each row and
writes docs/decisions/solver-numbers.md. Without a number its mechanism is off, or always on.
"""

from __future__ import annotations

import json
import math
import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from itertools import product
from typing import Any
from unittest.mock import patch

import fingerpad as fp
from fingerpad.core.errors import FingerpadError
from fingerpad.core.files import write_atomically
from fingerpad.mechanics import configuration

from .page import PAGE
from .press_table import limited_to, slide

ROWS = PAGE.parent / "verification" / "solver_numbers.json"
TABLE_PAGE = PAGE.parent / "decisions" / "solver-numbers.md"
MOST_SECONDS = 600
SAME_FORCE = 1e-6  # Share of the force within which two presses are one.
BALL = fp.Sphere(curvature_per_m=287.0)
FORCED = fp.ForceRampAndHold(force_mn=60.0)
BACK = fp.Trajectory((0.0, 50.0, 100.0, 150.0), depth_mm=(0.0, 1.0, 1.0, 0.0))
CASES: dict[str, tuple[Any, dict[str, Any]]] = {
    "ball": (BALL, {}),
    "ball, 60 mN": (BALL, {"stimulus": FORCED}),
    "plate, 500 mN": (fp.Plate(), {"stimulus": fp.ForceRampAndHold(force_mn=500.0)}),
    "ball, withdrawn": (BALL, {"stimulus": BACK}),
    "ball, slides": (BALL, {"stimulus": slide("x_mm", 2.0, depth_mm=0.6), "friction": 0.5}),
    "ball, slides at 60 mN": (BALL, {"stimulus": slide("x_mm", 2.0, force_mn=60.0), "friction": 0.5}),
    "ball of 0.5 mm": (fp.Sphere(curvature_per_m=2000.0), {"stimulus": fp.RampAndHold(depth_mm=1.5)}),
    "punch": (fp.FlatPunch(1.0, 0.1), {"stimulus": fp.RampAndHold(depth_mm=1.0)}),
    "punch, friction": (fp.FlatPunch(1.0, 0.1), {"stimulus": fp.RampAndHold(depth_mm=1.5), "friction": 0.5}),
    "sharp bar": (fp.Bar(3.0, 0.05), {"stimulus": fp.RampAndHold(depth_mm=1.5)}),
    "sharp bar, friction": (
        fp.Bar(3.0, 0.05),
        {"stimulus": fp.RampAndHold(depth_mm=0.8), "friction": 0.5, "tissues": "trial2_wu"},
    ),
    "grating": (fp.Grating(1.0, 1.0), {"stimulus": fp.RampAndHold(depth_mm=1.0), "friction": 0.5}),
    "wire": (fp.bodies.Line(0.3), {"stimulus": fp.RampAndHold(depth_mm=1.0)}),
}
"""Presses at quick; of each the paper's ramp of 1 mm with the hold, unless it says otherwise."""

EVER = 10**9
WITHOUT: dict[str, Any] = {
    "SHORTEST_NEAR_REST": 1.0 / 64,
    "REMEMBERED_POTENTIALS": 1,
    "ENOUGH": 0.0,
    "LAST_STEP": 0.0,
    "RENEW_AT": 0.0,
    "MOST_FREE": 1.0,
    "MOST_CONTACT_CHANGES": 0,
    "CONTACT_FORCING": 1e-9,
    "MOST_STRAIGHT": EVER,
    "LARGEST_SHIFTS": {True: 0.0, False: 2.0},
    "LONGEST_SHIFTED_STEP": 1.0,
    "MOST_FULL_AUGMENTATIONS": EVER,
    "MOST_PLAIN_RENEWALS": EVER,
    "MOST_ADVANCE": 1e3,
    "MOST_CONTINUED": 1.0,
    "LARGEST_DROP": 1.0,
    "LEAST_SHARE_OF_FORCE": 0.0,
    "LEAST_DEPTH_MM": 1e-6,
    "CURVATURE_BELOW_RESIDUAL": math.inf,
    "LEAST_PENETRATION": 0.0,
    "SAG_OF_WIDTH": 0.0,
    "LONGEST_STEP": math.inf,
    "LONGEST_SLIDE": math.inf,
    "STICK_PENALTY": 15_000.0,
    "STIFFNESS_KPA": 3_000.0,
    "MORE_NEWTON_STEPS": 1,
    "LENGTHEN_AFTER": 1,
    "LEAST_SECANT": 0.0,
    "MOST_EXPECTED": math.inf,
}
"""Numbers, and values that take their effect away."""

ELSEWHERE = {
    "SHORTEST_NEAR_REST": "a node at a grating is driven in and out for ever (test_mechanics_newton)",
    "MOST_STRAIGHT": "skin that snaps round an edge finds no equilibrium (test_mechanics_newton)",
    "LARGEST_SHIFTS": "punch of 1 mm, 2 mm deep, without friction, tissues paper: +31% assemblies",
    "LONGEST_SHIFTED_STEP": "see `MOST_STRAIGHT`",
    "LENGTHEN_AFTER": "every second step fails after a cut (test_mechanics_steps)",
    "MOST_FREE": "ball that slides 5 mm at 60 mN, with `MOST_CONTINUED` and `MOST_EXPECTED`: +59% assemblies",
    "MOST_CONTINUED": "see `MOST_FREE`",
    "MOST_EXPECTED": "see `MOST_FREE`",
    "LONGEST_SLIDE": "bar that slides 2 mm: -27% assemblies, energy imbalance 0.23% for 0.09%",
    "STICK_PENALTY": "punch of 1 mm, 2 mm deep, wu2007: energy imbalance 0.44% for 0.11%",
    "MORE_NEWTON_STEPS": "punch of 1 mm, 2 mm deep, trial1, with the three that refer here: stops at 1.71 mm",
    "MOST_FULL_AUGMENTATIONS": "see `MORE_NEWTON_STEPS`",
    "LEAST_PENETRATION": "see `MORE_NEWTON_STEPS`",
    "CONTACT_FORCING": "see `MORE_NEWTON_STEPS`",
}
"""What tests, or harder presses at quick, do without a number, or without some together."""


@contextmanager
def without(name: str) -> Iterator[None]:
    """Replace a number in all modules that have it."""
    mechanics = [module for key, module in sys.modules.items() if key.startswith("fingerpad.mechanics.")]
    homes = [module for module in mechanics if name in vars(module)]
    assert homes or not name, f"{name} is in no module"
    with ExitStack() as patches:
        for home in homes:
            patches.enter_context(patch.object(home, name, WITHOUT[name]))
        yield


def row(case: str, name: str) -> dict[str, Any]:
    """Press once, and say what it took and gave."""
    body, options = CASES[case]
    options = dict(options)
    stimulus = options.pop("stimulus", None)
    touch = fp.touch_of(fp.Fingertip(), body, stimulus, **options)
    count, assemble = 0, configuration.assemble

    def counted(*arguments: Any) -> float:
        nonlocal count
        count += 1
        return assemble(*arguments)

    with without(name), patch.object(configuration, "assemble", counted), limited_to(MOST_SECONDS):
        try:
            skin = touch.solve()
        except (FingerpadError, TimeoutError) as error:
            return {"failure": str(error), "assemblies": count}
    return {
        "assemblies": count,
        "newton_steps": skin.newton_steps,
        "force_mn": float(skin.force_mn.max()),
        "energy_imbalance": float(skin.energy_imbalance),
    }


def read_rows() -> dict[str, dict[str, Any]]:
    return json.loads(ROWS.read_text(encoding="utf-8")) if ROWS.exists() else {}


def effect(made: dict[str, Any], usual: dict[str, Any]) -> str:
    """What a press without a number does otherwise, in words; empty if it is the same."""
    if "failure" in made:
        return "stops" if made["assemblies"] <= 2 * usual["assemblies"] else "takes over twice as long"
    changes = made["assemblies"] / usual["assemblies"] - 1.0
    moved = made["force_mn"] / usual["force_mn"] - 1.0
    said = [f"{changes:+.0%} assemblies"] if made["assemblies"] != usual["assemblies"] else []
    return ", ".join([*said, *([f"force {moved:+.2%}"] if abs(moved) > SAME_FORCE else [])])


def page_text(rows: dict[str, dict[str, Any]]) -> str:
    """Page of the numbers: what changes without each of them, and in how many presses nothing does."""
    lines = []
    for name in WITHOUT:
        pressed = [case for case in CASES if f"{name}|{case}" in rows]
        said = {case: effect(rows[f"{name}|{case}"], rows[f"|{case}"]) for case in pressed}
        changed = "; ".join(f"{case}: {words}" for case, words in said.items() if words)
        changed = "; ".join(filter(None, [changed, ELSEWHERE.get(name)]))
        same = sum(not words for words in said.values())
        lines.append(f"| `{name}` | {changed or 'nothing'} | {same} of {len(pressed)} |")
    table = "\n".join(["| number | without it | presses that stay the same |", "|---|---|---|", *lines])
    return f"""# Numbers of the solver

**Question.** Which of the numbers that steer contact, friction and Newton steps does a measurement defend?

**Choice.** A number stays if some press or test is slower, less accurate or stops without it. One without any
effect is gone: after how many Newton steps the potential must fall in each. The others without effect bound
what round-off or a withdrawn indenter would do.

**Reason.** Presses at quick resolution, with every number and without one of them: its mechanism is off, or
always on. Tissues were those that were the default before November 2026. Most of these presses are easy: of
fourteen numbers that made no difference to them, the hard presses of the [table](../presses.md) need most.

{table}

`python -m tests.verification.solver_numbers` presses what is missing and writes this page.

**To change it.** The constants of `fingerpad.mechanics`.
"""


def measure(part: int = 0, parts: int = 1) -> None:
    """Press what has no row, and write the page."""
    for number, (name, case) in enumerate(product(["", *WITHOUT], CASES)):
        key = f"{name}|{case}"
        if number % parts == part and key not in read_rows():
            made = row(case, name)
            write_atomically(ROWS, json.dumps(read_rows() | {key: made}, indent=1).encode())
            print(key, made, flush=True)
    write_atomically(TABLE_PAGE, page_text(read_rows()).encode())


if __name__ == "__main__":
    measure(*(int(word) for word in sys.argv[1:3]))
