"""All lessons as one page of HTML, from the Markdown that they use: headings, paragraphs, lists, tables, code, links."""
import re, shutil, struct
from html import escape
from itertools import groupby

from lesson import COMMAND

STYLE = """
:root { color-scheme: light dark; --text: #1d2329; --dim: #5b6670; --paper: #fff; --code: #f3f5f7; --line: #d5dbe1; --link: #0b5cad }
@media (prefers-color-scheme: dark) {
  :root { --text: #dfe5ea; --dim: #98a4ae; --paper: #14181c; --code: #1e242a; --line: #353e47; --link: #74b3f2 } }
body { font: 17px/1.55 system-ui, sans-serif; color: var(--text); background: var(--paper); margin: 0 auto; max-width: 46rem;
       padding: 1rem 1.2rem 6rem }
h1, h2, h3 { line-height: 1.25; margin: 2em 0 .5em } h1 { font-size: 1.75rem } h2 { font-size: 1.2rem } h3 { font-size: 1.05rem }
section { border-top: 2px solid var(--line); margin-top: 4rem }
a { color: var(--link) }
code, pre { font: .84em/1.5 ui-monospace, monospace; background: var(--code); border-radius: 4px }
code { padding: .1em .3em } pre { padding: .7em .9em; overflow-x: auto } pre code { padding: 0; font-size: 1em }
pre b { font-weight: 600 } pre span { color: var(--dim) }
table { border-collapse: collapse; display: block; overflow-x: auto } th, td { border-bottom: 1px solid var(--line);
  padding: .3em .8em .3em 0; text-align: left }
figure { display: inline-block; margin: .3em 1em 1em 0; vertical-align: top } figcaption { color: var(--dim); font-size: .84em }
img { image-rendering: pixelated; max-width: 100%; height: auto; border: 1px solid var(--line) }
details { border: 1px solid var(--line); border-radius: 4px; margin: 1em 0; padding: .2em .9em } summary { cursor: pointer }
nav ol { padding-left: 1.6em }
"""


def inline(text, link):
    """Code, links, bold; what is in code stays as it is."""
    parts = re.split(r"(`[^`]+`)", text)
    for i, part in enumerate(parts):
        if i % 2:
            parts[i] = f"<code>{escape(part[1:-1])}</code>"
        else:
            part = escape(part, quote=False)
            part = re.sub(r"\*\*([^*]+)\*\*", r"<strong>\1</strong>", part)
            parts[i] = re.sub(r"\*([^*\s][^*]*)\*", r"<em>\1</em>", part)
    return re.sub(r"\[([^\]]+)\]\(([^)\s]+)\)", lambda m: f'<a href="{escape(link(m[2]))}">{m[1]}</a>', "".join(parts))


def size(png):
    return struct.unpack(">II", png.read_bytes()[16:24])


def figure(where, lesson, name):
    width, height = size(where / lesson / name)
    scale = max(1, round(360 / max(width, height)))
    return (f'<figure><img src="{lesson}/{name}" alt="{name}" width="{width * scale}" height="{height * scale}">'
            f"<figcaption>{name}, {width} x {height}</figcaption></figure>")


def terminal(lines):
    """A block of code; commands stand out from what they print, comments step back."""
    shown = []
    for line in lines:
        code, comment = re.match(r"(.*?)(\s+#.*)?$", line).groups()
        code = f"<b>{escape(code)}</b>" if COMMAND.match(line) else escape(code)
        shown.append(code + (f"<span>{escape(comment)}</span>" if comment else ""))
    return f"<pre><code>{chr(10).join(shown)}</code></pre>"


def table(rows, link):
    cells = [[cell.strip() for cell in row.strip().strip("|").split("|")] for row in rows]
    head = "".join(f"<th>{inline(cell, link)}</th>" for cell in cells[0])
    body = "".join("<tr>" + "".join(f"<td>{inline(cell, link)}</td>" for cell in row) + "</tr>" for row in cells[2:])
    return f"<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"


def html(text, link, level=0, after=lambda numbers: ""):
    """The HTML of a page. Headings are `level` lower; `after` gives what follows a block of code of these lines."""
    lines, out, at = text.splitlines(), [], 0

    def take(belongs):
        nonlocal at
        first = at
        while at < len(lines) and belongs(lines[at]):
            at += 1
        return lines[first:at]

    while at < len(lines):
        line = lines[at]
        heading = re.match(r"(#+) (.*)", line)
        item = re.match(r"(- |\d+\. )", line)
        if not line.strip():
            at += 1
        elif heading:
            rank = len(heading[1]) + level
            out.append(f"<h{rank}>{inline(heading[2], link)}</h{rank}>")
            at += 1
        elif line.startswith("    "):
            first = at
            block = take(lambda each: each.startswith("    ") or not each.strip())
            while not block[-1].strip():
                block.pop()
            out.append(terminal([each[4:] for each in block]) + after(range(first + 1, at + 1)))
        elif line.startswith("|"):
            out.append(table(take(lambda each: each.startswith("|")), link))
        elif item:
            kind = "ul" if item[1] == "- " else "ol"
            block = take(lambda each: re.match(r"- |\d+\. | {1,3}\S", each))
            items = re.split(r"^(?:- |\d+\. )", "\n".join(block), flags=re.M)[1:]
            out.append(f"<{kind}>" + "".join(f"<li>{inline(each, link)}</li>" for each in items) + f"</{kind}>")
        else:
            block = take(lambda each: each.strip() and not re.match(r"#|    |\||- |\d+\. ", each))
            out.append(f"<p>{inline(chr(10).join(block), link)}</p>")
    return "\n".join(out)


def section(where, lesson):
    """A lesson: its page with the pictures of its commands, its files, its solution. Its files are copied beside them."""
    def link(target):
        if re.match(r"https?:|#", target):
            return target
        target, _, anchor = target.partition("#")
        file = (lesson.folder / target).resolve()
        if lesson.folder in file.parents and file.suffix != ".md":
            return f"{lesson.name}/{file.name}"
        if file.parent.parent == lesson.folder.parent and file.name == "README.md":
            return f"#{file.parent.name}"
        if file.parent == lesson.folder / "solution":
            return f"#{lesson.name}-solution"
        return f"../../{file.relative_to(lesson.folder.parents[2])}"

    def pictures(page):
        def after(numbers):
            names = []
            for at in numbers:
                written = lesson.pictures.get((page.name, at), [])
                for _, group in groupby(written, lambda name: re.sub(r"\d+", "", name)):
                    frames = list(group)
                    names += [frames[0], frames[-1]] if len(frames) > 3 else frames  # of a sequence the first and the last
            return "".join(figure(where, lesson.name, name) for name in dict.fromkeys(names))
        return after

    files = [file for file in sorted(lesson.folder.iterdir()) if file.is_file() and file.name != "README.md"]
    shown = ""
    for file in files:
        shutil.copy(file, where / lesson.name / file.name)
        shown += f"<details><summary>{file.name}</summary><pre><code>{escape(file.read_text())}</code></pre></details>\n"
    page, solution = lesson.pages
    return (f'<section id="{lesson.name}">\n{html(page.text, link, 0, pictures(page))}\n<h2>Files</h2>\n{shown}'
            f'<details id="{lesson.name}-solution"><summary>Answers</summary>\n'
            f"{html(solution.text, link, 1, pictures(solution))}\n</details>\n</section>\n")


def write(where, lessons_folder, lessons):
    """build/lessons/index.html: the page of all lessons, and these lessons."""
    def link(target):
        lesson = target.endswith("/README.md") and ".." not in target
        return f"#{target.split('/')[0]}" if lesson else f"../../fixtures/lessons/{target}"
    intro = html((lessons_folder / "README.md").read_text(), link)
    body = "".join(section(where, lesson) for lesson in lessons)
    index = where / "index.html"
    index.write_text(f'<!doctype html>\n<html lang="en">\n<meta charset="utf-8">\n<meta name="viewport" '
                     f'content="width=device-width, initial-scale=1">\n<title>Lessons of wisp</title>\n<style>{STYLE}</style>\n'
                     f"<body>\n{intro}\n{body}</body>\n</html>\n")
    return index
