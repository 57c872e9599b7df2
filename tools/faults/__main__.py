"""`make faults`: wisp with every request for memory and every system call made to fail in turn, and more that goes wrong.

    python3 tools/faults [--build FOLDER] [--most N] [-j N] [SECTION ...]

Prints a table of what was tried and what came of it, and each fault with what was done. Exit 1 where there is a fault.
`--most N`: of the requests for memory of a command N, evenly spread; 0: every one.
"""
import argparse, os, sys
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import calls, surroundings
from commands import Ran, Trial, make_commands


def memory(command, setting):
    """Each request for memory fails, alone or with all behind it."""
    counter = command.place / f"{command.name} requests.log"
    Ran(command.words, command.new_folder("requests"), {"LD_PRELOAD": setting.library, "FAULT_COUNT": str(counter)})
    requests = int(counter.read_text())
    step = -(-requests // setting.most) if setting.most else 1
    for number in range(1, requests + 1, step):
        for behind in ("", "+"):
            yield preloaded("requests for memory that fail", "FAULT_MEMORY", f"{number}{behind}", {command.status, 4}, setting)


def preloaded(kind, variable, value, allowed, setting):
    environment = {"LD_PRELOAD": setting.library, variable: value}
    return Trial(kind, f"{variable}={value}", allowed, lambda command, folder: Ran(command.words, folder, environment))


def short(command, setting):
    """A read or write moves so many bytes at most."""
    for most in ("1", "7", "4095"):
        yield preloaded("short reads and writes", "FAULT_MOVED", most, {command.status}, setting)


def clock(command, setting):
    for seconds in ("-1000000000", "-1", "1000000000"):
        yield preloaded("a clock that jumps", "FAULT_CLOCK", seconds, {command.status}, setting)


SECTIONS = {"memory": memory, "calls": calls.failing, "kills": calls.killed, "order": calls.ordered, "short": short, "clock": clock,
            **surroundings.SECTIONS}


def try_out(command, trial, number, counts):
    """The faults of one trial, and of an undisturbed run after it."""
    folder = command.new_folder(f"{number}")
    ran = trial.run(command, folder)
    wrong = command.wrong(ran, folder, trial) + ran.wrong
    if ran.status != command.status:
        wrong += command.wrong_again(folder)
    counts[trial.kind, "same" if ran.status == command.status else "killed" if (ran.status or 0) < 0 else "refused"] += 1
    if not wrong:
        command.remove(folder)
    return [f"{command.name}: {trial.what}: {text} (in {folder})" for text in wrong]


def main():
    parser = argparse.ArgumentParser(prog="python3 tools/faults", description=__doc__.split("\n\n")[0])
    parser.add_argument("sections", nargs="*", metavar="SECTION", help=", ".join(SECTIONS))
    parser.add_argument("--build", default="build")
    parser.add_argument("--most", type=int, default=100)
    parser.add_argument("--command", help="one of the commands alone")
    parser.add_argument("-j", type=int, dest="jobs", default=os.cpu_count())
    setting = parser.parse_args()
    build = Path(setting.build).resolve()
    setting.library = str(build / "faults.so")
    commands = make_commands(build / "wisp", build / "faults", setting.command)
    counts, faults = Counter(), []
    with ThreadPoolExecutor(setting.jobs) as pool:
        for name in setting.sections or SECTIONS:
            trials = [(command, trial) for command in commands for trial in SECTIONS[name](command, setting)]
            for found in pool.map(lambda item: try_out(*item[1], item[0], counts), enumerate(trials)):
                for fault in found:
                    print(fault, flush=True)
                faults += found
    print(f"{'what goes wrong':<34}{'tried':>8}{'no difference':>15}{'refused':>9}{'killed':>8}")
    for kind in dict.fromkeys(kind for kind, _ in counts):
        came = [counts[kind, what] for what in ("same", "refused", "killed")]
        print(f"{kind:<34}{sum(came):>8}{came[0]:>15}{came[1]:>9}{came[2]:>8}")
    for what in sorted(surroundings.missing):
        print(f"not tried: {what}")
    print(f"{len(faults)} faults")
    return bool(faults)


if __name__ == "__main__":
    sys.exit(main())
