"""Figures: what a page says against what was printed or computed."""
import ast, json, math, operator, re

NUMBER = re.compile(r"(?<![\w.])[-−]?(?:\d{1,3}(?:,\d{3})+|\d+)(?:\.\d+)?(?:e[-+]?\d+)?(?![\w]|\.\d)")
FUNCTIONS = {"exp": math.exp, "log": math.log, "sqrt": math.sqrt, "sin": math.sin, "cos": math.cos,
             "erfc": math.erfc}
OPERATORS = {ast.Add: operator.add, ast.Sub: operator.sub, ast.Mult: operator.mul, ast.Div: operator.truediv,
             ast.Pow: operator.pow}


class Wrong(Exception):
    def __init__(self, *problems):
        self.problems = problems


def number(word):
    """The value of a number as it is written, and half a unit of its last digit."""
    word = word.replace(",", "").replace("−", "-")
    mantissa, _, exponent = word.partition("e")
    digits = len(mantissa.partition(".")[2])
    return float(word), 0.5 * 10.0 ** (int(exponent or 0) - digits) * (1 + 1e-9)


def is_whole(word):
    return re.fullmatch(r"[-−]?[\d,]+", word) is not None


def is_number(word):
    return NUMBER.fullmatch(word) is not None


def agrees(written, value):
    """Whether a value, rounded to the digits that are written, is what is written."""
    expected, half = number(written)
    return abs(value - expected) <= half


def computed(text):
    """The value of arithmetic, as 2 * exp(-0.5) / pi; None of what is no arithmetic."""
    def value(node):
        if isinstance(node, ast.Constant) and isinstance(node.value, (int, float)):
            return node.value
        if isinstance(node, ast.Name) and node.id == "pi":
            return math.pi
        if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
            return -value(node.operand)
        if isinstance(node, ast.BinOp) and type(node.op) in OPERATORS:
            return OPERATORS[type(node.op)](value(node.left), value(node.right))
        if isinstance(node, ast.Call) and getattr(node.func, "id", "") in FUNCTIONS and len(node.args) == 1:
            return FUNCTIONS[node.func.id](value(node.args[0]))
        raise ValueError
    try:
        return value(ast.parse(re.sub(r"(?<=\d),(?=\d{3})", "", text.replace("^", "**")).strip(), mode="eval").body)
    except (ValueError, SyntaxError, ArithmeticError):
        return None


def json_value(tree, path):
    """What a path as shadow.node_visits leads to: from the top, from the first frame, or from the first ray of a sample."""
    def follow(at):
        for step in path.split("."):
            at = at[int(step)] if isinstance(at, list) else at[step]
        return at
    starts = (lambda: tree, lambda: tree["frames"][0], lambda: tree["samples"][0], lambda: tree["samples"][0]["ray"])
    for start in starts:
        try:
            return follow(start())
        except (KeyError, IndexError, ValueError, TypeError):
            continue
    return None


def printed_words(output, first):
    """The lines of an output as words; of JSON the line that the path `first` leads to."""
    try:
        tree = json.loads(output)
    except ValueError:
        return [line.split() for line in output.splitlines()]
    value = json_value(tree, first)
    if value is None:
        return []
    values = value if isinstance(value, list) else [value]
    return [[first, *(word if isinstance(word, str) else json.dumps(word) for word in values)]]


def same(expected, found):
    """Whether a word is what a page says: a whole number exactly, others after rounding, what is no number by letters."""
    if is_number(expected):
        try:
            value = float(found.rstrip(",;:%").replace(",", ""))
        except ValueError:
            return False
        return value == number(expected)[0] if is_whole(expected) else agrees(expected, value)
    return expected == found


def find(expected, output):
    """The numbers as they were printed in the line that a page says was printed. Otherwise Wrong, with the nearest line."""
    words = expected.split()
    lines = printed_words(output, words[0])
    for line in lines:
        if len(line) >= len(words) and all(map(same, words, line)):
            return [number(word)[0] for word in NUMBER.findall(" ".join([expected, *line[:len(words)]]))]
    alike = [sum(1 for _ in takewhile_same(words, line)) for line in lines]
    if not any(alike):
        raise Wrong("no such line")
    raise Wrong(" ".join(lines[alike.index(max(alike))]))


def takewhile_same(words, line):
    for pair in zip(words, line):
        if not same(*pair):
            return
        yield pair
