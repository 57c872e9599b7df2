"""What `make bench` has left in build/bench, and what other tools have left in build."""
import json, math, sys
from collections import namedtuple
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))
from harness import OUT, read_csv


def value(cell):
    """A number, NaN for what is not known, or a text."""
    try:
        return math.nan if cell in ("-", "") else float(cell)
    except ValueError:
        return cell


class Table(namedtuple("Table", "header rows title notes machine", defaults=("", "", {}))):
    @property
    def records(self):
        """Rows by column; of columns that share a name the last."""
        return [dict(zip(self.header, map(value, row))) for row in self.rows]

    def row(self, **cells):
        """The first record that has these cells; StopIteration where there is none."""
        return next(record for record in self.records if cells.items() <= record.items())


def read():
    """Tables by name, in the order in which they were made; those of no known origin last."""
    index = OUT / "tables.json"
    about = json.loads(index.read_text()) if index.exists() else {}
    about["portability"] = {"title": "Goldens by compiler and processor"}
    names = [*about, *sorted({file.stem for file in OUT.glob("*.csv")} - about.keys())]
    return {name: Table(*read_csv(file), **about.get(name, {"title": name}))
            for name in names for file in (OUT / f"{name}.csv", OUT.parent / f"{name}.csv") if file.exists()}
