"""The speed figures, each with its error or bytes and with what it is compared to: `make bench`, or

    [QUICK=1] [RUNS=3] [DATA=folder with volumes/ and bart/] python3 tools/measure/bench [SECTION...]

from the top folder, after `make all`. One core. Tables go to standard output and, as CSV, to build/bench; progress goes to
standard error. Stopped and started again, it goes on where it was.
"""
import os, sys

import counts, harness, scaling, smoke, surfaces

SECTIONS = {"table_2": smoke.table_2, "table_3": smoke.table_3, "table_4": smoke.table_4, "table_1": smoke.table_1,
            "front": smoke.front, "shortcuts": smoke.shortcuts, "arithmetics": smoke.arithmetics, "grid": smoke.grid, "povray": smoke.povray,
            "sheets": smoke.sheets, "point_tree": surfaces.point_tree, "rays": surfaces.rays,
            "shadow_rays": surfaces.shadow_rays, "kitchen": surfaces.kitchen, "robots": surfaces.robots,
            "walk": surfaces.walk, "zoom": surfaces.zoom, "instructions": counts.instructions, "needs": counts.needs,
            "scaling": scaling.scaling}
# Two hours of references, which QUICK does without.
if not harness.QUICK:
    SECTIONS = {"truth": smoke.truth, **SECTIONS}


def main(names):
    unknown = [name for name in names if name not in SECTIONS]
    if unknown:
        print(f"there is no section {unknown[0]}, expected some of: {' '.join(SECTIONS)}", file=sys.stderr)
        sys.exit(2)
    os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})
    for key, value in harness.machine().items():
        print(f"{key}: {value}")
    harness.run_sections([(name, SECTIONS[name]) for name in names or SECTIONS])
    for line in harness.failed:
        print("failed: " + line, file=sys.stderr)
    sys.exit(1 if harness.failed else 0)


main(sys.argv[1:])
