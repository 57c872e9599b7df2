"""What surrounds the process goes wrong: folders that are full, not writable, or vanish; another process; stops."""
import os, shutil, signal, subprocess, time

from commands import Ran, Trial

NOBODY = 65534
missing = set()  # what cannot be tried here, and why


def is_root(what):
    if os.geteuid() != 0:
        missing.add(f"{what}: only root can")
    return os.geteuid() == 0


def full(command, setting):
    """A disk of so many kilobytes is full."""
    def on_disk(kilobytes):
        def run(command, folder):
            disk = folder.with_name(folder.name + "_disk")
            disk.mkdir()
            subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={kilobytes}k,nr_inodes=100", "tmpfs", disk], check=True)
            try:
                for name, content in command.before.items():
                    (disk / name).write_bytes(content)
                return Ran(command.words, disk)
            finally:
                for path in disk.iterdir():
                    shutil.copy(path, folder)
                subprocess.run(["umount", disk], check=True)
                disk.rmdir()
        return run
    if command.right and is_root("a full disk"):
        def pages(files):
            return sum(-(-len(content) // 4096) for content in files.values())
        for kilobytes in range(4 * pages(command.before), 4 * pages(command.right) + 12, 4):
            yield Trial("a disk that is full", f"on a disk of {kilobytes} kB", {command.status, 5}, on_disk(kilobytes))


def read_only(command, setting):
    """Somebody else's folder."""
    def run(command, folder):
        folder.chmod(0o555)
        try:
            return Ran(command.words, folder, before=lambda: os.setuid(NOBODY))
        finally:
            folder.chmod(0o755)
    if is_root("a folder of somebody else"):
        yield Trial("a folder that is read-only", "as nobody in a folder of root", {5 if command.right else command.status}, run)


def stopped(command, folder, part, meanwhile):
    """A run that is stopped when so much of its time has passed; then meanwhile() is called, and it goes on."""
    with subprocess.Popen(command.words, cwd=folder, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                          stderr=subprocess.PIPE) as process:
        time.sleep(part * command.seconds)
        process.send_signal(signal.SIGSTOP)
        if process.poll() is None:
            os.waitid(os.P_PID, process.pid, os.WSTOPPED | os.WEXITED | os.WNOWAIT)
        meanwhile()
        process.send_signal(signal.SIGCONT)
        return Ran.of(process)


def stops(command, setting):
    """Stopped and continued at moments that are spread over the run; or its folder vanishes meanwhile."""
    def stop(part):
        return lambda command, folder: stopped(command, folder, part, lambda: None)

    def vanish(part):
        def run(command, folder):
            ran = stopped(command, folder, part, lambda: shutil.rmtree(folder))
            folder.mkdir()  # what was made is gone with it
            for name, content in (command.right if ran.status == command.status else command.before).items():
                (folder / name).write_bytes(content)
            return ran
        return run
    for tenths in range(10):
        what = f"after {tenths} tenths of its time"
        yield Trial("stops and goes on", f"SIGSTOP, SIGCONT {what}", {command.status}, stop(tenths / 10))
        if command.right:
            yield Trial("a folder that vanishes", f"rm -r {what}", {command.status, 5}, vanish(tenths / 10))


def two(command, setting):
    """Two processes do the same at once, slowly."""
    environment = {**os.environ, "LD_PRELOAD": setting.library, "FAULT_MOVED": "500"}

    def run(command, folder):
        other = subprocess.Popen(command.words, cwd=folder, env=environment, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL,
                                 stderr=subprocess.PIPE)
        ran = Ran(command.words, folder, environment)
        with other:
            if Ran.of(other).status != command.status:
                ran.wrong.append("the other process has another status")
        return ran
    for again in range(3):
        yield Trial("two processes at once", f"twice at once, {again}", {command.status}, run)


SECTIONS = {"full": full, "read-only": read_only, "stops": stops, "two": two}
