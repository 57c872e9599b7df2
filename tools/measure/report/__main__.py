"""What `make bench` measured as one page, build/report/index.html: `make report`, or

    /usr/bin/python3 tools/measure/report

from the top folder. It measures nothing itself but the differences of pictures. What is missing is said, on the page and here.
"""
import math, re, sys
from html import escape
from pathlib import Path

try:
    import matplotlib  # noqa: F401
except ImportError:
    sys.exit("matplotlib is not there for this Python, expected Debian's python3-matplotlib: make report-deps")

from tables import NotMeasured, number, read
from targets import judge, percent, place
import pictures, plots

PAGE = Path("build/report/index.html")
TABLES = read()
ARITHMETICS = "f32", "f64", "fixed"
MADE_BY = {"hard_cases": "make hard-cases", "portability": "make portability", "limits": "make bench SECTIONS=scaling"}
shown, missing = set(), {}  # names of tables; what makes those that are not there


# ------------------------------------------------------------------------------------------------------- parts of the page
# Errors as parts of 1 in these columns, shown in percent.
ERRORS = re.compile(r"^(relative )?RMSE|^own noise$|^without photons$")


def grouped(text):
    """Long numbers in a text with commas, for HTML."""
    return re.sub(r"(?<![\w.])\d{5,}(?![\w.])", lambda digits: f"{int(digits[0]):,}", escape(text.strip()))


def shape(header, cell):
    """A cell as a reader likes it."""
    value = number(cell)
    if math.isnan(value):
        return grouped(cell) if cell != "-" else "–"
    if ERRORS.search(header):
        return f"{100 * value:.3g} %" if value else "0"
    return f"{value:,.0f}" if value == int(value) and abs(value) >= 10000 else cell.replace("-", "−")


def box(label, kind, head, rows):
    """A table in a box of its own that scrolls."""
    return (f'<div class="scroll" tabindex="0" role="region" aria-label="{escape(label)}"><table class="{kind}"><thead><tr>{head}'
            f'</tr></thead><tbody>{"".join(rows)}</tbody></table></div>')


def drawn(table):
    """A row of the paper belongs to the row above."""
    columns = list(zip(*table.rows)) or [[]] * len(table.header)
    kinds = [' class="number"' if all(c in ("-", "") or not math.isnan(number(c)) for c in column) else
             ' class="text"' if i and max(map(len, column), default=0) > 30 else "" for i, column in enumerate(columns)]
    head = "".join(f"<th{kind}>{escape(title)}</th>" for title, kind in zip(table.header, kinds))
    rows = []
    for row in table.rows:
        cells = [f"<t{'d' if i else 'h'}{kind}>{shape(title, cell)}</t{'d' if i else 'h'}>"
                 for i, (kind, title, cell) in enumerate(zip(kinds, table.header, row))]
        rows.append(f'<tr{" class=paper" if row[0] == "  the paper" else ""}>{"".join(cells)}</tr>')
    return (box(table.title, "data many" if len(table.header) > 10 else "data", head, rows)
            + (f'<p class="notes">{escape(table.notes)}</p>' if table.notes else ""))


def show(name, folded=False):
    """The table of this name with its title, or what makes it."""
    if name not in TABLES:
        missing[name] = MADE_BY.get(name) or f"make bench SECTIONS={re.sub('^(shadows|frames)_', '', name)}"
        return f'<p class="missing">Not measured: <code>{name}.csv</code> is missing, <code>{missing[name]}</code> makes it.</p>'
    shown.add(name)
    title = escape(TABLES[name].title) + (" (QUICK)" if TABLES[name].quick else "")
    if folded:
        return f"<details><summary>{title}</summary>{drawn(TABLES[name])}</details>"
    return f"<h3>{title}</h3>{drawn(TABLES[name])}"


def section(key, title, lead, *parts):
    return key, title, f'<section id="{key}"><h2>{title}</h2><p class="lead">{lead}</p>{"".join(parts)}</section>'


def figure(drawing, caption=""):
    return f"<figure>{drawing}{f'<figcaption>{caption}</figcaption>' if caption else ''}</figure>"


def records(name):
    return TABLES[name].records if name in TABLES else []


# --------------------------------------------------------------------------------------------------------------- sections
def headline():
    judged = list(judge(TABLES))
    rows, verdicts = [], {True: '<span class="met">✓ met</span>', False: '<span class="unmet">✗ not met</span>',
                          None: '<span class="open">not known</span>'}
    for target in judged:
        if target.source not in TABLES:
            show(target.source)
        quick = target.source in TABLES and TABLES[target.source].quick and target.figure != "not measured"
        cells = [("target", escape(target.target)), ("figure", f"<strong>{escape(target.figure)}</strong>"),
                 ("error", escape(target.error)),
                 ("verdict", '<span class="open">QUICK: not judged</span>' if quick else verdicts[target.met])]
        rows.append(f"<tr><th>{escape(target.what)}<small>against {escape(target.against)}</small></th>"
                    + "".join(f'<td data-label="{label}">{cell}</td>' for label, cell in cells) + "</tr>")
    fair = [t.met for t in judged if t.met is not None and not TABLES[t.source].quick]
    return section("targets", "Targets",
                   f"{sum(fair)} of {len(judged)} targets are met, {len(fair) - sum(fair)} are not, {len(judged) - len(fair)} are "
                   "not known. Each is a ratio of two times, or of two sizes, of one run on one machine, and stands beside its "
                   "error: sooner and wrong is not sooner.",
                   box("Targets", "headline", "".join(f"<th>{head}</th>" for head in ("What", "Target", "Figure", "Error", "")), rows),
                   '<p class="notes">Errors of smoke are relative RMSE to <code>--reference</code>, which traces paths and shares '
                   "nothing with photons, at 32 x 32 pixels and without the reference's own noise. Those of the irradiance map are "
                   "to the same picture without one, those of the grid to pbrt's picture where there is smoke, of single "
                   "scattering to a plain marcher's.</p>")


def conditions():
    """What the tables were measured on; tables of the same machine, program and settings together."""
    groups, parts = {}, []
    for name, table in TABLES.items():
        if table.machine:
            same = tuple((key, table.machine.get(key)) for key in ("processor", "memory", "system", "wisp", "runs", "quick"))
            groups.setdefault(same, []).append(name)
    for same, names in groups.items():
        machines = [TABLES[name].machine for name in names]
        loads = [float(machine["load"].split()[0]) for machine in machines]
        spreads = sorted(spread for name in names for row in records(name)
                         if math.isfinite(spread := number(row.get("spread %"))))
        times = sorted(machine["when"][:16].replace("T", " ") for machine in machines)
        about = dict(same, runs=f"{dict(same)['runs']}, of which the median is shown", quick="yes" if dict(same)["quick"] else "no")
        about["spread of the runs"] = (f"{spreads[len(spreads) // 2]:.2g} % in the middle, {spreads[-1]:.2g} % at most: "
                                       "largest less smallest over the median") if spreads else "not known of a single run"
        about["load of the machine"] = f"{min(loads):g} to {max(loads):g}, where 1 is the measurement itself"
        about["when"] = f"{times[0]} to {times[-1]} UTC"
        if len(groups) > 1:
            about["tables"] = ", ".join(names)
        parts.append('<div class="scroll"><table>' + "".join(
            f"<tr><th>{escape(key)}</th><td>{escape(str(value))}</td></tr>" for key, value in about.items()) + "</table></div>")
    return section("machine", "What it was measured on", "One core, everything that is compared in turn, so that a busy moment "
                   "hits both. Seconds are this machine's; ratios should travel, as far as processors are alike.",
                   *(parts or ['<p class="missing">Nothing was measured yet.</p>']))


def papers():
    return section("papers", "The paper's tables beside ours",
                   "Rows in italics are the paper's. Its seconds are of its own machine, so only gains compare: <em>gain</em> is the "
                   "time of the first row over this one's, <em>ratio</em> our gain over the paper's. Where a ratio is below 1, the "
                   "paper gains more.", *(show(f"table_{i}") for i in (1, 2, 3, 4)))


def front():
    plot = ""
    rows = [(row["family"], number(row["s"]), number(row["RMSE"]), row) for row in records("front")]
    known = [row for row in rows if math.isfinite(row[1] + row[2])]
    if known:
        families = {family: i for i, family in enumerate(dict.fromkeys(row[0] for row in known))}
        best = sorted(((*row[:3], row[3]["what"]) for row in rows if row[3]["front"] == "yes"), key=lambda point: point[1])
        direct = [row[:3] for row in rows if row[3]["what"].startswith("direct,")][-1]
        plot = figure(plots.legend(families) + plots.front([row[:3] for row in known], families, best, direct)) + (
            '<ol class="front">' + "".join(f"<li>{grouped(what)}: {seconds:.3g} s, {percent(error)}</li>"
                                           for _, seconds, error, what in best) + "</ol>")
    elif rows:
        plot = ('<p class="missing">This run has no reference, so there are no errors to plot: <code>make truth</code> traces one '
                "in two hours, and a full <code>make bench</code> does so first.</p>")
    return section("front", "Error against time", "Each point is one setting, all of the same smoke. Down and to the left is better; "
                   "the numbered ones are the front, where nothing else is both sooner and nearer to the reference.",
                   plot, show("front", folded=bool(rows)), show("shortcuts"))


WAYS = {"exact": 0, "exact each frame alone": 1, "cache": 2, "paper": 3, "lightbuffer": 4, "lie": 5, "voxel": 6}


def culling():
    parts = []
    for name, of in (("kitchen", "BART Kitchen, the paper's figure 7"), ("robots", "BART Robots, the paper's figure 8"),
                     ("walk", "Kitchen, nothing moves but the camera"), ("zoom", "Kitchen, the camera comes nearer")):
        rows = records(f"frames_{name}")
        parts.append(f"<h3>{of}</h3>")
        if rows:
            shown.add(f"frames_{name}")
            panels = {f"{what} saved": {way: (i, [number(row[f"{way}: {what} saved %"]) for row in rows])
                                        for way, i in WAYS.items() if f"{way}: {what} saved %" in rows[0]}
                      for what in ("visits", "tests")}
            below = sorted((value, way) for series in panels.values() for way, (_, values) in series.items() for value in values
                           if value < -25)
            parts.append(figure(plots.legend(WAYS, dashes=True) + plots.lines(
                name, of, [int(row["frame"]) for row in rows], panels, "frame", percent=True),
                f"Cut off below −25 %: {len(below)} values, the least {below[0][0]:.4g} % of {below[0][1]}." if below else ""))
        parts.append(show(f"shadows_{name}", folded=bool(rows)))
    return section("culling", "Shadow culling, frame by frame",
                   "Node visits and triangle tests of shadow rays that each way saves, against tracing every ray, with all of its own "
                   "work counted: proofs, lists, first occluders. The paper's figures 7 and 8 have the two counts by frame; these are "
                   "what is saved of them. What saves most work does not always save most time.", *parts)


def instructions():
    rows = {row["stage"]: [100 * number(row["part"])] for row in records("instructions")}
    plot = figure(plots.bars("instructions", "Instructions by stage", {"% of all": rows}, form="{:.1f} %")) if rows else ""
    return section("instructions", "Instructions by stage",
                   "Counted by valgrind, so they depend on the compiler and not on the machine's mood: where the work of a picture "
                   "goes, and below what a scene pays for each thing that is in it.", plot, show("instructions", folded=bool(plot)),
                   show("needs"))


def arithmetics():
    ratios = {row["arithmetic"]: [number(row["ratio to f32"])] for row in records("arithmetics") if row["ratio to f32"] != "-"}
    plot = figure(plots.bars("ratios", "Time over that of f32", {"time, f32 = 1": ratios}, one=True)) if ratios else ""
    return section("arithmetics", "Three arithmetics", "One source in 32-bit float, 64-bit float and fixed-point integers. Photons "
                   "that decide a collision the other way go elsewhere: another seed makes as much of a difference, or more.",
                   plot, show("arithmetics"))


def others():
    """How many times as fast as another program: bars per table, by panel, row and series."""
    panels = {"rays": {}, "shadow_rays": {}, "point_tree": {}}

    def add(name, panel, row, *cells):
        panels[name].setdefault(panel, {}).setdefault(row, []).extend(map(number, cells))
    for row in records("rays"):
        if row["arithmetic"] == "f32" and row["what"] == "Mrays/s" and row["who"] in ("Embree sse2", "Embree"):
            add("rays", place(row["scene"]), row["rays"], row["ratio"])
    for row in records("shadow_rays"):
        if row["arithmetic"] == "f32" and not row["way"].startswith("Embree"):
            add("shadow_rays", place(row["scene"]), row["way"], row["over Embree sse2"], row["over Embree"])
    for row in records("point_tree"):
        if row["way"] == "wisp":
            add("point_tree", f"queries in {row['queries']} order", row["what"].rsplit(" ", 1)[0], row["ratio"])
    parts = []
    for name, title, series in (("rays", "Rays, f32", {"to Embree with sse2": 0, "to its widest vectors": 1}),
                                ("shadow_rays", "Shadow rays resolved a second, f32", {"to Embree with sse2": 0, "to its widest vectors": 1}),
                                ("point_tree", "Point tree, best of nanoflann and a cell list", {})):
        plot = panels[name] and figure(plots.legend(series) + plots.bars(name, title, panels[name], one=True, form="{:.2f}"))
        parts += [f"<h3>{title}</h3>", plot or "", show(name, folded=bool(plot))]
    return section("others", "Beside other programs",
                   "How many times as fast as the other program wisp is, one thread each; right of the line at 1 wisp is sooner. "
                   "Embree does not give the same bits on every machine, and is not asked to.", *parts, show("grid"),
                   show("povray") if "povray" in TABLES else "")


def scaling():
    exponents = {(row["sweep"], row["of"], row["what"]): row["exponent"] for row in records("scaling")}
    parts = []
    for name in [name for name in TABLES if name.startswith("scaling_")]:
        sweep = name.removeprefix("scaling_")
        columns = [head for head in TABLES[name].header if head not in ("of", "n", "spread %", "bytes/n")]
        for of in dict.fromkeys(row["of"] for row in records(name)):
            rows, panels, keys = [row for row in records(name) if row["of"] == of], {}, {}
            for title in ("seconds", "bytes"):
                # A column has the colour of its number in all sweeps.
                for i, head in enumerate(head for head in columns if ("bytes" in head) == (title == "bytes")):
                    values = [number(row[head]) for row in rows]
                    if sum(value > 0 for value in values) > 1:
                        panels.setdefault(title, {})[head] = i, values
                        slope = number(exponents.get((sweep, of, head)))
                        keys[escape(head) + (f": n<sup>{slope:.2f}</sup>" if math.isfinite(slope) else "")] = i
            plot = plots.lines(f"{name}_{of}", f"{sweep}: {of}", [number(row["n"]) for row in rows], panels, sweep)
            parts.append(f"<h3>{escape(sweep.capitalize())}: {escape(of)}</h3>" + figure(plots.legend(keys) + plot))
        parts.append(show(name, folded=True))
    return section("scaling", "What grows with what",
                   "Seconds of each stage and bytes against the size of a scene, both logarithmic: a straight line of slope 1 is "
                   "proportional. Exponents are slopes over the upper half of the range, and hold there alone. What lasts less than "
                   "a tenth of a millisecond is not drawn.", *parts, show("scaling"), show("limits", folded=True))


def compared():
    html, files = pictures.pairs() if Path(pictures.WISP).exists() else ("", [pictures.WISP])
    missing.update({file: "make all" if file == pictures.WISP else "a full make bench" for file in files})
    note = ('<p class="missing">Pairs are left out for want of ' + ", ".join(f"<code>{escape(file)}</code>" for file in files)
            + ".</p>") if files else ""
    return section("pictures", "Pictures",
                   "Drag the line, or give it the focus and use the arrow keys. Beside each pair: the absolute difference of the "
                   "linear values, brightened as often as is said, and the difference that an eye perceives. Both can look dramatic "
                   "where the figures do not.", html, note)


def hard_cases():
    rows = records("hard_cases")
    passed = sum(all(row[a] == "passed" for a in ARITHMETICS) for row in rows)
    return section("hard", "Hard cases", f"{passed} of {len(rows)} pass in all three arithmetics. Each is something that goes wrong "
                   "in renderers, with the outcome that is right and a test of its own.", show("hard_cases", folded=bool(rows)))


def determinism():
    targets = {}
    for row in records("portability"):
        cells = targets.setdefault(row["target"], {"with": row["with"]})
        for arithmetic in ARITHMETICS if row["arithmetic"] == "-" else (row["arithmetic"],):
            cells[arithmetic] = row["bits"] if row["pictures"] == "-" else f"{row['pictures']} {row['bits']}"
    if targets:
        table = TABLES["portability"]
        table.header = ["target", *ARITHMETICS, "with"]
        table.rows = [[target, *(cells.get(head, "-") for head in table.header[1:])] for target, cells in targets.items()]
    run = [cells for cells in targets.values() if any("skipped" not in cells.get(a, "-") for a in ARITHMETICS)]
    same = sum(all(cells.get(a, "-").endswith("same") for a in ARITHMETICS) for cells in run)
    return section("bits", "The same bits elsewhere",
                   f"{same} of {len(run)} compilers and processors that were tried give every picture with the same bits in each "
                   f"arithmetic. Skipped for want of a compiler or an emulator: {len(targets) - len(run)}.", show("portability"))


def main():
    sections = [headline(), conditions(), papers(), front(), culling(), others(), arithmetics(), instructions(), scaling(),
                compared(), hard_cases(), determinism()]
    left = [name for name in TABLES if name not in shown]
    if left:
        sections.append(section("rest", "Also measured", "Tables without a section of their own.", *map(show, left)))
    quick = sum(table.quick for table in TABLES.values())
    banner = (f'<p class="banner" role="note"><strong>{quick} of {len(TABLES)} tables are of a QUICK run.</strong> Pictures are '
              "smaller, photons, views and frames fewer, and there is one run of each: they say whether everything works, not how "
              "fast it is. No target is judged by them.</p>") if quick else ""
    body = ["<header><h1>wisp, measured</h1><p class=\"lead\">A renderer for smoke and animated triangles whose every picture is "
            "reproducible to the last bit. This page is what it costs, how wrong it is, and where others are better.</p></header>",
            banner, '<nav aria-label="Sections">', *(f'<a href="#{key}">{title}</a>' for key, title, _ in sections), "</nav><main>",
            *(html for _, _, html in sections), "</main>"]
    PAGE.parent.mkdir(parents=True, exist_ok=True)
    PAGE.write_text(Path(__file__).with_name("page.html").read_text().replace("@BODY@", "\n".join(body)))
    for name, made_by in missing.items():
        print(f"missing: {name} ({made_by})", file=sys.stderr)
    print(f"the page is {PAGE}, {PAGE.stat().st_size / 1e6:.1f} MB")


try:
    main()
except KeyError as error:
    sys.exit(f"a table has no column {error}, expected it: was it made by another version of tools/measure?")
