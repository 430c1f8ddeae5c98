"""Run every case and write docs/verification.md and docs/presses.md: `python -m tests.verification`.

With names of cases, run only those, and print their rows instead.
"""

import sys
import time

from .cases import ORDERED
from .page import PAGE, expectation, number, page_text, read_rows, write_rows
from .pictures import PICTURES, draw_all
from .press_table import RESOLUTIONS, TABLE_PAGE, press_all
from .stored_runs import closing


def run_all(names: list[str]) -> int:
    """Run cases, say what fails, and write the page if all cases ran."""
    failed = 0
    for case in ORDERED:
        if names and case.name not in names:
            continue
        start = time.perf_counter()
        for row in case.rows:
            failed += not row.passes
            if names or not row.passes:
                verdict = "holds" if row.passes else "FAILS"
                print(
                    f"  {verdict} {row.quantity}: {number(row.got)}, expected {expectation(row)} {row.unit}"
                )
        print(f"{case.name}: {len(case.rows)} numbers, {time.perf_counter() - start:.1f} s", flush=True)
    if not names:
        write_rows(ORDERED)
        draw_all()
        PAGE.write_text(page_text(ORDERED, read_rows(), PICTURES, closing()), encoding="utf-8")
        print(f"wrote {PAGE}", flush=True)
        press_all(RESOLUTIONS)
        print(f"wrote {TABLE_PAGE}")
    return failed


if __name__ == "__main__":
    sys.exit(1 if run_all(sys.argv[1:]) else 0)
