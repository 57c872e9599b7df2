"""Pairs of pictures with a slider between them, and their difference."""
import base64, io, subprocess, tempfile
from html import escape
from pathlib import Path

import matplotlib.image
import numpy

from tables import compare
from harness import DATA, OUT, WISP, read_pfm
from targets import percent

# Left, right, and what to see.
PAIRS = [
    (OUT / "table2_direct.pfm", "direct", OUT / "table2_default.pfm", "default",
     "The workload of Table 2: the paper's plain way, and what wisp does when nobody says otherwise."),
    (OUT / "table2_map.pfm", "particle map", OUT / "table2_map_irr.pfm", "with irradiance map",
     "What the irradiance map changes: the same photons, read at every step of a ray, and interpolated from a lattice."),
    (OUT / "table4_400_0.pfm", "no photons", OUT / "table4_400_1000000.pfm", "with photons",
     "Single scattering alone, and with all the light that scatters more often: what photons are for."),
    (OUT / "table4_400_1000000.pfm", "110,401 particles", OUT / "table4_100_1000000.pfm", "27,601 particles",
     "The same air carries fewer and larger particles. The grain is the difference."),
    (OUT / "arith_f64.pfm", "f64", OUT / "arith_fixed.pfm", "fixed point",
     "The demo in two arithmetics: a few photons decide a collision the other way, and go elsewhere."),
    (DATA / "volumes/pbrt_g05.pfm", "pbrt-v4", OUT / "grid_8000000.pfm", "wisp",
     "A density grid by a path tracer and by wisp. pbrt's picture has noise of its own: 7.5 % of its mean."),
    (Path("build/truth/table2.pfm"), "reference", OUT / "table2_small_table2_default.pfm", "default",
     "Every error of smoke is measured like this: 32 x 32 pixels beside the mean of all passes of --reference."),
]


def linear(path):
    """Rows from the top."""
    width, height, channels, values = read_pfm(path)
    rows = numpy.array(values, float).reshape(height, width, channels)[::-1]
    return numpy.repeat(rows, 3 // channels, axis=2)


def embedded(png):
    return "data:image/png;base64," + base64.b64encode(png).decode()


def shown(values):
    """8-bit sRGB, as wisp writes it, inside the page."""
    values = numpy.clip(numpy.nan_to_num(values), 0, 1)
    srgb = numpy.where(values <= 0.0031308, 12.92 * values, 1.055 * values ** (1 / 2.4) - 0.055)
    out = io.BytesIO()
    matplotlib.image.imsave(out, numpy.rint(255 * srgb).astype(numpy.uint8), format="png")
    return embedded(out.getvalue())


def flip(a, b):
    """The perceived difference as `wisp compare` draws it."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "flip.png"
        subprocess.run([WISP, "compare", a, b, "--diff", file], stdout=subprocess.DEVNULL)
        return embedded(file.read_bytes())


def pair(a, said_a, b, said_b, text):
    left, right = linear(a), linear(b)
    difference = abs(left - right)
    # The power of two that brings all but the largest 0.1 % below white.
    factor = 2 ** int(numpy.floor(-numpy.log2(max(numpy.quantile(difference, 0.999), 1e-9))))
    height, width, _ = left.shape

    def image(source, alt, more=""):
        return f'<img{more} src="{source}" width="{width}" height="{height}" alt="{escape(alt)}">'
    return f"""<figure class="pair{' coarse' if width < 64 else ''}">
<div class="compare" style="aspect-ratio: {width} / {height}">
{image(shown(left), said_a)}{image(shown(right), said_b, ' class="over"')}
<span class="left">{escape(said_a)}</span><span class="right">{escape(said_b)}</span>
<input type="range" min="0" max="100" value="50" aria-label="Where {escape(said_a)} ends and {escape(said_b)} begins, in percent">
</div>
<div class="differences">
<div>{image(shown(factor * difference), "Their difference")}<span>difference, {factor:g} times</span></div>
<div>{image(flip(a, b), "Their difference as it is perceived")}<span>perceived: FLIP, 0 to 1</span></div>
</div>
<figcaption>{escape(text)} <span class="figures">Relative RMSE {percent(compare(a, b))}; mean FLIP
{compare(a, b, 'mean FLIP'):.2g}; {width} x {height} pixels.</span></figcaption>
</figure>"""


def pairs():
    """The pairs that there are, and the files that are missing."""
    missing = [str(file).replace(str(DATA), "DATA") for a, _, b, _, _ in PAIRS for file in (a, b) if not file.exists()]
    return "".join(pair(*these) for these in PAIRS if these[0].exists() and these[2].exists()), sorted(set(missing))
