# SPDX-License-Identifier: MIT
"""Makes the tables of docs/performance.md.

    python3 performance.py NMM [--part examples|wall|profile]... [--threads 1,2] [--repeat 3]
                               [--quick] [--page FILE]

examples  time per step and its share by phase, for each folder of examples/
wall      a dry wall of 45 x 45 stones, lattice covers: milliseconds per step
profile   where the processor's time goes in three scenes, by folder and by file of src/; needs `perf`,
          and NMM in its build folder, whose object files say where a function was written

Each number of the first two is the median of --repeat runs. Times are the wall clock's as `nmm run
--json` tells them by phase; writing of results is left out of the time per step.
"""

import argparse
import collections
import glob
import json
import os
import re
import shutil
import statistics
import subprocess
import tempfile

from pages import ROOT, make_parts, percent, table, tell_machine, write_part

EXAMPLES = os.path.join(ROOT, "examples")
NAMES = ("incline", "strut", "slope", "beam", "arch", "wall", "dam")
PHASES = ("contact", "assemble", "solve", "advance")

# Stones of 1 x 0.5 m in running bond on a fixed base; odd courses end in half stones, which count
# as stones here. Written for `columns` stones a course and `pairs` pairs of courses.
WALL = """nmm: 1
gravity: [0, -9.81]
blocks:
  - {{name: base, polygon: [[-2, -1], [{right}, -1], [{right}, 0], [-2, 0]]}}
  - {{polygon: [[0, 0], [1, 0], [1, 0.5], [0, 0.5]],
     repeat: {{count: [{columns}, {even}], step: [1, 1]}}}}
  - {{polygon: [[0.5, 0.5], [1.5, 0.5], [1.5, 1], [0.5, 1]],
     repeat: {{count: [{inner}, {odd}], step: [1, 1]}}}}
  - {{polygon: [[0, 0.5], [0.5, 0.5], [0.5, 1], [0, 1]],
     repeat: {{count: [2, {odd}], step: [{last}, 1]}}}}
materials:
  stone: {{density: 2500, youngs_modulus: 1e9, poissons_ratio: 0.25}}
interfaces:
  dry: {{friction_angle: 30}}
interface: dry
covers: {covers}
supports:
  - {{block: base, fix: xy}}
time: {{dt: 1e-3, end: {end}}}
output: {{every: {end}, fields: [displacement]}}
"""


def wall_scene(side, steps, covers):
    return WALL.format(right=side + 2, columns=side, even=(side + 1) // 2, inner=side - 1,
                       odd=side // 2, last=side - 0.5, end=1e-3 * steps, covers=covers)


def run(program, scene, threads, options=()):
    """One run's JSON object; with its wall time per phase in milliseconds per step."""
    with tempfile.TemporaryDirectory() as folder:
        done = subprocess.run([program, "run", scene, "--json", "--threads", str(threads), "-o",
                               os.path.join(folder, "run.vtkhdf"), *options],
                              capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise SystemExit(f"{scene}: {done.stderr}")
    result = json.loads(done.stdout)
    result["ms"] = {p: 1e3 * result["phase_seconds"][p] / result["steps"] for p in PHASES}
    return result


def median_run(given, scene, threads, options=()):
    """The last of some runs, its times replaced by medians."""
    runs = [run(given.nmm, scene, threads, options) for _ in range(given.repeat)]
    result = runs[-1]
    result["ms"] = {p: statistics.median(r["ms"][p] for r in runs) for p in PHASES}
    result["ms_step"] = statistics.median(sum(r["ms"].values()) for r in runs)
    result["wall"] = statistics.median(r["wall_seconds"] for r in runs)
    return result


# --- Times by phase

def show_examples(given):
    rows = []
    for name in NAMES:
        scene = os.path.join(EXAMPLES, name, "scene.yaml")
        for threads in given.threads:
            r = median_run(given, scene, threads,
                           ("--set", "time.end=0.05") if given.quick else ())
            rows.append([f"[{name}](../examples/{name}/README.md)", str(r["blocks"]),
                         str(r["unknowns"]), str(r["contacts"]), str(r["steps"]),
                         f"{r['open_close_iterations'] / r['steps']:.1f}", str(threads),
                         f"{r['wall']:.1f}", f"{r['ms_step']:.2f}",
                         *(percent(100 * r["ms"][p] / r["ms_step"]) for p in PHASES)])
    return table(["*example", "blocks", "unknowns", "contacts", "steps", "passes a step", "threads",
                  "run s", "ms a step", *PHASES], rows)


def show_wall(given):
    rows = []
    with tempfile.NamedTemporaryFile("w", suffix=".yaml") as file:
        file.write(wall_scene(8 if given.quick else 45, 100, "{size: 1.2}"))
        file.flush()
        for threads in given.threads:
            r = median_run(given, file.name, threads)
            rows.append([str(r["blocks"] - 1), str(r["unknowns"]), str(r["contacts"]),
                         f"{r['open_close_iterations'] / r['steps']:.1f}",
                         f"{r['solver']['iterations'] / r['solver']['solves']:.0f}", str(threads),
                         f"{r['ms_step']:.1f}", *(f"{r['ms'][p]:.1f}" for p in PHASES)])
    return table(["stones", "unknowns", "contacts", "passes a step", "iterations a solve",
                  "threads", "ms a step", *PHASES], rows)


# --- Profile

LEAST = 2.0  # [%] of a scene, to be named


def functions_of(build):
    """File below src/ of each function of the library, from its object files."""
    place = {}
    for path in glob.glob(os.path.join(build, "src", "**", "*.o"), recursive=True):
        found = re.search(r"CMakeFiles/[^/]+/(\w+/\w+\.c)\.o$", path)
        if not found:
            continue
        listed = subprocess.run(["nm", "--defined-only", path], capture_output=True, text=True,
                                check=True).stdout
        for line in listed.splitlines():
            words = line.split()
            if len(words) == 3 and words[1] in "tT":
                place.setdefault(plain(words[2]), found[1])
    return place


def plain(symbol):
    """A function's name without what the compiler adds."""
    return re.sub(r"\.(part|isra|constprop|cold|_omp_fn)\.?\d*.*$", "", symbol)


def profile(program, scene, options, folder):
    """Percent of the time of the library's functions, by name."""
    record = os.path.join(folder, "perf.data")
    subprocess.run(["perf", "record", "-q", "-e", "cpu-clock", "-F", "4000", "-o", record, program,
                    "run", scene, "--threads", "1", "--quiet", "-o",
                    os.path.join(folder, "run.vtkhdf"), *options], check=True,
                   stdout=subprocess.DEVNULL)
    report = subprocess.run(["perf", "report", "-i", record, "--stdio", "--no-children", "-q",
                             "--sort", "dso,symbol", "-t", ";"], capture_output=True, text=True,
                            check=True).stdout
    share = collections.Counter()
    for line in report.splitlines():
        words = line.strip().split(";")
        # As `12.3%;libnmm.so.0.1.0;[.] name`, more columns behind it.
        found = len(words) > 2 and re.match(r"\[\.\] (\S+)", words[2].strip())
        if found and "libnmm" in words[1]:
            share[plain(found[1])] += float(words[0].strip().rstrip("%"))
    whole = sum(share.values())
    return {name: 100 * value / whole for name, value in share.items()}


def largest_first(shares):
    """Names that reach LEAST in a scene, by their largest share."""
    largest = {name: max(s[name] for s in shares) for s in shares for name in s}
    return sorted((n for n in largest if largest[n] >= LEAST), key=lambda n: -largest[n])


def profile_rows(shares, names):
    return [[percent(s[name]) if s[name] >= 0.5 else "" for s in shares] for name in names]


def profile_scenes(given, folder):
    """The three scenes: name, file, options."""
    wall = os.path.join(folder, "wall.yaml")
    with open(wall, "w", encoding="utf-8") as file:
        file.write(wall_scene(8 if given.quick else 45, 100, "{mesh: block}"))
    return (("slope", os.path.join(EXAMPLES, "slope", "scene.yaml"),
             ("--set", f"time.end={0.05 if given.quick else 1}")),
            ("dam", os.path.join(EXAMPLES, "dam", "scene.yaml"), ()),
            ("wall of whole blocks", wall, ()))


def show_profile(given):
    place = functions_of(given.build)
    titles, files, folders = [], [], []
    functions = collections.defaultdict(collections.Counter)  # of a file, over all scenes
    with tempfile.TemporaryDirectory() as folder:
        for title, scene, options in profile_scenes(given, folder):
            titles.append(title)
            files.append(collections.Counter())
            folders.append(collections.Counter())
            for name, value in profile(given.nmm, scene, options, folder).items():
                file = place.get(name, "other/")
                files[-1][file] += value
                folders[-1][file.split("/")[0]] += value
                functions[file][name] += value
    names = largest_first(folders)
    rows = [[name, *row] for name, row in zip(names, profile_rows(folders, names))]
    body = table(["*folder of src", *titles], rows) + "\n\n"
    names = largest_first(files)
    rows = [[name, ", ".join(f"`{n}`" for n, _ in functions[name].most_common(3)), *row]
            for name, row in zip(names, profile_rows(files, names))]
    body += table(["*file in src", "*most of it in", *titles], rows) + "\n\n"
    for title, folder, file in zip(titles, folders, files):
        (most, part), (first, value) = folder.most_common(1)[0], file.most_common(1)[0]
        body += (f"Next bottleneck of the {title}: {first} with {percent(value)} of the time; "
                 f"of the folders {most} with {percent(part)}.\n")
    return body.rstrip()


PARTS = {"examples": show_examples, "wall": show_wall, "profile": show_profile}


def main():
    parser = argparse.ArgumentParser(description="Tables of docs/performance.md")
    parser.add_argument("nmm", help="the program, in its build folder")
    parser.add_argument("--part", action="append", choices=PARTS, help="only this part")
    parser.add_argument("--threads", default="1,2", help="numbers of threads, as 1,2")
    parser.add_argument("--repeat", type=int, default=3, help="runs of which the median is taken")
    parser.add_argument("--quick", action="store_true", help="a try: numbers are worth nothing")
    parser.add_argument("--page", default=os.path.join(ROOT, "docs", "performance.md"))
    given = parser.parse_args()
    given.nmm = os.path.abspath(given.nmm)
    given.build = os.path.dirname(given.nmm)
    given.threads = [int(n) for n in given.threads.split(",")]
    parts = given.part or list(PARTS)
    if "profile" in parts and not shutil.which("perf"):
        print("profile: left as it is, perf is not here")
        parts.remove("profile")
    took = make_parts(parts, lambda part: write_part(given.page, part, PARTS[part](given)))
    if not given.part:
        tell_machine(given.page, given.nmm, took)


if __name__ == "__main__":
    main()
