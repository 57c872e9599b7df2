"""Plots as inline SVG: one drawn for wide pages and one for narrow ones, in colours that the page's style sheet gives."""
import io, itertools, math, re

import matplotlib
from matplotlib.figure import Figure
from matplotlib.ticker import EngFormatter, FuncFormatter, LogLocator, MaxNLocator, NullFormatter

# What is drawn in the colour on the left, the page shows as its own variable, for light and for dark. Series differ by marker
# or dash, too.
INK, DIM, EDGE = "#00000a", "#00000b", "#00000c"
COLOURS = [f"#0000a{i}" for i in range(7)]
VARIABLES = {INK: "--ink", DIM: "--dim", EDGE: "--edge", **{c: f"--c{i}" for i, c in enumerate(COLOURS)}}
MARKERS, SIGNS = "os^DPvX", "●■▲◆✚▼✖"
DASHES = ["", "6 3", "2 2", "8 2 2 2", "1 3", "10 4", "4 1"]
PERCENT = FuncFormatter(lambda value, _: f"{100 * value:g} %")

matplotlib.rcParams.update({
    "svg.fonttype": "none", "font.size": 12, "text.color": INK, "axes.labelcolor": DIM, "axes.edgecolor": EDGE,
    "axes.titlecolor": INK, "axes.titlesize": 13, "axes.titleweight": "bold", "axes.titlelocation": "left",
    "xtick.color": EDGE, "ytick.color": EDGE, "xtick.labelcolor": DIM, "ytick.labelcolor": DIM, "grid.color": EDGE,
    "grid.linewidth": 0.6, "axes.grid": True, "axes.axisbelow": True, "axes.spines.top": False, "axes.spines.right": False,
    "axes.linewidth": 0.8, "figure.facecolor": "none", "axes.facecolor": "none", "lines.linewidth": 2})


def svg(name, said, draw, heights):
    """A plot called NAME, which draw(figure, narrow) draws; heights in pixels. SAID is what it shows, for who cannot see."""
    parts = []
    for kind, width, height in zip(("wide", "narrow"), (960, 358), heights):
        matplotlib.rcParams["svg.hashsalt"] = name + kind  # no two plots of a page share an id
        figure = Figure(figsize=(width / 72, height / 72), dpi=72, constrained_layout=True)
        draw(figure, kind == "narrow")
        out = io.StringIO()
        figure.savefig(out, format="svg", metadata={"Date": None})
        text = re.sub(r"^.*?(?=<svg)|\s*<metadata>.*?</metadata>|<!--.*?-->", "", out.getvalue(), flags=re.S)
        text = re.sub(r'<g id="[^"]*"', "<g", text)
        text = re.sub(r"(font: (?:bold |700 )?)([\d.]+)px [^;\"]*", r"\g<1>\2px system-ui, sans-serif", text)
        text = re.sub(r'(<svg) [^>]*?(viewBox="[^"]*")[^>]*>', rf'\1 class="{kind}" role="img" aria-label="{said}" '
                      r'xmlns:xlink="http://www.w3.org/1999/xlink" \2>', text, count=1)
        for colour, variable in VARIABLES.items():
            text = text.replace(colour, f"var({variable})")
        parts.append(re.sub(r"\n\s*", "\n", text))
    return "".join(parts)


def legend(labels, dashes=False):
    """Entries {label: number of the series}."""
    line = ('<svg width="30" height="8"><line x1="0" y1="4" x2="30" y2="4" stroke-dasharray="{}" '
            'style="stroke: var(--c{}); stroke-width: 2.5"/></svg>')
    items = [(line.format(DASHES[i], i) if dashes else f'<span style="color: var(--c{i})">{SIGNS[i]}</span>') + f" {label}"
             for label, i in labels.items()]
    return '<ul class="legend">' + "".join(f"<li>{item}</li>" for item in items) + "</ul>"


def logarithmic(ax, which, values, formatter):
    """A log axis that has numbers at 1, and where it is short at 2 and 5, too."""
    finite = [v for v in values if v > 0 and math.isfinite(v)]
    short = not finite or max(finite) / min(finite) < 200
    getattr(ax, f"set_{which}scale")("log")
    axis = getattr(ax, f"{which}axis")
    axis.set_major_locator(LogLocator(subs=(1, 2, 5) if short else (1,), numticks=12))
    axis.set_major_formatter(formatter)
    axis.set_minor_formatter(NullFormatter())


def front(points, families, best, marked):
    """Points (family, seconds, error); BEST are those of the front, numbered as they come, MARKED is that of direct."""
    def draw(figure, narrow):
        ax = figure.subplots()
        ax.plot([p[1] for p in best], [p[2] for p in best], color=INK, linewidth=1, drawstyle="steps-post", zorder=1)
        for family, i in families.items():
            own = [p for p in points if p[0] == family]
            ax.plot([p[1] for p in own], [p[2] for p in own], MARKERS[i], color=COLOURS[i], markersize=6 if narrow else 8,
                    alpha=0.85)
        for i, (_, seconds, error, _) in enumerate(best):
            ax.annotate(str(i + 1), (seconds, error), (-5, -5), textcoords="offset points", ha="right", va="top", weight="bold")
        ax.annotate("direct", marked[1:], (0, 9), textcoords="offset points", ha="center", weight="bold")
        logarithmic(ax, "x", [p[1] for p in points], FuncFormatter(lambda v, _: f"{v:g}"))
        logarithmic(ax, "y", [p[2] for p in points], PERCENT)
        ax.margins(0.08)
        ax.set_xlabel("seconds"), ax.set_ylabel("relative RMSE")
    return svg("front", "Error against time, both logarithmic", draw, (520, 380))


def lines(name, said, x, panels, unit, percent=False):
    """PANELS: per title, {label: (number of the series, values at each x)}. Logarithmic, or in PERCENT from -25 to 100."""
    def draw(figure, narrow):
        shape = (len(panels), 1) if narrow else (1, len(panels))
        for ax, (title, series) in zip(figure.subplots(*shape, squeeze=False, sharey=percent).flat, panels.items()):
            for i, values in series.values():
                own = [(a, b) for a, b in zip(x, values) if percent or b >= 1e-4]
                dashes = {"linestyle": (0, [float(d) / 2 for d in DASHES[i].split()])} if DASHES[i] else {}
                ax.plot(*zip(*own), color=COLOURS[i], **dashes, **({} if percent else {"marker": MARKERS[i], "markersize": 6}))
            if percent:
                ax.axhline(0, color=DIM, linewidth=1)
                ax.set_ylim(-25, 103), ax.margins(x=0.01)
                ax.yaxis.set_major_formatter(FuncFormatter(lambda v, _: f"{v:g} %"))
                ax.xaxis.set_major_locator(MaxNLocator(integer=True))
            else:
                logarithmic(ax, "x", x, EngFormatter())
                logarithmic(ax, "y", [v for _, values in series.values() for v in values if v >= 1e-4],
                            EngFormatter("B" if title == "bytes" else "s"))
            ax.set_title(title), ax.set_xlabel(unit)
    return svg(name, said, draw, (350, 300 * len(panels)))


def bars(name, said, panels, columns=3, one=False, form="{:.3g}"):
    """Horizontal bars. PANELS: per title, per row the values of its series, each a bar; ONE draws a line at 1."""
    most = max(len(rows) * max(len(values) for values in rows.values()) for rows in panels.values())
    columns = min(columns, len(panels))
    high = -(-len(panels) // columns)

    def draw(figure, narrow):
        shape = (len(panels), 1) if narrow else (high, columns)
        for ax, panel in itertools.zip_longest(figure.subplots(*shape, squeeze=False, sharex=True).flat, panels.items()):
            if not panel:
                ax.set_visible(False)
                continue
            title, rows = panel
            for y, values in enumerate(rows.values()):
                height = 0.8 / len(values)
                for i, value in enumerate(values):
                    known, at = math.isfinite(value), y - 0.4 + height * (i + 0.5)
                    ax.barh(at, value if known else 0, height * 0.9, color=COLOURS[i])
                    ax.text(1.02, at, form.format(value) if known else "-", transform=ax.get_yaxis_transform(), va="center", size=11)
            ax.set_yticks(range(len(rows)), list(rows)), ax.set_ylim(len(rows) - 0.4, -0.6)
            ax.tick_params(axis="y", length=0, labelcolor=INK), ax.tick_params(axis="x", labelbottom=True)
            ax.grid(axis="y", visible=False)
            ax.set_title(title)
            if one:
                ax.axvline(1, color=INK, linewidth=1.5)
    tall = 62 + 22 * most + (24 if most < 4 else 0)
    return svg(name, said, draw, (tall * high, tall * len(panels)))
