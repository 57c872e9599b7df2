"""From a file of others to a picture, with no option but where to: seconds, and all pictures on one sheet."""
import json, shutil, subprocess

from harness import DATA, OUT, WISP, Job, median, skipped, table
from smoke import sheet

# Fog volumes of OpenVDB's own tool, and what makes them.
VDB = {"vdb_ball": "-sphere d=200 r=1.5", "vdb_icosahedron": "-platonic faces=20 dim=160"}


def made_by_vdb_tool():
    if not (shutil.which("vdb_tool") and shutil.which("build/vdb_to_nvdb")):
        skipped("OpenVDB files", "install libopenvdb-tools, libopenvdb-dev and libboost-dev, then run make")
        return []
    files = []
    for name, how in VDB.items():
        file = OUT / f"{name}.vdb"
        if not file.exists():
            # It ends with 1 even where it has written its file.
            subprocess.run(["vdb_tool", *how.split(), "-ls2fog", "-write", file], capture_output=True)
        files.append(file)
    return files


def files():
    kinds = {".vtk", ".bgeo", ".ply", ".vol"}
    found = [file for folder in ("particles", "volumes") for file in sorted((DATA / folder).rglob("*")) if file.suffix in kinds]
    if not found:
        skipped("Files of others", f"none in {DATA}/particles and {DATA}/volumes")
        return
    OUT.mkdir(parents=True, exist_ok=True)
    jobs = []
    for up in ("y", "z"):
        for file in [*found, *made_by_vdb_tool()]:
            name = f"files_{file.stem}_{file.suffix[1:]}_{up}"
            options = [] if up == "y" else ["--up", up]
            jobs.append((file, up, Job(name, [WISP, "render", file, *options, "-o", OUT / f"{name}.png"], (file,),
                                       (OUT / f"{name}.png",))))
    yield
    rows = []
    for file, up, job in jobs:
        facts = json.loads(subprocess.run([WISP, "info", file, "--json"], capture_output=True, text=True).stdout or "{}")
        count = facts.get("particles", facts.get("not_zero", ""))
        result = median(job.clock()) if job.good() else job.results[0].get("error", "") if job.results else ""
        rows.append([file.name, up, facts.get("kind", ""), count, result])
    table("files", "From a file to a picture: `wisp render FILE -o a.png`",
          ["file", "axis that points up", "kind", "particles, or samples that are not 0", "seconds"], rows)
    if shutil.which("montage"):
        for up in ("y", "z"):
            sheet(f"files_{up}", "5x", [job.name for _, way, job in jobs if way == up and job.good()])
