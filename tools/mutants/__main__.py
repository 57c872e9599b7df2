"""`make mutants`: whether tests notice when one place of the core computes something else.

    tools/mutants [--sample N] [--seed S] [--seconds T] [--budget B] [--build FOLDER] [--data FOLDER] [-j N] [--only PATTERN] [--place K]

A copy of the sources is made in which each operator and many numbers of src/core are behind a switch (switches.h), and is compiled
once: the tests, and the program that tests of the command line run. Each test is run once, to see which places it comes to, and how
long it takes; those that take more than T seconds, and the suite "long", are left out. Each golden is a test of its own here. Then,
for each of N places drawn at random from those reached (0: all), the tests that come there run with that place switched, until one
fails, crashes or takes ten times as long, or B seconds of tests are over. Those that have noticed most so far for their seconds come
first. A place at which none does is a survivor: it is printed. What was found lies in FOLDER/mutants.csv.

Needs python3-clang-14. Places that no test reaches, and tests of the C interface, do not count.
"""
import argparse, csv, json, os, random, re, shutil, signal, subprocess, sys, time
from collections import defaultdict
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from clang import cindex

TOP = Path(__file__).resolve().parents[2]
KINDS = cindex.CursorKind
BINARY = {"<": "less", "<=": "less_equal", ">": "greater", ">=": "greater_equal", "==": "equal", "!=": "not_equal", "+": "plus",
          "-": "minus", "*": "times", "/": "divided", "%": "modulo", "&": "bit_and", "|": "bit_or", "<<": "shift_left",
          ">>": "shift_right"}
# Tests of libraries in which nothing is switched.
OTHER_LIBRARIES = "*test/c_api/*"
MEMORY = 6 << 20  # kilobytes of address space of a test


def copy(tree):
    """Copies the sources, but for those of the core, which are written by `compiled`; what is the same keeps its time."""
    for folder in ("src", "include", "test", "tools", "fixtures"):
        shutil.copytree(TOP / folder, tree / folder, dirs_exist_ok=True,
                        ignore=lambda path, names: [name for name in names if Path(path, name) == TOP / "src/core"])
    shutil.copy2(TOP / "Makefile", tree)
    shutil.copy2(TOP / "tools/mutants/switches.cpp", tree / "src/host/base")


def find_places(files, sources, flags):
    """The places of the core, from clang's syntax trees: {(file, offset, what): edits as `rewritten` takes them}, @ for the number."""
    index, places = cindex.Index.create(), {}
    for source in sources:
        unit = index.parse(str(source), args=flags)
        for problem in unit.diagnostics:
            if problem.severity >= cindex.Diagnostic.Error:
                sys.exit(f"{source}: {problem}")
        walk(unit.cursor, files, places)
    return places


def kind_of(cursor):
    try:
        return cursor.kind
    except ValueError:  # one that the package does not know
        return None


def walk(cursor, files, places):
    at_top = kind_of(cursor) == KINDS.TRANSLATION_UNIT
    for child in cursor.get_children():
        if at_top and child.location.file and Path(child.location.file.name).resolve() not in files:
            continue
        if kind_of(child) in (KINDS.STATIC_ASSERT, KINDS.ENUM_DECL):
            continue
        visit(child, cursor, files, places)
        walk(child, files, places)


def extent(cursor):
    return cursor.extent.start.offset, cursor.extent.end.offset


def visit(cursor, parent, files, places):
    file = cursor.location.file and Path(cursor.location.file.name).resolve()
    text = files.get(file)
    if text is None:
        return
    low, high = extent(cursor)
    kind = kind_of(cursor)
    size, children = high - low, sorted(map(extent, cursor.get_children()))
    if kind == KINDS.INTEGER_LITERAL:
        if kind_of(parent) in (KINDS.BINARY_OPERATOR, KINDS.UNEXPOSED_EXPR) and re.fullmatch(rb"[0-9]+", text[low:high]):
            places[file, low, "number"] = [(low, size, "mutant::number<@>("), (high, -size, ")")]
    elif kind == KINDS.UNARY_OPERATOR:
        if text[low:low + 1] == b"-" and children == [(low + 1, high)]:
            places[file, low, "negative"] = [(low, size, "mutant::negative<@>("), (low, 0, (1, "")), (high, -size, ")")]
    elif kind in (KINDS.BINARY_OPERATOR, KINDS.CALL_EXPR) and len(children) >= 2:
        # An overloaded operator's own name is a child between its operands.
        (a, b), *middle, (c, d) = children
        if a != low or d != high or not a < b <= c < d or any(m < b or n > c for m, n in middle):
            return
        between = text[b:c]
        operator, at = between.strip().decode(), b + len(between) - len(between.lstrip())
        if operator in BINARY:
            places[file, at, operator] = [(low, size, f"mutant::{BINARY[operator]}<@>("), (at, 0, (len(operator), ",")),
                                          (high, -size, ")")]
        elif operator in ("&&", "||"):
            # One of the two conditions is left out.
            for name, first, last in (("left", a, b), ("right", c, d)):
                size = last - first + 0.5  # outside of what begins and ends there
                end = ") || mutant::on(@))" if operator == "&&" else ") && !mutant::on(@))"
                places[file, at, f"{operator}, {name}"] = [(first, size, "(bool("), (last, -size, end)]


def rewritten(text, edits):
    """edits: (offset, size, what): text to insert, outermost first, or (length, text) to replace; sizes of ends are negative."""
    out, at = [], 0
    # At one offset what ends comes first, innermost first; then what begins, outermost first; then replacements.
    def order(edit):
        offset, size, _ = edit
        return (offset, 0, -size) if size < 0 else (offset, 1, -size)
    for offset, _, what in sorted(edits, key=order):
        out.append(text[at:offset].decode())
        at = offset
        if isinstance(what, str):
            out.append(what)
        elif what:
            out.append(what[1])
            at += what[0]
    out.append(text[at:].decode())
    return "".join(out)


def position(files, key):
    file, offset, _ = key
    before = files[file][:offset]
    return str(file.relative_to(TOP)), before.count(b"\n") + 1, offset - before.rfind(b"\n")


def compiled(tree, files, places, build, data):
    """Writes and compiles the copy, without the places that do not compile. {number: place} of those left. Which do not is kept."""
    numbers = {key: i for i, key in enumerate(places, 1)}
    flags = f"-O1 -w -include {tree}/tools/mutants/switches.h"
    make = ["make", "-k", f"-j{os.cpu_count()}", f"B={build}", f"DATA={data}", f"INSTRUMENTED={flags}", "MULTIVERSION="]
    # First the core alone: what does not compile is found there.
    core = [f"{build}/test/core/{a}/{path.relative_to(TOP / 'src/core').with_suffix('.o')}" for a in ("f32", "f64", "fixed")
            for path in files if path.suffix == ".cpp"]
    kept = tree.parent / "uncompiled.json"
    wrong = [(TOP / file, offset, what) for file, offset, what in (json.loads(kept.read_text()) if kept.exists() else ())]
    for key in wrong:
        places.pop(key, None)
    while True:
        edits = defaultdict(list)
        for key, parts in places.items():
            edits[key[0]] += [(o, s, w.replace("@", str(numbers[key])) if isinstance(w, str) else w) for o, s, w in parts]
        for file, text in files.items():
            target, new = tree / file.relative_to(TOP), rewritten(text, edits[file])
            if not target.exists() or target.read_text() != new:
                target.parent.mkdir(parents=True, exist_ok=True)
                target.write_text(new)
        run = subprocess.run([*make, *core], cwd=tree, capture_output=True, text=True)
        if run.returncode == 0:
            run = subprocess.run([*make, f"{build}/tests", f"{build}/wisp"], cwd=tree, capture_output=True, text=True)
        if run.returncode == 0:
            return {numbers[key]: key for key in places}
        # Left out are the places of lines that a message of the compiler names.
        named = {(file, int(line)) for file, line in re.findall(r"^(src/core/[^:]+):(\d+):", run.stderr, re.M)}
        found = [key for key in places if position(files, key)[:2] in named]
        if not found:
            sys.exit(run.stderr[-3000:])
        print(f"{len(found)} places do not compile", flush=True)
        wrong += found
        kept.write_text(json.dumps([(str(key[0].relative_to(TOP)), *key[1:]) for key in wrong]))
        for key in found:
            del places[key]


class Tests:
    """Those of the test program, by their numbers from 1 on, and behind them the goldens."""

    def __init__(self, build, seconds):
        self.program, self.wisp, self.seconds = build / "tests", build / "wisp", seconds
        self.filter = [f"--source-file-exclude={OTHER_LIBRARIES}", "--test-suite-exclude=long"]
        count = subprocess.run([self.program, "--count", *self.filter], capture_output=True, text=True).stdout
        self.cases = int(re.search(r"filters: (\d+)", count)[1])
        self.goldens = [line.split() for line in (TOP / "fixtures/goldens.txt").read_text().splitlines()]
        self.count = self.cases + len(self.goldens)

    def passes(self, test, seconds, **environment):
        """Whether test number `test` passes within so many seconds."""
        golden = self.goldens[test - self.cases - 1] if test > self.cases else None
        if golden:
            digest, arithmetic, scene, *options = golden
            words = [self.wisp, "render", TOP / "fixtures" / scene, *options, "--arith", arithmetic, "--digest"]
        else:
            words = [self.program, *self.filter, f"--first={test}", f"--last={test}"]
        run = subprocess.Popen(["sh", "-c", f'ulimit -v {MEMORY}; exec "$@"', "sh", *words], stdout=subprocess.PIPE,
                               stderr=subprocess.DEVNULL, start_new_session=True, env={**os.environ, **environment})
        try:
            out = run.communicate(timeout=seconds)[0]
            return run.returncode == 0 and (not golden or out.split()[:1] == [digest.encode()])
        except subprocess.TimeoutExpired:
            return False
        finally:
            try:
                os.killpg(run.pid, signal.SIGKILL)  # with the programs that it runs
            except ProcessLookupError:
                pass
            run.wait()

    def reach(self, test, file):
        """The seconds that a test takes, and the places it comes to; None where it is left out."""
        file.unlink(missing_ok=True)
        start = time.monotonic()
        if not self.passes(test, self.seconds, WISP_REACHED=str(file)) or not file.exists():
            return None
        return time.monotonic() - start, {int(line) for line in file.read_text().split()}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--sample", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--seconds", type=float, default=10)
    parser.add_argument("--budget", type=float, default=60)
    parser.add_argument("--build", type=Path, default=TOP / "build")
    parser.add_argument("--data", type=Path, default=TOP / "../shared/data")
    parser.add_argument("-j", type=int, default=os.cpu_count())
    parser.add_argument("--only", default="", help="places in files whose path has this")
    parser.add_argument("--place", type=int, help="this place alone")
    args = parser.parse_args()
    cindex.Config.set_library_file("/usr/lib/llvm-14/lib/libclang-14.so.1")
    build = args.build.resolve() / "mutants"
    tree = build / "tree"
    copy(tree)
    sources = sorted((TOP / "src/core").rglob("*.cpp"))
    files = {path.resolve(): path.read_bytes() for path in (TOP / "src/core").rglob("*") if path.suffix in (".h", ".cpp")}
    places = find_places(files, sources, ["-std=c++17", f"-I{TOP}/include", f"-I{TOP}/src", "-DWISP_ARITH=f32", "-DWISP_TRAP"])
    print(f"{len(places)} places", flush=True)
    numbered = compiled(tree, files, places, build / "objects", args.data.resolve())
    tests = Tests(build / "objects", args.seconds)
    (build / "reached").mkdir(exist_ok=True)

    # What tests come to is kept for as long as the program is the same.
    kept = build / "reach.json"
    if not kept.exists() or kept.stat().st_mtime < Path(tests.program).stat().st_mtime:
        with ThreadPoolExecutor(args.j) as pool:
            found = list(pool.map(lambda test: tests.reach(test, build / "reached" / str(test)), range(1, tests.count + 1)))
        kept.write_text(json.dumps([result and [result[0], sorted(result[1])] for result in found]))
    found = json.loads(kept.read_text())
    reached_by = defaultdict(list)
    for test, result in enumerate(found, 1):
        for place in result[1] if result else ():
            reached_by[place].append((result[0], test))
    print(f"{tests.count} tests, {found.count(None)} of them left out; they come to {len(reached_by)} of {len(numbered)} places", flush=True)

    drawn = sorted(place for place in reached_by if args.only in str(numbered[place][0]))
    random.Random(args.seed).shuffle(drawn)
    drawn = [args.place] if args.place else drawn[:args.sample or None]

    # For each test, in how many of its runs it has noticed something.
    runs, noticed = defaultdict(int), defaultdict(int)

    def killer(place):
        spent, left = 0, list(reached_by[place])
        while left:
            best = min(left, key=lambda t: t[0] * (runs[t[1]] + 2) / (noticed[t[1]] + 1))
            left.remove(best)
            seconds, test = best
            if spent + seconds > args.budget:
                continue
            spent += seconds
            runs[test] += 1
            if not tests.passes(test, 2 + 10 * seconds, WISP_MUTANT=str(place)):
                noticed[test] += 1
                return test
        return None

    killed = 0
    with ThreadPoolExecutor(args.j) as pool, open(build.parent / "mutants.csv", "w", newline="") as table:
        rows = csv.writer(table)
        rows.writerow(["place", "file", "line", "column", "what", "tests", "killed by"])
        for place, test in zip(drawn, pool.map(killer, drawn)):
            file, line, column = position(files, numbered[place])
            rows.writerow([place, file, line, column, numbered[place][2], len(reached_by[place]), test or ""])
            table.flush()
            killed += test is not None
            if test is None:
                print(f"{file}:{line}:{column}: survives: {numbered[place][2]} (place {place}, of {len(reached_by[place])} tests)",
                      flush=True)
    print(f"{killed} of {len(drawn)} mutants killed, {100 * killed / max(len(drawn), 1):.1f} %")


main()
