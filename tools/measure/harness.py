"""What all that is measured shares: jobs, figures, pictures, tables.

A job is a command that is run several times, in turn with others, and whose results are kept from one start to the next.

A job's result of one run is kept in build/bench/runs with what it came from: its words, its program and the files that it
reads. While those are the same it is not run again, so what was stopped goes on where it was.
"""
import csv, functools, hashlib, io, json, math, os, platform, re, shlex, signal, statistics, subprocess, sys, tempfile
import threading, time
from array import array
from datetime import datetime, timezone
from pathlib import Path

QUICK = bool(os.environ.get("QUICK"))
RUNS = int(os.environ.get("RUNS") or (1 if QUICK else 3))
DATA = Path(os.environ.get("DATA") or "../shared/data").resolve()
OUT = Path("build/bench")
MEASURED = Path("fixtures/measured")  # the tables of a release
WISP = "build/wisp"

waiting = []  # jobs that the section which is asked for has named and that are to be run
failed = []  # what did not work, for the end


def quick(less, full):
    return less if QUICK else full


@functools.cache
def contents(path):
    return hashlib.sha256(Path(path).read_bytes()).hexdigest() if Path(path).is_file() else "-"


def run_process(command, limit=None):
    """What a process gave: status (None: it was stopped after `limit` seconds), seconds by the clock, seconds of the processor,
    the most bytes of memory that it had, and what it printed to standard output and error."""
    with tempfile.TemporaryFile("w+") as out, tempfile.TemporaryFile("w+") as error:
        start = time.perf_counter()
        process = subprocess.Popen([str(word) for word in command], stdout=out, stderr=error)
        stopped = threading.Event()
        timer = threading.Timer(limit or 0, lambda: (stopped.set(), os.kill(process.pid, signal.SIGKILL)))
        if limit:
            timer.start()
        _, status, usage = os.wait4(process.pid, 0)
        seconds = time.perf_counter() - start
        timer.cancel()
        process.returncode = os.waitstatus_to_exitcode(status)
        said, complaint = [file.seek(0) or file.read() for file in (out, error)]
    return (None if stopped.is_set() else process.returncode, seconds, usage.ru_utime, usage.ru_maxrss * 1024, said, complaint)


class Job:
    """A command, and what its runs gave: seconds as wisp or the clock says, counters, and what it printed."""

    def __init__(self, name, command, reads=(), makes=(), runs=None, after=(), lasting=False):
        self.name, self.command = name, [str(word) for word in command]
        self.reads, self.makes, self.runs, self.after = reads, makes, runs or RUNS, after
        self.lasting = lasting  # its program may change, as far as the file that it makes is concerned
        self.results = []
        waiting.append(self)

    def key(self):
        files = [*([] if self.lasting else [self.command[0]]), *self.reads]
        came_from = [self.command, [contents(file) for file in files], [job.key() for job in self.after]]
        return hashlib.sha256(json.dumps(came_from).encode()).hexdigest()

    def kept(self, run):
        """The result of this run, if it is there and came from the same."""
        result = earlier(self.name, run)
        same = result and result["key"] == self.key() and all(Path(file).exists() for file in self.makes)
        return result if same else None

    def run(self, run):
        stats = OUT / "stats.json"
        stats.unlink(missing_ok=True)
        status, seconds, processor, resident, said, complaint = run_process(self.command)
        result = {"key": self.key(), "clock": seconds, "processor": processor, "status": status, "out": said, "resident": resident,
                  "when": datetime.now(timezone.utc).isoformat(timespec="seconds")}
        if stats.exists():
            result["stats"] = json.loads(stats.read_text())
        if status != 0:
            result["error"] = (complaint.strip().splitlines() or [f"status {status}"])[-1]
        aside = OUT / "runs" / f"{self.name}.{run}.part"
        aside.write_text(json.dumps(result))
        aside.rename(aside.with_suffix(".json"))
        return result

    # ---- what a table asks
    def good(self):
        return bool(self.results) and all(result["status"] == 0 for result in self.results)

    def clock(self):
        """Seconds by the clock, one of each run."""
        return [result["clock"] for result in self.results] if self.good() else []

    def seconds(self, *stages):
        """Seconds of stages of all frames as `--stats` has them, one sum of each run; without stages all of them that depend
        on the options, which reading the scene does not."""
        stages = stages or ("trees", "photons", "irradiance", "render")
        return [sum(frame["seconds"][stage] for frame in result["stats"]["frames"] for stage in stages)
                for result in self.results] if self.good() else []

    def number(self, group, name):
        """A counter or bytes of the last frame; the same in every run."""
        return self.results[0]["stats"]["frames"][-1][group][name] if self.good() else math.nan

    def processor(self):
        """Seconds of the processor, one of each run."""
        return [result["processor"] for result in self.results] if self.good() else []

    def resident(self):
        """The most bytes of memory that the process had."""
        return median([result["resident"] for result in self.results]) if self.good() else math.nan

    def frames(self):
        return self.results[0]["stats"]["frames"] if self.good() else []

    def lines(self):
        return self.results[0]["out"].splitlines() if self.good() else []

    def digests(self):
        return [line.split()[0] for line in self.lines() if re.match("[0-9a-f]{64} ", line)]

    def csv(self):
        """Rows of the CSV that the program prints, each number the median of the runs."""
        runs = [list(csv.reader(io.StringIO(result["out"]))) for result in self.results] if self.good() else []
        return [[middle(cells) for cells in zip(*rows)] for rows in zip(*runs)]


def middle(cells):
    try:
        return plain(statistics.median(float(cell) for cell in cells))
    except ValueError:
        return cells[0]


def earlier(name, run):
    try:
        return json.loads((OUT / "runs" / f"{name}.{run}.json").read_text())
    except (OSError, ValueError):
        return None


def render(name, scene, *options, runs=None, makes=("pfm",), after=(), reads=()):
    """A job of `wisp render`; its pictures are NAME.pfm and others that `makes` says. Options: words, or strings of them."""
    words = [word for option in options for word in shlex.split(str(option))]
    pictures = [OUT / f"{name}.{kind}" for kind in makes]
    command = [WISP, "render", scene, *words, "--stats", OUT / "stats.json", *([] if "-v" in words else ["-q"])]
    for picture in pictures:
        command += ["-o", picture]
    return Job(name, command, (scene, *reads), pictures, runs, after)


def picture(job):
    return OUT / f"{job.name}.pfm"


# ---------------------------------------------------------------------------------------------------------------- figures
def compare(a, b, figure="relative RMSE", *options):
    """One figure of `wisp compare`; NaN where a picture is missing."""
    if not (Path(a).exists() and Path(b).exists()):
        return math.nan
    text = subprocess.run([WISP, "compare", a, b, *options], capture_output=True, text=True).stdout
    found = re.search(rf"^ *{figure} +(\S+)", text, re.M)
    return float(found[1]) if found else math.nan


def read_pfm(path):
    """Width, height, channels and the linear values, the bottom row first."""
    kind, size, scale, data = Path(path).read_bytes().split(b"\n", 3)
    values = array("f", data)
    if (float(scale) < 0) != (sys.byteorder == "little"):
        values.byteswap()
    return *map(int, size.split()), 3 if kind == b"PF" else 1, values


def channel(path, c):
    """A grey picture of one channel of a colour PFM, beside it."""
    width, height, channels, values = read_pfm(path)
    grey = Path(path).with_suffix(f".{c}.pfm")
    one = values[c::channels]
    if sys.byteorder == "big":
        one.byteswap()
    grey.write_bytes(b"Pf\n%d %d\n-1.0\n" % (width, height) + one.tobytes())
    return grey


def median(values):
    return statistics.median(values) if values else math.nan


def spread(values):
    """Largest less smallest over the median, in percent."""
    return 100 * (max(values) - min(values)) / median(values) if len(values) > 1 and median(values) > 0 else math.nan


def ratio(a, b):
    """The median of the ratios of runs that were made in turn."""
    return median([x / y for x, y in zip(a, b) if y > 0])


def plain(value, digits=4):
    """A cell: numbers of so many digits, without an exponent where that is short; `-` for what is not known."""
    if isinstance(value, str):
        return value
    if value is None or not math.isfinite(value):
        return "-"
    if isinstance(value, int) or value == int(value) and abs(value) < 1e12:
        return str(int(value))
    return f"{value:.{digits}g}" if abs(value) < 1e-4 or abs(value) >= 1e6 else f"{float(f'{value:.{digits}g}'):g}"


# ---------------------------------------------------------------------------------------------------------------- tables
def machine():
    """What the figures of this run were measured on."""
    def first(path, pattern):
        found = re.search(pattern, Path(path).read_text(), re.M) if Path(path).exists() else None
        return found[1].strip() if found else "unknown"
    def git(*words):
        found = subprocess.run(["git", *words], capture_output=True, text=True)
        return found.stdout.strip() if found.returncode == 0 else "unknown"
    changed = " with changes" if git("status", "--porcelain", "--untracked-files=no") not in ("", "unknown") else ""
    version = subprocess.run([WISP, "version"], capture_output=True, text=True).stdout.split("\n")
    return {"processor": first("/proc/cpuinfo", r"^model name\s*:(.*)") + ", one core of " + str(os.cpu_count()),
            "memory": first("/proc/meminfo", r"^MemTotal:(.*)"), "system": platform.platform(),
            "wisp": "; ".join(line.strip() for line in version if line.strip()),
            "commit": git("rev-parse", "--short=12", "HEAD") + changed,
            "load": " ".join(f"{load:.2f}" for load in os.getloadavg()),
            "when": datetime.now(timezone.utc).isoformat(timespec="minutes"), "runs": RUNS, "quick": QUICK}


def table(name, title, header, rows, notes="", printed=True, folder=OUT):
    """Prints a table and leaves NAME.csv, and in tables.json its title, notes, and what it was measured on."""
    cells = [[plain(cell) for cell in row] for row in rows]
    with open(folder / f"{name}.csv", "w", newline="") as file:
        csv.writer(file, lineterminator="\n").writerows([header, *cells])
    write_index(OUT, {**read_index(OUT), name: {"title": title, "notes": notes, "machine": machine()}})
    if not printed:
        return
    widths = [max(len(row[i]) for row in [header, *cells] if i < len(row)) for i in range(len(header))]
    print(f"\n{title}")
    for row in [header, *cells]:
        print("  ".join(cell.ljust(width) for cell, width in zip(row, widths)).rstrip())
    if notes:
        print(notes)
    sys.stdout.flush()


def read_index(folder):
    """Titles, notes and machines of the tables in a folder, by name, in the order in which they were made."""
    index = folder / "tables.json"
    return json.loads(index.read_text()) if index.exists() else {}


def write_index(folder, known):
    (folder / "tables.json").write_text(json.dumps(known, indent=1) + "\n")


def read_csv(path):
    """Header and rows."""
    with open(path, newline="") as file:
        header, *rows = [row for row in csv.reader(file) if row] or [[]]
    for row in rows:
        if len(row) != len(header):
            sys.exit(f"{path}: {len(row)} cells in a row that starts with '{row[0]}', expected {len(header)}")
    return header, rows


def skipped(what, why):
    print(f"\n{what}: skipped, {why}")


# ---------------------------------------------------------------------------------------------------------------- running
def run_sections(sections):
    """Each section is a generator: what it names before its `yield` is run, then the rest of it makes tables."""
    (OUT / "runs").mkdir(parents=True, exist_ok=True)
    started = []
    for name, section in sections:
        section = section()
        next(section, None)
        started.append((name, section, list(waiting)))
        waiting.clear()
    todo = [(job, run) for _, _, jobs in started for job in jobs for run in range(job.runs)]
    left = {(job.name, run) for job, run in todo if not job.kept(run)}
    print(f"{len(left)} of {len(todo)} runs to make", file=sys.stderr)
    for name, section, jobs in started:
        for run in range(max((job.runs for job in jobs), default=0)):
            for job in jobs:
                if run >= job.runs:
                    continue
                result = job.kept(run)
                if not result:
                    print(f"{len(left)} left{remaining(todo, left)}: {name}, {job.name}, run {run + 1} of {job.runs}",
                          file=sys.stderr, flush=True)
                    result = job.run(run)
                    if result["status"] != 0:
                        failed.append(f"{job.name}: {result['error']}")
                left.discard((job.name, run))
                job.results.append(result)
        next(section, None)


def remaining(todo, left):
    """What the jobs that are left may take, by what they took before; those that never ran as the others on average."""
    known = {}
    for job, run in todo:
        for result in filter(None, (earlier(job.name, run) for run in range(job.runs))):
            known[job.name] = result["clock"]
            break
    mean = sum(known.values()) / len(known) if known else 0
    minutes = sum(known.get(job.name, mean) for job, run in todo if (job.name, run) in left) / 60
    return f", about {minutes:.0f} min" if known else ""
