"""What `make bench` measured as one page, build/report/index.html: `make report`, or

    /usr/bin/python3 tools/measure/report/report.py

from the top folder. It measures nothing itself but the differences of pictures. What is missing is said, on the page and here.
"""
import math, re, sys
from html import escape
from pathlib import Path

try:
    import matplotlib  # noqa: F401
except ImportError:
    sys.exit("matplotlib is not there for this Python, expected Debian's python3-matplotlib: make report-deps")

import pictures, plots
from measured import WISP, NotMeasured, number, read
from targets import judge, percent, place

PAGE = Path("build/report/index.html")
TABLES = read()
shown, missing = set(), {}  # names of tables; what makes those that are not there


# ----------------------------------------------------------------------------------------------------------------- tables
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


def drawn(table):
    """A table in a box of its own that scrolls; a row of the paper belongs to the row above."""
    columns = list(zip(*table.rows)) or [[]] * len(table.header)
    right = [all(c == "-" or c == "" or not math.isnan(number(c)) for c in column) for column in columns]
    kinds = [' class="number"' if numeric else ' class="text"' if i and max(map(len, column), default=0) > 30 else ""
             for i, (numeric, column) in enumerate(zip(right, columns))]
    out = [f'<div class="scroll" tabindex="0" role="region" aria-label="{escape(table.title)}">'
           f'<table class="data{" many" if len(table.header) > 10 else ""}"><thead><tr>',
           *(f"<th{kind}>{escape(head)}</th>" for head, kind in zip(table.header, kinds)), "</tr></thead><tbody>"]
    for row in table.rows:
        tag = ["th"] + ["td"] * (len(row) - 1)
        out.append(f'<tr{" class=paper" if row[0] == "  the paper" else ""}>')
        out += [f"<{t}{kind}>{shape(head, cell)}</{t}>" for t, kind, head, cell in zip(tag, kinds, table.header, row)]
        out.append("</tr>")
    out.append("</tbody></table></div>")
    if table.notes:
        out.append(f'<p class="notes">{escape(table.notes)}</p>')
    return "".join(out)


def absent(name, made_by=None):
    missing[name] = made_by or f"make bench SECTIONS={name}"
    return f'<p class="missing">Not measured: <code>{name}.csv</code> is missing, <code>{missing[name]}</code> makes it.</p>'


def show(name, section=None, folded=False):
    """The table of this name with its title, or what makes it."""
    if name not in TABLES:
        return absent(name, section and f"make bench SECTIONS={section}")
    shown.add(name)
    table = TABLES[name]
    quick = " (QUICK)" if table.quick else ""
    if folded:
        return f"<details><summary>{escape(table.title)}{quick}</summary>{drawn(table)}</details>"
    return f"<h3>{escape(table.title)}{quick}</h3>{drawn(table)}"


def section(key, title, lead, *parts):
    return key, title, f'<section id="{key}"><h2>{title}</h2><p class="lead">{lead}</p>{"".join(parts)}</section>'


def figure(drawing, caption=""):
    return f"<figure>{drawing}{f'<figcaption>{caption}</figcaption>' if caption else ''}</figure>"


# --------------------------------------------------------------------------------------------------------------- sections
def headline():
    judged = list(judge(TABLES))
    rows = []
    for target in judged:
        table = TABLES.get(target.source)
        if table is None:
            missing.setdefault(target.source, f"make bench SECTIONS={target.source.replace('shadows_', '')}")
        if table and table.quick and target.figure != "not measured":
            verdict = '<span class="open">QUICK: not judged</span>'
        else:
            verdict = {True: '<span class="met">✓ met</span>', False: '<span class="unmet">✗ not met</span>',
                       None: '<span class="open">not known</span>'}[target.met]
        cells = [("target", escape(target.target)), ("figure", f"<strong>{escape(target.figure)}</strong>"),
                 ("error", escape(target.error)), ("verdict", verdict)]
        rows.append(f"<tr><th>{escape(target.what)}<small>against {escape(target.against)}</small></th>"
                    + "".join(f'<td data-label="{label}">{cell}</td>' for label, cell in cells) + "</tr>")
    fair = [t for t in judged if t.met is not None and not TABLES[t.source].quick]
    count = (f"{sum(t.met for t in fair)} of {len(judged)} targets are met, {sum(not t.met for t in fair)} are not, "
             f"{len(judged) - len(fair)} are not known.")
    return section("targets", "Targets",
                   f"{count} Each is a ratio of two times, or of two sizes, of one run on one machine, and "
                   "stands beside its error: sooner and wrong is not sooner.",
                   '<div class="scroll" tabindex="0" role="region" aria-label="Targets">'
                   '<table class="headline"><thead><tr><th>What'
                   "</th><th>Target</th><th>Figure</th><th>Error</th><th></th></tr></thead><tbody>",
                   "".join(rows), "</tbody></table></div>",
                   '<p class="notes">Errors of smoke are relative RMSE to <code>--reference</code>, which traces paths '
                   "and shares nothing with photons, at 32 x 32 pixels and without the reference's own noise. Those of the "
                   "irradiance map are to the same picture without one, those of the grid to pbrt's picture where there is "
                   "smoke, of single scattering to a plain marcher's.</p>")


def conditions():
    """What the tables were measured on; tables of the same machine, program and settings together."""
    groups = {}
    for name, table in TABLES.items():
        if table.machine:
            same = tuple((key, table.machine.get(key)) for key in ("processor", "memory", "system", "wisp", "runs", "quick"))
            groups.setdefault(same, []).append(name)
    parts = []
    for same, names in groups.items():
        machines = [TABLES[name].machine for name in names]
        loads = [float(machine["load"].split()[0]) for machine in machines]
        spreads = [number(row["spread %"]) for name in names for row in TABLES[name].records if "spread %" in row]
        spreads = sorted(spread for spread in spreads if math.isfinite(spread))
        about = dict(same)
        about["quick"] = "yes" if about["quick"] else "no"
        about["runs"] = f"{about['runs']}, of which the median is shown"
        about["spread of the runs"] = (f"{spreads[len(spreads) // 2]:.2g} % in the middle, {spreads[-1]:.2g} % at most: "
                                       "largest less smallest over the median") if spreads else "not known of a single run"
        about["load of the machine"] = f"{min(loads):g} to {max(loads):g}, where 1 is the measurement itself"
        times = sorted(machine["when"][:16].replace("T", " ") for machine in machines)
        about["when"] = f"{times[0]} to {times[-1]} UTC"
        if len(groups) > 1:
            about["tables"] = ", ".join(names)
        parts.append('<div class="scroll"><table>' + "".join(
            f"<tr><th>{escape(key)}</th><td>{escape(str(value))}</td></tr>" for key, value in about.items()) + "</table></div>")
    return section("machine", "What it was measured on", "One core, everything that is compared in turn, so that a busy moment "
                   "hits both. Seconds are this machine's; ratios should travel, as far as processors are alike.",
                   *(parts or ['<p class="missing">Nothing was measured yet.</p>']))


def papers():
    lead = ("Rows in italics are the paper's. Its seconds are of its own machine, so only gains compare: <em>gain</em> is "
            "the time of the first row over this one's, <em>ratio</em> our gain over the paper's. Where a ratio is below 1, "
            "the paper gains more.")
    try:
        takes = [f"{way} takes {number(row['total s']):.3g} s, its error is {percent(number(row['RMSE']))}"
                 for way, row in ((way, TABLES["table_2"].row(way=way)) for way in ("direct", "default"))]
        lead = f"In Table 2 {takes[0]}; {takes[1]}. " + lead
    except (KeyError, NotMeasured):
        pass
    return section("papers", "The paper's tables beside ours", lead, *(show(f"table_{i}") for i in (1, 2, 3, 4)))


def front():
    lead = ("Each point is one setting, all of the same smoke. Down and to the left is better; the "
            "numbered ones are the front, where nothing else is both sooner and nearer to the reference.")
    if "front" not in TABLES:
        return section("front", "Error against time", lead, show("front"), show("shortcuts"))
    records = TABLES["front"].records
    points = [(row["family"], number(row["s"]), number(row["RMSE"])) for row in records]
    known = [point for point in points if math.isfinite(point[1] + point[2])]
    if known:
        families = list(dict.fromkeys(point[0] for point in known))
        best = sorted([(*point, row["what"]) for point, row in zip(points, records) if row["front"] == "yes"],
                      key=lambda point: point[1])
        direct = [p for p, row in zip(points, records) if row["what"].startswith("direct,")][-1]
        better = sum(seconds < direct[1] and error <= direct[2] for _, seconds, error in known)
        lead += (f" Direct with the paper's photons takes {direct[1]:.3g} s and errs by {percent(direct[2])}; {better} of "
                 f"{len(known) - 1} other settings are both sooner and nearer.")
        plot = figure(plots.legend([(f, i, plots.MARKERS[i][1]) for i, f in enumerate(families)])
                      + plots.front(points, families, best, direct)) + '<ol class="front">' + "".join(
            f"<li>{grouped(what)}: {seconds:.3g} s, {percent(error)}</li>" for _, seconds, error, what in best) + "</ol>"
    else:
        plot = ('<p class="missing">This run has no reference, so there are no errors to plot: <code>make truth</code> '
                "traces one in two hours, and a full <code>make bench</code> does so first.</p>")
    return section("front", "Error against time", lead, plot, show("front", folded=True), show("shortcuts"))


# label: colour, dash, width
WAYS = {"exact": (0, 0, 3), "paper": (3, 0, 3), "exact each frame alone": (0, 1, 1.6), "cache": (2, 2, 1.6),
        "lightbuffer": (4, 3, 1.6), "voxel": (1, 4, 1.6), "lie": (5, 5, 1.6)}


def culling():
    parts = []
    for name, of in (("kitchen", "BART Kitchen, the paper's figure 7"), ("robots", "BART Robots, the paper's figure 8"),
                     ("walk", "Kitchen, nothing moves but the camera"), ("zoom", "Kitchen, the camera comes nearer")):
        parts.append(f"<h3>{of}</h3>")
        if f"frames_{name}" not in TABLES:
            parts.append(absent(f"frames_{name}", f"make bench SECTIONS={name}"))
            continue
        shown.add(f"frames_{name}")
        records = TABLES[f"frames_{name}"].records
        panels = {f"{what} saved": {label: [number(row[f"{label}: {what} saved %"]) for row in records] for label in WAYS
                                    if f"{label}: {what} saved %" in records[0]} for what in ("visits", "tests")}
        below = sorted((value, label) for lines in panels.values() for label, values in lines.items() for value in values
                       if value < -25)
        numbers = [int(row["frame"]) for row in records]
        parts.append(figure(plots.legend([(label, colour, plots.DASHES[dash]) for label, (colour, dash, _) in WAYS.items()])
                            + plots.frames(name, of, numbers, panels, WAYS),
                            f"Cut off below −25 %: {len(below)} values, the least {below[0][0]:.4g} % of {below[0][1]}."
                            if below else ""))
        parts.append(show(f"shadows_{name}", name, folded=True))
    lead = ("Node visits and triangle tests of shadow rays that each way saves, against tracing every ray, with all of its own "
            "work counted: proofs, lists, first occluders. The paper's figures 7 and 8 have the two counts by frame; these "
            "are what is saved of them. What saves most work does not always save most time.")
    for name, of in (("kitchen", "Kitchen"), ("robots", "Robots")):
        try:
            exact, paper = (TABLES[f"shadows_{name}"].row(method=method) for method in ("exact", "paper"))
        except (KeyError, NotMeasured):
            continue
        lead += (f" On {of} <em>exact</em> saves {exact['visits saved %']} % of visits with {exact['wrong pixels']} wrong "
                 f"pixels, <em>paper</em> {paper['visits saved %']} % with {paper['wrong pixels']}; tracing all takes "
                 f"{exact['trace / this']} and {paper['trace / this']} times as long as they do.")
    return section("culling", "Shadow culling, frame by frame", lead, *parts)


def instructions():
    if "instructions" not in TABLES:
        plot = most = ""
    else:
        rows = {row["stage"]: [100 * number(row["part"])] for row in TABLES["instructions"].records}
        stage = max(rows, key=lambda stage: rows[stage][0])
        most = f" Most go to {escape(stage)}: {rows[stage][0]:.3g} %."
        plot = figure(plots.bars("instructions", "Instructions by stage", {"% of all instructions": rows}, form="{:.1f} %"))
    return section("instructions", "Instructions by stage",
                   "Counted by valgrind, so they depend on the compiler and not on the machine's mood: where the work of a "
                   "picture goes, and below what a scene pays for each thing that is in it." + most, plot,
                   show("instructions", folded=bool(plot)), show("needs"))


def arithmetics():
    plot, lead = "", "One source in 32-bit float, 64-bit float and fixed-point integers."
    if "arithmetics" in TABLES:
        records = TABLES["arithmetics"].records
        ratios = {row["arithmetic"]: [number(row["ratio to f32"])] for row in records if row["ratio to f32"] != "-"}
        errors = {row["arithmetic"]: [number(row["relative RMSE"]), number(row["without photons"])] for row in records
                  if row["arithmetic"] != "f64"}
        plot = figure(plots.bars("ratios", "Time over that of f32", {"time, f32 = 1": ratios}, one=True)
                      + plots.legend([("with photons", 0, "●"), ("without", 1, "■")])
                      + plots.errors(errors, 2))
        most = [max((values[i] for values in errors.values() if values[1] > 0), default=math.nan) for i in (0, 1)]
        lead += (f" Without photons they are within {percent(most[1])} of f64. With photons some decide a collision the other "
                 f"way and go elsewhere: {percent(most[0])}, where another seed makes {percent(list(errors.values())[-1][0])}.")
    return section("arithmetics", "Three arithmetics", lead, plot, show("arithmetics"))


def embree(name, columns):
    """Panels of scenes: per row, ratios in COLUMNS."""
    panels = {}
    for row in TABLES[name].records if name in TABLES else []:
        if row["arithmetic"] != "f32":
            continue
        if name == "rays" and row["what"] == "Mrays/s" and row["who"] in columns:
            panels.setdefault(place(row["scene"]), {}).setdefault(row["rays"], []).append(number(row["ratio"]))
        elif name == "shadow_rays" and not row["way"].startswith("Embree"):
            panels.setdefault(place(row["scene"]), {})[row["way"]] = [number(row[column]) for column in columns]
    if not panels:
        return ""
    key = plots.legend([("to Embree with sse2", 0, "■"), ("to its widest vectors", 1, "■")])
    return figure(key + plots.bars(name, "Speed over that of Embree", panels, one=True, form="{:.2f}"))


def others():
    tree = ""
    if "point_tree" in TABLES:
        panels = {}
        for row in TABLES["point_tree"].records:
            if row["way"] == "wisp":
                panel = panels.setdefault(f"queries in {row['queries']} order", {})
                panel[row["what"].rsplit(" ", 1)[0]] = [number(row["ratio"])]
        tree = figure(plots.bars("point_tree", "Speed of the point tree over that of the best rival", panels, columns=2,
                                 one=True, form="{:.2f}"))
    return section("others", "Beside other programs",
                   "How many times as fast as the other program wisp is, one thread each; right of the line at 1 wisp is "
                   "sooner. Embree does not give the same bits on every machine, and is not asked to.",
                   "<h3>Rays, f32</h3>", embree("rays", ["Embree sse2", "Embree"]), show("rays", folded="rays" in TABLES),
                   "<h3>Shadow rays resolved a second, f32</h3>", embree("shadow_rays", ["over Embree sse2", "over Embree"]),
                   show("shadow_rays", folded="shadow_rays" in TABLES),
                   "<h3>Point tree, best of nanoflann and a cell list</h3>", tree, show("point_tree", folded=bool(tree)),
                   show("grid"), show("povray") if "povray" in TABLES else "")


def grown(name, of, records, exponents):
    """A plot of the rows of one sweep: seconds and bytes against n."""
    n = [number(row["n"]) for row in records]
    columns = [head for head in TABLES[name].header if head not in ("of", "n", "spread %", "bytes/n")]
    panels = {}
    for title, heads in (("seconds", [head for head in columns if "bytes" not in head]),
                         ("bytes", [head for head in columns if "bytes" in head])):
        # A column has the colour of its number in all sweeps.
        lines = {head: (i, [number(row[head]) for row in records]) for i, head in enumerate(heads)}
        panels[title] = {head: line for head, line in lines.items() if sum(value > 0 for value in line[1]) > 1}
    sweep = name.removeprefix("scaling_")

    def said(head):
        found = exponents.get((sweep, of, head), "-")
        return escape(head) if found == "-" else f"{escape(head)}: n<sup>{number(found):.2f}</sup>"
    keys = [(said(head), i, plots.MARKERS[i][1]) for lines in panels.values() for head, (i, _) in lines.items()]
    return f"<h3>{escape(sweep.capitalize())}: {escape(of)}</h3>" + figure(
        plots.legend(keys) + plots.scaling(f"{name}_{of}", f"{sweep}: {of}", n, panels, sweep))


def scaling():
    lead = ("Seconds of each stage and bytes against the size of a scene, both logarithmic: a straight line of slope 1 is "
            "proportional. Exponents are slopes over the upper half of the range, and hold there alone. What lasts less than "
            "a tenth of a millisecond is not drawn.")
    if "scaling" not in TABLES:
        return section("scaling", "What grows with what", lead, absent("scaling"))
    exponents = {(row["sweep"], row["of"], row["what"]): row["exponent"] for row in TABLES["scaling"].records}
    parts = []
    for name in [name for name in TABLES if name.startswith("scaling_")]:
        records = TABLES[name].records
        parts += [grown(name, of, [row for row in records if row["of"] == of], exponents)
                  for of in dict.fromkeys(row["of"] for row in records)]
        parts.append(show(name, folded=True))
    return section("scaling", "What grows with what", lead, *parts, show("scaling"), show("limits", "scaling", folded=True))


def compared():
    html, files = pictures.pairs() if Path(WISP).exists() else ("", [WISP])
    for file in files:
        missing[file] = "make all" if file == WISP else "a full make bench"
    note = ('<p class="missing">Pairs are left out for want of ' + ", ".join(f"<code>{escape(file)}</code>" for file in files)
            + ".</p>") if files else ""
    return section("pictures", "Pictures",
                   "Drag the line, or give it the focus and use the arrow keys. Beside each pair: the absolute "
                   "difference of the linear values, brightened as often as is said, and the difference that an eye perceives. "
                   "Both can look dramatic where the figures do not.", html, note)


def hard_cases():
    if "hard_cases" not in TABLES:
        return section("hard", "Hard cases", "What goes wrong in renderers, each with the outcome that is right and a test.",
                       absent("hard_cases", "make hard-cases"))
    records = TABLES["hard_cases"].records
    passed = sum(all(row[a] == "passed" for a in ("f32", "f64", "fixed")) for row in records)
    return section("hard", "Hard cases",
                   f"{passed} of {len(records)} pass in all three arithmetics. Each is something that goes wrong in "
                   "renderers, with the outcome that is right and a test of its own.", show("hard_cases", folded=True))


def determinism():
    if "portability" not in TABLES:
        return section("bits", "The same bits elsewhere", "Goldens from other compilers and processors, picture by picture.",
                       absent("portability", "make portability"))
    targets = {}
    table = TABLES["portability"]
    for row in table.records:
        cells = targets.setdefault(row["target"], {"with": row["with"]})
        for arithmetic in ("f32", "f64", "fixed") if row["arithmetic"] == "-" else (row["arithmetic"],):
            cells[arithmetic] = row["bits"] if row["pictures"] == "-" else f"{row['pictures']} {row['bits']}"
    table.header = ["target", "f32", "f64", "fixed", "with"]
    table.rows = [[target, *(cells.get(head, "-") for head in table.header[1:])] for target, cells in targets.items()]
    run = [row for row in table.rows if any("skipped" not in cell for cell in row[1:4])]
    same = sum(all(cell.endswith("same") for cell in row[1:4]) for row in run)
    return section("bits", "The same bits elsewhere",
                   f"{same} of {len(run)} compilers and processors that were tried give every picture "
                   f"with the same bits in each arithmetic. Skipped for want of a compiler or an emulator: "
                   f"{len(targets) - len(run)}.",
                   show("portability"))


def rest():
    names = [name for name in TABLES if name not in shown]
    parts = [show(name) for name in names]
    return [section("rest", "Also measured", "Tables without a section of their own.", *parts)] if names else []


def main():
    sections = [headline(), conditions(), papers(), front(), culling(), others(), arithmetics(), instructions(), scaling(),
                compared(), hard_cases(), determinism()]
    sections += rest()
    quick = [name for name, table in TABLES.items() if table.quick]
    banner = ('<p class="banner" role="note"><strong>'
              f"{len(quick)} of {len(TABLES)} tables are of a QUICK run.</strong> Pictures are smaller, photons, views and "
              "frames fewer, and there is one run of each: they say whether everything works, not how fast it is. No target "
              "is judged by them.</p>") if quick else ""
    body = ["<header><h1>wisp, measured</h1><p class=\"lead\">A renderer for smoke and animated triangles whose every picture "
            "is reproducible to the last bit. This page is what it costs, how wrong it is, and where others are better."
            "</p></header>", banner,
            '<nav aria-label="Sections">', *(f'<a href="#{key}">{title}</a>' for key, title, _ in sections), "</nav><main>",
            *(html for _, _, html in sections), "</main>"]
    page = Path(__file__).with_name("page.html").read_text()
    PAGE.parent.mkdir(parents=True, exist_ok=True)
    PAGE.write_text(page.replace("@BODY@", "\n".join(body)))
    for name, made_by in missing.items():
        print(f"missing: {name} ({made_by})", file=sys.stderr)
    print(f"the page is {PAGE}, {PAGE.stat().st_size / 1e6:.1f} MB")


try:
    main()
except KeyError as error:
    sys.exit(f"a table has no column {error}, expected it: was it made by another version of tools/measure/bench?")
