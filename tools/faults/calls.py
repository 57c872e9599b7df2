"""System calls, by strace: each fails in turn, the process is killed before each, and what reaches the disk when."""
import re

from commands import Ran, Trial

CALL = re.compile(r"^(?:\d+ +)?(\w+)\((.*)\) += (-?\d+|\?|0x[0-9a-f]+)")
# The errors of each call, once; those with + of all such calls from then on.
ERRORS = {"openat": ["EIO", "EMFILE+", "EINTR"], "read": ["EIO", "EINTR"], "write": ["ENOSPC", "EINTR"], "fsync": ["EIO", "EINTR"],
          "ftruncate": ["EIO", "EINTR"], "rename": ["EIO", "ENOSPC+"], "flock": ["ENOLCK", "EINTR"], "close": ["EIO", "EINTR"],
          "mmap": ["ENOMEM", "ENOMEM+"], "newfstatat": ["EIO", "EIO+"]}
OTHERS = ["EPERM"]
# Of the process's own life; and brk, which has no errors: it gives less than it was asked for.
UNTOUCHED = {"exit_group", "rt_sigreturn", "restart_syscall", "futex", "brk"}
CHANGING = {"openat", "write", "fsync", "ftruncate", "rename", "unlink", "close", "flock"}


class Call:
    def __init__(self, name, number, words):
        self.name, self.number, self.words = name, number, words  # number: of those of this name, from 1 on
        self.reads = "/inputs" in words
        self.writes = ".part" in words
        self.prints = self.name in ("write", "close", "fstat", "newfstatat") and re.match(r"[12]<", words) is not None

    def allowed(self, error, status):
        """The exit statuses that may come of it. Where the status is the undisturbed one, outputs are compared."""
        if error.endswith("+"):
            return {status, 3, 4, 5}
        if error == "EINTR":
            return {status, 5} if self.prints else {status}
        if self.name in ("mmap", "mremap"):
            return {status, 4}
        if self.writes and self.name in ("write", "fsync", "ftruncate", "rename"):
            return {5}
        if self.name in ("newfstatat", "readlink", "getcwd", "access", "faccessat2"):  # of a name that is read or written
            return {status, 3, 5}
        return {status, 3 if self.reads else 5} if self.reads or self.writes or self.prints else {status}


def traced(words, log, options=()):
    return ["strace", "-qq", "-f", "-y", "-s", "0", "-o", str(log), *options, *words]


def calls_of(command):
    """The system calls of an undisturbed run, without those that load the program."""
    log = command.place / f"{command.name} calls.log".replace(" ", "_")
    Ran(traced(command.words, log), command.new_folder("calls"))
    counts, calls, loaded = {}, [], False
    for line in log.read_text().splitlines():
        match = CALL.match(line)
        if not match:
            continue
        name, words = match.group(1), match.group(2)
        counts[name] = counts.get(name, 0) + 1
        if loaded and name not in UNTOUCHED:
            calls.append(Call(name, counts[name], words))
        loaded = loaded or name == "munmap"  # of the loader's cache: the last thing that it does
    return calls


def injection(call, what, behind=""):
    return ["-e", f"trace={call.name}", "-e", f"inject={call.name}:{what}:when={call.number}{behind}"]


def trial(kind, call, options, allowed, parts):
    def run(command, folder):
        return Ran(traced(command.words, "/dev/null", options), folder)
    return Trial(kind, f"strace {' '.join(options)}", allowed, run, parts)


def failing(command, setting):
    """Each call fails, alone or with all of its name behind it."""
    for call in calls_of(command):
        for error in ERRORS.get(call.name, OTHERS):
            options = injection(call, f"error={error.rstrip('+')}", "+" * error.endswith("+"))
            # Quicker; signals it would lose.
            yield trial("system calls that fail", call, ["--seccomp-bpf", *options], call.allowed(error, command.status),
                        call.name == "unlink")


def changing(command):
    """The calls that may change a file or the folder."""
    return [call for call in calls_of(command) if call.writes and call.name in CHANGING]


def killed(command, setting):
    """The process is killed before each call that may change a file; or it is asked to end there."""
    for call in changing(command):
        yield trial("kills", call, injection(call, "signal=KILL"), {-9}, True)
        yield trial("requests to end", call, injection(call, "signal=TERM"), {command.status, 128 + 15}, False)


def ordered(command, setting):
    """Each file's bytes are on the disk before the file gets its name."""
    def run(command, folder):
        log = command.place / f"{command.name} order.log".replace(" ", "_")
        ran = Ran(traced(command.words, log, ["-e", "trace=write,ftruncate,fsync,rename"]), folder)
        reached, renames = {}, 0
        for name, words, _ in filter(None, (CALL.match(line) and CALL.match(line).groups() for line in log.read_text().splitlines())):
            if name == "rename":
                part = re.search(r'"([^"]*\.part)"', words).group(1)
                renames += 1
                if not reached.get(part):
                    ran.wrong.append(f"{part} is renamed before its bytes are on the disk")
            elif match := re.match(r"\d+<([^>]*)>", words):
                reached[match.group(1).rsplit("/", 1)[-1]] = name == "fsync"
        if renames != len(command.right):
            ran.wrong.append(f"{renames} renames, expected {len(command.right)}")
        return ran
    if command.before != command.right and command.right:
        yield Trial("bytes on the disk before names", "strace -e trace=write,fsync,rename", {command.status}, run)
