"""The speed figures, each with its error or bytes and with what it is compared to: `make bench`, or

    [QUICK=1] [RUNS=3] [DATA=folder with volumes/ and bart/] python3 tools/bench [SECTION...]

from the top folder, after `make all`. One core. Tables go to standard output and, as CSV, to build/bench; progress goes to
standard error. Stopped and started again, it goes on where it was.
"""
import os, sys

import harness
from scaling import scaling

SECTIONS = {"scaling": scaling}


def main(names):
    unknown = [name for name in names if name not in SECTIONS]
    if unknown:
        sys.exit(f"there is no section {unknown[0]}, expected some of: {' '.join(SECTIONS)}")
    os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})
    for key, value in harness.machine().items():
        print(f"{key}: {value}")
    harness.run_sections([(name, SECTIONS[name]) for name in names or SECTIONS])
    for line in harness.failed:
        print("failed: " + line, file=sys.stderr)
    sys.exit(1 if harness.failed else 0)


main(sys.argv[1:])
