"""All that is measured: `make bench`, `make convergence`, `make hard-cases`, or

    [QUICK=1] [RUNS=3] [DATA=folder with volumes/ and bart/] python3 tools/measure [SECTION...]

from the top folder, after `make all`. One core. Tables go to standard output and, as CSV, to build/bench; progress goes to
standard error. Stopped and started again, it goes on where it was.
"""
import os, sys

import convergence, counts, files, hard_cases, harness, scaling, smoke, surfaces, thin

BENCH = {section.__name__: section for section in (
    # Two hours of references, which QUICK does without.
    *([] if harness.QUICK else [smoke.truth]),
    smoke.methods, smoke.table_2, smoke.table_3, smoke.table_4, smoke.table_1, smoke.front, smoke.shortcuts, smoke.arithmetics,
    smoke.grid, smoke.grid_single, smoke.povray, smoke.sheets, files.files, surfaces.point_tree, surfaces.rays,
    surfaces.shadow_rays, surfaces.povray_surfaces, surfaces.kitchen, surfaces.robots, surfaces.walk, surfaces.zoom,
    counts.instructions, counts.needs, scaling.scaling)}
SECTIONS = {**BENCH, **{section.__name__: section for section in (convergence.convergence, hard_cases.hard_cases, thin.thin)}}


def main(names):
    unknown = [name for name in names if name not in SECTIONS]
    if unknown:
        print(f"there is no section {unknown[0]}, expected some of: {' '.join(SECTIONS)}", file=sys.stderr)
        sys.exit(2)
    os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})
    for key, value in harness.machine().items():
        print(f"{key}: {value}")
    harness.run_sections([(name, SECTIONS[name]) for name in names or BENCH])
    for line in harness.failed:
        print("failed: " + line, file=sys.stderr)
    sys.exit(1 if harness.failed else 0)


main(sys.argv[1:])
