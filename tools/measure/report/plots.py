"""Plots as HTML: points and lines as SVG by matplotlib, bars by the page's style sheet, which gives all colours."""
import io, math, re
from html import escape

import matplotlib
from matplotlib.figure import Figure
from matplotlib.ticker import EngFormatter, FuncFormatter, LogLocator, MaxNLocator, NullFormatter

# What is drawn in #0000c0 the page shows in its own --c0, for light and for dark. Series differ by marker, too.
*COLOURS, INK, DIM, EDGE = (f"#0000c{i}" for i in range(10))
MARKERS, SIGNS = "os^DPvX", "●■▲◆✚▼✖"
FORMATS = {"seconds": EngFormatter("s"), "bytes": EngFormatter("B"),
           "relative RMSE": FuncFormatter(lambda error, _: f"{100 * error:g} %")}
WIDTH, HEIGHT = 480, 300
UNWANTED = r'^.*?<svg[^>]*>|<metadata>.*?</metadata>|<!--.*?-->|(?<=<g) id="[^"]*"'  # of matplotlib's SVG
matplotlib.rcParams.update({
    "svg.fonttype": "none", "font.family": "DejaVu Sans", "font.size": 12, "text.color": INK, "axes.labelcolor": DIM,
    "axes.titlesize": 13, "axes.titleweight": "bold", "axes.titlelocation": "left", "axes.edgecolor": EDGE,
    "xtick.color": DIM, "ytick.color": DIM, "axes.grid": True, "grid.color": EDGE, "axes.spines.top": False,
    "axes.spines.right": False, "figure.facecolor": "none", "axes.facecolor": "none", "lines.linewidth": 2})


def figure(legend, panels, caption=""):
    """HTML of panels, if there are any, under a legend {series: its number}."""
    names = "".join(f'<li><span style="color: var(--c{i})">{SIGNS[i]}</span> {name}</li>' for name, i in legend.items())
    return panels and (f'<figure class="plot"><ul class="legend">{names}</ul><div>{panels}</div>'
                       f"<figcaption>{caption}</figcaption></figure>")


def plot(name, unit, panels, linestyle="-", more=lambda axes: None, caption=""):
    """PANELS: {what is drawn against UNIT: {series: points}}, logarithmic, or of what is saved from -25 to 100 %. What
    `more` draws is added."""
    legend, drawn = {}, ""
    for title, series in panels.items():
        if not any(series.values()):
            continue
        matplotlib.rcParams["svg.hashsalt"] = name + title  # no two plots of a page share an id
        drawing, svg = Figure(figsize=(WIDTH / 72, HEIGHT / 72), dpi=72, constrained_layout=True), io.StringIO()
        axes = drawing.subplots()
        legend |= {label: i for i, (label, points) in enumerate(series.items()) if points}
        for points, colour, marker in zip(series.values(), COLOURS, MARKERS):
            axes.plot(*zip(*points), color=colour, linestyle=linestyle, marker=marker, markevery=1 + len(points) // 16)
        if title in FORMATS:
            axes.set(xscale="log", yscale="log")
            formatters = FORMATS.get(unit, EngFormatter()), FORMATS[title]
            for axis, data, formatter in zip((axes.xaxis, axes.yaxis), zip(*sum(series.values(), [])), formatters):
                axis.set_major_locator(LogLocator(subs=(1, 2, 5) if max(data) / min(data) < 200 else (1,), numticks=12))
                axis.set_major_formatter(formatter)
                axis.set_minor_formatter(NullFormatter())
        else:
            axes.axhline(0, color=DIM, linewidth=1)
            axes.set_ylim(-25, 103)
            axes.xaxis.set_major_locator(MaxNLocator(integer=True))
            axes.yaxis.set_major_formatter("{x:g} %")
        axes.set(title=title, xlabel=unit)
        more(axes)
        drawing.savefig(svg, format="svg", metadata={"Date": None})
        inner = re.sub(UNWANTED, "", svg.getvalue(), flags=re.S)
        drawn += (f'<svg role="img" aria-label="{title} by {unit}" xmlns:xlink="http://www.w3.org/1999/xlink" '
                  f'viewBox="0 0 {WIDTH} {HEIGHT}">' + re.sub("#0000(c.)", r"var(--\1)", inner))
    return figure(legend, drawn, caption)


def bars(rows, legend, panel, label, columns, cells="", pattern=""):
    """Bars of the rows whose CELLS match the pattern, one for each column. CELLS, PANEL and LABEL are made of a row. A
    line stands at 1, or at 0 % if the columns are percentages."""
    panels, line = {}, 0 if "%" in columns else 1
    for row in rows:
        values = [row[column] for column in columns.split(", ")]
        if re.fullmatch(pattern, cells.format(**row)) and all(map(math.isfinite, values)):
            panels.setdefault(panel.format(**row), {}).setdefault(label.format(**row), []).extend(values)
    longest = max([line, *(value for rows in panels.values() for values in rows.values() for value in values)])
    drawn = ""
    for title, rows in panels.items():
        drawn += f'<dl style="--line: {line / longest:.3f}"><h4>{escape(title)}</h4>'
        for name, values in rows.items():
            drawn += f"<dt>{escape(name)}</dt>" + "".join(
                f'<dd style="--length: {value / longest:.3f}; --colour: var(--c{i})">{value:.3g}</dd>'
                for i, value in enumerate(values))
        drawn += "</dl>"
    return figure({name: i for i, name in enumerate(legend.split(", "))}, drawn)
