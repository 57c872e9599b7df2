"""What `make bench` has left in build/bench or, where that is older or missing, in a release; what other tools have left in build."""
import math, sys
from collections import namedtuple
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))
from harness import MEASURED, OUT, read_csv, read_index


def value(cell):
    """A number, NaN for what is not known, or a text."""
    try:
        return math.nan if cell in ("-", "") else float(cell)
    except ValueError:
        return cell


class Table(namedtuple("Table", "header rows title notes machine released", defaults=("", "", {}, False))):
    @property
    def records(self):
        """Rows by column; of columns that share a name the last."""
        return [dict(zip(self.header, map(value, row))) for row in self.rows]

    def row(self, **cells):
        """The first record that has these cells; StopIteration where there is none."""
        return next(record for record in self.records if cells.items() <= record.items())


def read(here=OUT, release=MEASURED):
    """Tables by name, in the order in which they were made; those of no known origin last. A table of the release stands until
    something newer was measured here."""
    about = {**read_index(here), "portability": {"title": "Goldens by compiler and processor"}}
    names = [*about, *sorted({file.stem for file in here.glob("*.csv")} - about.keys())]
    tables = {name: Table(*read_csv(file), **about.get(name, {"title": name}))
              for name in names for file in (here / f"{name}.csv", here.parent / f"{name}.csv") if file.exists()}
    for name, said in read_index(release).items():
        if name not in tables or tables[name].machine.get("when", said["machine"]["when"]) < said["machine"]["when"]:
            tables[name] = Table(*read_csv(release / f"{name}.csv"), **said, released=True)
    return tables
