"""What `make bench` has left in build/bench, and what other tools have left in build."""
import json, math, sys
from dataclasses import dataclass, field
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))
import harness
from harness import OUT


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
            if cells.items() <= record.items():
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
    return harness.compare(a, b, *figure) if Path(harness.WISP).exists() else math.nan


def read():
    """Tables by name, in the order in which they were made; those of no known origin last."""
    index = OUT / "tables.json"
    try:
        about = json.loads(index.read_text()) if index.exists() else {}
    except ValueError as error:
        sys.exit(f"{index}: {error}, expected the titles of tables: make bench writes it anew")
    about.setdefault("portability", {"title": "Goldens by compiler and processor"})
    names = [*about, *sorted({file.stem for file in OUT.glob("*.csv")} - about.keys())]
    return {name: Table(about.get(name, {}).get("title", name), *harness.read_csv(file), about.get(name, {}).get("notes", ""),
                        about.get(name, {}).get("machine", {}))
            for name in names for file in (OUT / f"{name}.csv", OUT.parent / f"{name}.csv") if file.exists()}
