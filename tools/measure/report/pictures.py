"""A pair of pictures with a slider between them, and their difference; a sheet of pictures."""
import base64, io, tempfile
from pathlib import Path

import matplotlib.image
import numpy

from targets import percent
from harness import compare, read_pfm


def png(values):
    """8-bit sRGB, as wisp writes it."""
    values = numpy.clip(numpy.nan_to_num(values), 0, 1)
    srgb = numpy.where(values <= 0.0031308, 12.92 * values, 1.055 * values ** (1 / 2.4) - 0.055)
    out = io.BytesIO()
    matplotlib.image.imsave(out, numpy.rint(255 * srgb).astype(numpy.uint8), format="png", origin="lower")
    return out.getvalue()


def image(png, alt, kind=""):
    return f'<img class="{kind}" src="data:image/png;base64,{base64.b64encode(png).decode()}" alt="{alt}">'


def sheet(file, text):
    return f'<figure class="sheet">{image(Path(file).read_bytes(), "Sheet of pictures")}<figcaption>{text}</figcaption></figure>'


def pair(a, said_a, b, said_b, text):
    # Rows from the bottom, of three channels.
    left, right = (numpy.repeat(numpy.array(values, float).reshape(height, width, channels), 3 // channels, axis=2)
                   for width, height, channels, values in map(read_pfm, (a, b)))
    height, width, _ = left.shape
    difference = abs(left - right)
    # The power of two that brings all but the largest 0.1 % below white.
    factor = 2 ** int(numpy.floor(-numpy.log2(max(numpy.quantile(difference, 0.999), 1e-9))))
    with tempfile.NamedTemporaryFile(suffix=".png") as file:
        mean_flip = compare(a, b, "mean FLIP", "--diff", file.name)
        flip = Path(file.name).read_bytes()
    return f"""<figure class="pair {'coarse' if width < 64 else ''}">
<div class="compare" style="aspect-ratio: {width} / {height}">
{image(png(left), said_a)}{image(png(right), said_b, "over")}
<span class="left">{said_a}</span><span class="right">{said_b}</span>
<input type="range" min="0" max="100" value="50" aria-label="Where {said_a} ends and {said_b} begins, in percent">
</div>
<div class="differences">
<div>{image(png(factor * difference), "Their difference")}<span>difference, {factor:g} times</span></div>
<div>{image(flip, "Their difference as it is perceived")}<span>perceived: FLIP, 0 to 1</span></div>
</div>
<figcaption>{text} <span class="figures">Relative RMSE {percent(compare(a, b))}; mean FLIP {mean_flip:.2g};
{width} x {height} pixels.</span></figcaption>
</figure>"""
