"""The tables of a release: `make measured`, or

    python3 tools/measure/measured.py [check] [--bench build/bench] [--measured fixtures/measured] [--readme README.md]

from the top folder. Takes what `make bench` has left, with machine, date and commit, and writes README's table of methods by
it. `check` writes nothing, and fails where README says anything else than the tables of the release do.
"""
import argparse, difflib, math, re, shutil, sys
from pathlib import Path

from harness import MEASURED, OUT, read_csv, read_index, write_index

START = "| method | error | seconds |\n| --- | --- | --- |\n"
# What no figure says, and where it stands.
CHOSEN = ("| `--max-error E` | E at most: wisp chooses photons and cells | as chosen, and ten frames or more to choose |\n")


def number(cell):
    return math.nan if cell == "-" else float(cell)


def rounded(value, digits):
    """So many digits, without an exponent: 0.9, 104, 1,500."""
    value = float(f"{value:.{digits}g}")
    return f"{value:,.0f}" if value >= 100 or value == int(value) else f"{value:g}"


def methods(folder):
    """README's table, of the CSV `methods`."""
    header, rows = read_csv(folder / "methods.csv")
    text, chosen = START, CHOSEN
    for cells in rows:
        row = dict(zip(header, cells))
        seconds, error, noise = (number(row[name]) for name in ("s", "RMSE", "noise"))
        if math.isfinite(noise):
            text, chosen = text + chosen, ""  # before the reference
        elif not math.isfinite(error):
            sys.exit(f"{folder}/methods.csv: '{row['method']}' has no error, expected one (make truth)")
        said = f"no bias; noise {rounded(100 * noise, 2)} %" if math.isfinite(noise) else f"{rounded(100 * error, 2)} %"
        estimated = "about " if row["spread %"] == "-" else ""
        text += f"| {row['method']} | {said} | {estimated}{rounded(seconds, 2 if estimated else 3)} |\n"
    return text + chosen


def with_table(readme, table):
    found = re.search(re.escape(START) + r"(\|.*\n)+", readme)
    if not found:
        sys.exit(f"README has no table that begins with '{START.splitlines()[0]}'")
    return readme[:found.start()] + table + readme[found.end():]


def take(bench, measured):
    """Copies the tables whose origin is known."""
    about = read_index(bench)
    if not about:
        sys.exit(f"{bench}/tables.json has no tables, expected some (make bench)")
    for name, said in about.items():
        machine = said["machine"]
        commit = machine.get("commit", "unknown")
        if machine["quick"]:
            sys.exit(f"{name} is of a QUICK run, expected a full one (make bench)")
        if not re.fullmatch(r"[0-9a-f]{12}", commit):
            sys.exit(f"{name} was measured at commit '{commit}', expected a commit as it is in git")
    measured.mkdir(parents=True, exist_ok=True)
    for name in about:
        shutil.copyfile(bench / f"{name}.csv", measured / f"{name}.csv")
    write_index(measured, {**read_index(measured), **about})


def main():
    words = argparse.ArgumentParser()
    words.add_argument("check", nargs="?", choices=["check"])
    words.add_argument("--bench", type=Path, default=OUT)
    words.add_argument("--measured", type=Path, default=MEASURED)
    words.add_argument("--readme", type=Path, default=Path("README.md"))
    given = words.parse_args()
    if not given.check:
        take(given.bench, given.measured)
    if not (given.measured / "methods.csv").exists():
        print(f"nothing to hold {given.readme} against: {given.measured}/methods.csv is missing (make measured)")
        return
    readme = given.readme.read_text()
    right = with_table(readme, methods(given.measured))
    if not given.check:
        given.readme.write_text(right)
    elif readme != right:
        lines = (text.splitlines(keepends=True) for text in (readme, right))
        sys.stdout.writelines(difflib.unified_diff(*lines, str(given.readme), str(given.measured), n=0))
        sys.exit(1)


main()
