"""One lesson: its page and its solution, what they run, and whether their figures are so.

In both pages, an indented block with a command is what one sees in a terminal:

    build/wisp compare a.pfm b.pfm --tolerance 0.1     # (exit 1), if that is its status
    relative RMSE 0.123                                  a line that begins so was printed, after rounding
    shadow.node_visits 206011                            of JSON: a path and its value
    206,011 / 4,800 = 42.9                               arithmetic, computed again

All other numbers of the text with a point, a percent sign or three digits must be among these, in a command, or in a scene or a
program of the lesson. In the solution `answer 1 = 42.9` answers question 1. What stands under the heading Sources is not
checked."""
import re, subprocess

from checks import NUMBER, Wrong, agrees, computed, find, is_number, is_whole, number

COMMAND = re.compile(r"(build/|tools/|python3 |diff |cat |sh |sed |sort )")
ARITHMETIC = re.compile(r"(.+?)\s=\s(\S+)( %)?$")
ANSWER = re.compile(r"answer (\d+) = (\S+)( %)?$")


def without_comment(line):
    return re.sub(r"\s+#.*|\s+$", "", line)


def blocks(lines):
    """Indented blocks and the prose between them, as ("code" or "text", [(number, line)])."""
    found = []
    for at, line in enumerate(lines, 1):
        kind = "code" if line.startswith("    ") else "text"
        if not line.strip() and found:
            kind = found[-1][0]
        if not found or found[-1][0] != kind:
            found.append((kind, []))
        found[-1][1].append((at, line))
    return found


class Page:
    def __init__(self, file, top):
        self.file, self.name = file, file.relative_to(top)
        self.text = file.read_text()
        self.blocks = blocks(self.text.splitlines())

    def title(self):
        return re.match("# (.*)", self.text)[1]

    def wrong(self, at, expected, found):
        return f"{self.name}:{at}: expected {expected}, found {found}"


class Lesson:
    def __init__(self, folder, top):
        self.folder, self.name = folder, folder.name
        self.pages = [Page(folder / "README.md", top), Page(folder / "solution/README.md", top)]
        self.commands = self.figures = 0
        self.known = []  # numbers that a text may name: checked ones, and those of commands, scenes and programs
        self.checked = []  # numbers that were printed or computed
        self.answers = {}  # by number of the question: the word, and the line where it stands
        self.pictures = {}  # by page and line of a command: pictures that it wrote
        for at, line in enumerate(self.pages[1].text.splitlines(), 1):
            answer = ANSWER.match(line.strip())
            if answer:
                self.answers[answer[1]] = answer[2], bool(answer[3]), at
        for file in sorted(folder.rglob("*")):
            if file.suffix in (".aff", ".py", ".sh"):
                self.learn(file.read_text())

    def learn(self, text):
        self.known += [number(word)[0] for word in NUMBER.findall(re.sub(r"(?<=\d)x(?=\d)", " ", text))]

    def learn_checked(self, values):
        self.known += values
        self.checked += values

    def run(self, where):
        for page in self.pages:
            for kind, lines in page.blocks:
                if kind == "code":
                    self.run_block(page, lines, where)

    def run_block(self, page, lines, where):
        output, command = "", None
        for at, line in lines:
            text = without_comment(line.strip())
            if not text or ANSWER.match(text):
                continue
            if COMMAND.match(text):
                output, command = self.run_command(page, at, line, text, where), text
            elif not self.is_arithmetic(page, at, text) and command:
                try:
                    self.learn_checked(find(text, output))
                except Wrong as nearest:
                    raise Wrong(page.wrong(at, f"`{text}` of `{command}`", f"`{nearest.problems[0]}`")) from None
                self.figures += 1

    def run_command(self, page, at, line, text, where):
        before = {file: file.stat().st_mtime_ns for file in where.glob("*.png")}
        status = int((re.search(r"#.*\(exit (\d+)\)", line) or [0, 0])[1])
        # A status that the page names is the one that a reader's shell has: of a pipe, that of its last program.
        shell = ["bash", "-c"] if status else ["bash", "-o", "pipefail", "-c"]
        ran = subprocess.run([*shell, text], cwd=where, capture_output=True, text=True, timeout=300)
        if ran.returncode != status:
            raise Wrong(page.wrong(at, f"status {status} of `{text}`", f"{ran.returncode}: {ran.stderr.strip()[-300:]}"))
        self.commands += 1
        self.learn(text)
        for scene in re.findall(r"\S+\.aff", text):
            self.learn((where / scene).read_text() if (where / scene).exists() else "")
        self.pictures[page.name, at] = sorted(file.name for file in where.glob("*.png")
                                              if before.get(file) != file.stat().st_mtime_ns)
        return ran.stdout or ran.stderr

    def is_arithmetic(self, page, at, text):
        """Checks a line that is arithmetic. Its own numbers must be known, as those of the text."""
        found = ARITHMETIC.match(text)
        value = computed(found[1]) if found and is_number(found[2]) else None
        if value is None:
            return False
        shown = 100 * value if found[3] else value
        if not agrees(found[2], shown):
            raise Wrong(page.wrong(at, text, f"{shown:.6g}"))
        self.figures += 1
        self.learn_checked([value])
        return True

    @staticmethod
    def is_among(values, word, percent):
        return any(agrees(word, 100 * value if percent else value) or agrees(word, -value) for value in values)

    def check_prose(self):
        problems = []
        for page in self.pages:
            for kind, lines in page.blocks:
                for at, line in lines:
                    if line.startswith("## Sources"):
                        break
                    text = re.sub(r"\]\([^)]*\)|^\s*\d+\. |^#.*|\d+[ -]bits?\b|[A-Z]+-\d+", "", line)
                    # No links, numbers of lists, headings, widths, names.
                    for found in NUMBER.finditer(text):
                        percent = text[found.end():found.end() + 2] == " %"
                        if not percent and len(re.sub(r"\D", "", found[0])) < 3 and "." not in found[0]:
                            continue
                        self.figures += kind == "text"
                        if not any(self.is_among(self.known, found[0], unit) for unit in {percent, False}):
                            problems.append(page.wrong(at, "a figure that is printed, computed or in the scene", found[0]))
                else:
                    continue
                break
        if problems:
            raise Wrong(*problems)

    def check_answers(self):
        """Each question has an answer, and each answer was printed or computed."""
        page, solution = self.pages
        questions = re.findall(r"^(\d+)\. ", (re.split(r"^## Questions\n", page.text, flags=re.M) + [""])[1], flags=re.M)
        if sorted(questions) != sorted(self.answers):
            raise Wrong(f"{page.name}: questions {' '.join(questions)}, but answers {' '.join(self.answers)}")
        unknown = [solution.wrong(at, "an answer that is printed or computed", word)
                   for word, percent, at in self.answers.values() if not self.is_among(self.checked, word, percent)]
        if unknown:
            raise Wrong(*unknown)

    def is_right(self, question, answer):
        """Whole numbers must be the same, others within 1 %. 5.4, 5.4% and 0.054 are one answer in per cent."""
        if question not in self.answers:
            raise Wrong(f"{self.name}: found question {question}, expected {' '.join(sorted(self.answers))}")
        try:
            found, _ = number(answer.rstrip("% "))
        except ValueError:
            raise Wrong(f"{self.name}: found '{answer}', expected a number") from None
        word, percent, _ = self.answers[question]
        expected, slack = number(word)[0], 0 if is_whole(word) else 0.01
        return any(abs(value - expected) <= slack * abs(expected) for value in ([found, 100 * found] if percent else [found]))
