"""What `make bench` has left in build/bench, and what other tools have left in build."""
import csv, json, math, sys
from dataclasses import dataclass, field
from pathlib import Path

sys.path.insert(0, "tools/measure/bench")
import harness
from harness import DATA, OUT, WISP


class NotMeasured(Exception):
    """What a table does not have."""



@dataclass
class Table:
    title: str
    header: list
    rows: list
    notes: str = ""
    machine: dict = field(default_factory=dict)

    @property
    def records(self):
        """Rows by column; of columns that share a name the last."""
        return [dict(zip(self.header, row)) for row in self.rows]

    def row(self, **cells):
        """The first record that has these cells."""
        for record in self.records:
            if all(record.get(key) == value for key, value in cells.items()):
                return record
        raise NotMeasured(cells)

    @property
    def quick(self):
        return bool(self.machine.get("quick"))


def number(cell):
    """NaN for what is not known, as `-`."""
    try:
        return float(cell)
    except (TypeError, ValueError):
        return math.nan


def compare(a, b, *figure):
    """A figure of `wisp compare`; NaN where wisp or a picture is missing."""
    return harness.compare(a, b, *figure) if Path(WISP).exists() else math.nan


def read_csv(path, title, about={}):
    with open(path, newline="") as file:
        header, *rows = [row for row in csv.reader(file) if row] or [[]]
    for row in rows:
        if len(row) != len(header):
            sys.exit(f"{path}: {len(row)} cells in a row that starts with '{row[0]}', expected {len(header)}")
    return Table(title, header, rows, about.get("notes", ""), about.get("machine", {}))


def read():
    """Tables by name, in the order in which they were made; those of no known origin last."""
    index = OUT / "tables.json"
    try:
        about = json.loads(index.read_text()) if index.exists() else {}
    except ValueError as error:
        sys.exit(f"{index}: {error}, expected the titles of tables: make bench writes it anew")
    names = [*about, *sorted({file.stem for file in OUT.glob("*.csv")} - about.keys())]
    tables = {name: read_csv(OUT / f"{name}.csv", about.get(name, {}).get("title", name), about.get(name, {}))
              for name in names if (OUT / f"{name}.csv").exists()}
    for name, title in (("hard_cases", "Cases and outcomes"), ("portability", "Goldens by compiler and processor")):
        if Path(f"build/{name}.csv").exists():
            tables[name] = read_csv(f"build/{name}.csv", title)
    return tables
