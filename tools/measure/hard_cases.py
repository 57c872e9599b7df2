"""The hard cases of test/physics/hard_cases.txt: what each has in the three arithmetics, and the outcome that is right; also as
build/hard_cases.csv."""
import re, subprocess, sys
from pathlib import Path
from xml.etree import ElementTree

from harness import failed, table

ARITHMETICS = "f32", "f64", "fixed"


def hard_cases():
    yield
    if not Path("build/tests").exists():
        sys.exit("build/tests is not there, expected it: make build/tests")
    said = subprocess.run(["build/tests", "-tc=*hard case*", "-r=xml"], capture_output=True, text=True).stdout
    results = {}  # (case, arithmetic or None): whether all checks of its test held
    for case in ElementTree.fromstring(said[:said.index("</doctest>") + 10]).iter("TestCase"):
        name = re.match(r"(?:(f32|f64|fixed): )?hard case ([A-F]\d+):", case.get("name", ""))
        checks = case.find("OverallResultsAsserts")
        if name and checks is not None:
            results[name[2], name[1]] = checks.get("test_case_success") == "true"
    rows, pending = [], 0
    for line in Path("test/physics/hard_cases.txt").read_text().splitlines():
        case, outcome, *state = line.split(" | ")
        if state and state[0].startswith("pending"):
            pending += 1
            rows.append([case, *["pending"] * 3, f"{outcome} ({state[0]})"])
            continue
        found = [results.get((case, arithmetic), results.get((case, None))) for arithmetic in ARITHMETICS]
        rows.append([case, *({True: "passed", False: "FAILED", None: "missing"}[one] for one in found), outcome])
        if not all(found):
            failed.append(f"hard case {case}")
    table("hard_cases", "Cases and outcomes", ["case", *ARITHMETICS, "outcome"], rows, folder=Path("build"))
    print(f"{len(rows)} cases: {len(rows) - pending - len(failed)} passed, {len(failed)} failed, {pending} pending")
