"""`make report`: what `make bench` measured as one page, build/report/index.html, and what is missing. It measures
nothing but how pictures differ. The page is page.html, in which `@part: a | b@` stands for what part(a, b) gives."""
import itertools, math, re, sys
from html import escape
from pathlib import Path

from tables import Table, read, value
from harness import DATA
from scaling import STAGES
from surfaces import WAYS
from targets import judge, percent
import pictures, plots

PAGE = Path("build/report/index.html")
TABLES = read()
QUICK = [name for name, table in TABLES.items() if table.machine.get("quick")]
MADE_BY = {"hard_cases.csv": "make hard-cases", "portability.csv": "make portability", "build/wisp": "make all",
           "build/truth/.*": "make truth", r"build/bench/(files)_.\.png": r"make bench SECTIONS=\1", "(limits|scaling).*csv": "make bench SECTIONS=scaling",
           r"(?:shadows_)?(.*)\.csv": r"make bench SECTIONS=\1", ".*": "a full make bench"}  # the first that fits
VERDICTS = {True: '<span class="met">✓ met</span>', False: '<span class="unmet">✗ not met</span>',
            None: '<span class="open">not known</span>', "quick": '<span class="open">QUICK: not judged</span>'}
SWEPT = {"seconds": [*STAGES, "total", "process"], "bytes": ["bytes", "process bytes"]}  # what is plotted of sweeps
shown, missing = set(), {}  # names of tables; what makes the files that are not there


def records(name):
    shown.add(name)
    return TABLES[name].records if name in TABLES else []


def shape(header, cell):
    """A cell as a reader likes it, as HTML: errors, which are parts of 1, in percent, long numbers with commas."""
    number = value(cell)
    if isinstance(number, str):
        return re.sub(r"(?<![\w.])\d{5,}(?![\w.])", lambda digits: f"{int(digits[0]):,}", escape(cell.strip()))
    if math.isnan(number):
        return cell.replace("-", "–")
    if re.search(r"^(relative )?RMSE|^own noise$|^without photons$", header):
        return f"{100 * number:.3g} %" if number else "0"
    return f"{number:,.0f}" if number == int(number) and abs(number) >= 10000 else cell.replace("-", "−")


def box(label, kind, header, kinds, rows):
    """A table of HTML, of columns of these kinds, in a box of its own that scrolls."""
    def line(cells, tags):
        cells = "".join(f'<t{tag} class="{kind}">{cell}</t{tag}>' for tag, kind, cell in zip(tags, kinds, cells))
        return f'<tr class="paper">{cells}</tr>' if ">the paper<" in cells else f"<tr>{cells}</tr>"
    body = "".join(line(cells, "h" + "d" * len(header)) for cells in rows)
    return (f'<div class="scroll" tabindex="0" role="region" aria-label="{escape(label)}"><table class="{kind}">'
            f'<thead>{line(header, "h" * len(header))}</thead><tbody>{body}</tbody></table></div>')


def drawn(table):
    columns = list(zip(*table.rows)) or [[]] * len(table.header)
    kinds = ["number" if not any(isinstance(value(cell), str) for cell in column) else
             "text" if i and max(map(len, column)) > 30 else "" for i, column in enumerate(columns)]
    return (box(table.title, "data many" if len(kinds) > 10 else "data", list(map(escape, table.header)), kinds,
                [map(shape, table.header, row) for row in table.rows])
            + (f'<p class="notes">{escape(table.notes)}</p>' if table.notes else ""))


def show(name, folded=False):
    """The table of this name with its title."""
    if name not in TABLES:
        raise FileNotFoundError(0, "not measured", f"{name}.csv")
    shown.add(name)
    machine = TABLES[name].machine
    title = escape(TABLES[name].title) + (" (QUICK)" if name in QUICK else "")
    if TABLES[name].released:
        title += f' (of the release, measured at {machine["commit"]}, {machine["when"][:10]})'
    table = drawn(TABLES[name])
    return f"<details><summary>{title}</summary>{table}</details>" if folded else f"<h3>{title}</h3>{table}"


def targets():
    verdicts, rows = [], []
    for *said, met in judge(TABLES):
        what, against, target, figure, error = map(escape, said)
        verdicts.append(met)
        rows.append((f"{what}<small>against {against}</small>", target, figure, error, VERDICTS[met]))
    good, bad = verdicts.count(True), verdicts.count(False)
    return (f'<p class="lead">{good} of {len(rows)} targets are met, {bad} are not, {len(rows) - good - bad} are not '
            "known.</p>" + box("Targets", "headline", ("What", "Target", "Figure", "Error", ""), [""] * 5, rows))


def conditions():
    """What tables were measured on; those of the same machine, program and settings together, as a column."""
    keys, groups = ("processor", "memory", "system", "wisp", "commit", "runs"), {}
    for name, table in TABLES.items():
        if table.machine:
            same = *(str(table.machine.get(key, "unknown")) for key in keys), "yes" if name in QUICK else "no", \
                "of the release" if table.released else "here"
            groups.setdefault(same, {})[name] = table
    if not groups:
        raise FileNotFoundError(0, "not measured", "build/bench/tables.json")
    columns = [("tables", *keys, "quick", "where", "load", "when", "spread of the runs")]
    for same, tables in groups.items():
        loads = sorted(float(table.machine["load"].split()[0]) for table in tables.values())
        times = sorted(table.machine["when"][:16].replace("T", " ") for table in tables.values())
        spreads = sorted(row["spread %"] for table in tables.values() for row in table.records
                         if math.isfinite(row.get("spread %", math.nan)))
        columns.append((", ".join(tables) if len(groups) > 1 else "all", *same, f"{loads[0]} to {loads[-1]}",
                        f"{times[0]} to {times[-1]}", f"{spreads[len(spreads) // 2]:.2g} % in the middle, "
                        f"{spreads[-1]:.2g} % at most" if spreads else "not known of a single run"))
    header, *rows = zip(*columns)
    return drawn(Table(header, rows))


def front():
    """Error against time of each setting, by family."""
    families, known = {}, [row for row in records("front") if math.isfinite(row["s"] + row["RMSE"])]
    for row in known:
        families.setdefault(row["family"], []).append((row["s"], row["RMSE"]))
    best = sorted(((row["s"], row["RMSE"]), row["what"]) for row in known if row["front"] == "yes")

    def mark(axes):
        axes.plot(*zip(*(point for point, _ in best)), color=plots.INK, linewidth=1, drawstyle="steps-post")
        direct = [("direct", (row["s"], row["RMSE"])) for row in known if row["what"].startswith("direct,")][-1:]
        for said, point in direct + [(i, point) for i, (point, _) in enumerate(best, 1)]:
            axes.annotate(said, point, (-4, -4), textcoords="offset points", ha="right", va="top", weight="bold")
    numbered = "".join(f"<li>{shape('what', what)}: {s:.3g} s, {percent(error)}</li>" for (s, error), what in best)
    return (plots.plot("front", "seconds", {"relative RMSE": families}, linestyle="", more=mark)
            + f'<ol class="front">{numbered}</ol>')


def culling(name):
    """What each way saves of visits and of tests, by frame."""
    panels = {f"{what} saved": {way: [(row["frame"], row[column]) for row in records(name) if column in row]
                                for way in WAYS if way != "trace" for column in [f"{way}: {what} saved %"]}
              for what in ("visits", "tests")}
    below = sorted((saved, way) for series in panels.values() for way, points in series.items()
                   for _, saved in points if saved < -25)
    return plots.plot(name, "frame", panels, caption=f"Cut off below −25 %: {len(below)} values, the least "
                      f"{below[0][0]:.4g} % of {below[0][1]}." if below else "")


def sweep(name):
    """Seconds and bytes against the size of a scene. A column has the same colour in all sweeps."""
    exponents = {(row["sweep"], row["of"], row["what"]): f": n<sup>{row['exponent']:.2f}</sup>"
                 for row in records("scaling") if math.isfinite(row["exponent"])}
    parts = []
    for of, rows in itertools.groupby(records(f"scaling_{name}"), lambda row: row["of"]):
        rows = list(rows)
        panels = {title: {column + exponents.get((name, of, column), ""):
                          [(row["n"], row[column]) for row in rows if row[column] >= 1e-4] for column in columns}
                  for title, columns in SWEPT.items()}
        parts.append(f"<h3>{name.capitalize()}: {of}</h3>" + plots.plot(f"{name} {of}", name, panels))
    return "".join(parts)


def count(name, columns, good):
    """How many have this result in all three arithmetics, which are columns of one row or rows that start alike."""
    results = [[row[column] for row in rows for column in columns.split(", ")]
               for _, rows in itertools.groupby(records(name), lambda row: next(iter(row.values())))]
    skipped = results.count(["skipped"])
    return f"{results.count([good] * 3)} of {len(results) - skipped}" + (f" ({skipped} skipped)" if skipped else "")


PARTS = {part.__name__: part for part in (targets, conditions, show, front, culling, sweep, count, pictures.pair,
                                           pictures.sheet)}
PARTS["bars"] = lambda name, *how: plots.bars(records(name), *how)
PARTS["quick"] = lambda: f"{len(QUICK)} of {len(TABLES)}"
PARTS["rest"] = lambda: "".join(show(name) for name in TABLES if name not in shown)


def fill(part):
    """What stands for a part, or for one whose file is not there."""
    try:
        return PARTS[part[1]](*(part[2].split(" | ") if part[2] else []))
    except FileNotFoundError as error:
        file = error.filename
        made_by = next(found.expand(how) for name, how in MADE_BY.items() if (found := re.fullmatch(name, file)))
        missing[file] = made_by
        return f'<p class="missing">Not measured: <code>{file}</code> is missing, <code>{made_by}</code> makes it.</p>'
    except KeyError as error:
        sys.exit(f"{part[0]} misses {error}: was a table made by another version of tools/measure?")


template = Path(__file__).with_name("page.html").read_text().replace("DATA", str(DATA))
PAGE.parent.mkdir(parents=True, exist_ok=True)
PAGE.write_text(re.sub(r"@(\w+)(?:: ([^@]*))?@", fill, template))
for file, made_by in missing.items():
    print(f"missing: {file} ({made_by})", file=sys.stderr)
print(f"the page is {PAGE}, {PAGE.stat().st_size / 1e6:.1f} MB")
