# SPDX-License-Identifier: MIT
"""Runs an example and checks the numbers that its README promises.

    python3 test_examples.py NMM EXAMPLE_FOLDER [--quick | --large]

The README holds one table whose head is `| run | quantity | expected | source |`:

    run        `as given`, or options of `nmm run` in backquotes
    quantity   path into the object that `nmm run --json` prints: `monitors.slider.displacement[0]`
    expected   `3.14 ± 0.01`, `< 1e-3`, `> 2` or a word
    source     where the number comes from

Each run is also checked for what holds always: it completes, all numbers are finite, the ledger
closes to 1e-6 of its largest term, nothing that can only be lost is gained. --quick takes a few
steps of each run, for builds in which every step is slow, and checks only that. --large makes the
run as given with the size of covers that the text names last, and expects the same of it, but for
quantities that the table has for that size alone; these are checked only so.

Of the text around the table these are checked where a page has them: `The scene has N unknowns`,
`` `--set covers.size=X` gives M `` and that a few steps run with it (not with --quick), and the time
over the second picture, `after T s`.
"""

import json
import math
import os
import re
import shlex
import subprocess
import sys
import tempfile

HEAD = "| run | quantity | expected | source |"
LEDGER = 1e-6  # residual of the energy ledger over its largest term
PICTURE = 200_000  # bytes


def read_table(readme):
    """Rows of the table as (run, quantity, expected)."""
    with open(readme, encoding="utf-8") as file:
        lines = file.read().splitlines()
    rows = []
    for line in lines[lines.index(HEAD) + 2:]:
        if not line.startswith("|"):
            break
        run, quantity, expected, source = (c.strip().strip("`") for c in line.strip("|").split("|"))
        if not source:
            raise ValueError(f"{readme}: no source for {quantity}")
        rows.append((run, quantity, expected))
    return rows


def look_up(result, path):
    for word in re.findall(r"[^.\[\]]+", path):
        result = result[int(word)] if isinstance(result, list) else result[word]
    return result


def is_met(value, expected):
    if match := re.fullmatch(r"(\S+) ± (\S+)", expected):
        return abs(value - float(match[1])) <= float(match[2])
    if match := re.fullmatch(r"([<>]) (\S+)", expected):
        return value < float(match[2]) if match[1] == "<" else value > float(match[2])
    return str(value) == expected


def numbers_of(result):
    """All numbers in a JSON value."""
    if isinstance(result, dict):
        result = list(result.values())
    if isinstance(result, list):
        for entry in result:
            yield from numbers_of(entry)
    elif isinstance(result, (int, float)):
        yield result


def always(result):
    """What holds for every run; yields (what, is it so?)."""
    energy = result["energy"]
    largest = max(abs(v) for v in energy.values())
    yield "end is completed", result["end"] == "completed"
    yield "all numbers are finite", all(math.isfinite(v) for v in numbers_of(result))
    yield (f"ledger residual {energy['residual']:.3g} J of {largest:.3g} J",
           abs(energy["residual"]) <= LEDGER * largest)
    for name in ("friction", "fracture", "damping", "numerical"):
        yield f"{name} {energy[name]:.3g} J is a loss", energy[name] >= -LEDGER * largest
    yield "penetration is reported", result["max_penetration"] >= 0


def refuse(text):
    raise ValueError(f"{text} is not a number of JSON")


def run(program, scene, options, quick):
    """What the run prints; quick: four steps of it."""
    if quick:
        with open(scene, encoding="utf-8") as file:
            dt = float(re.search(r"\bdt: ([\d.e+-]+)", file.read())[1])
        options = options + ["--set", f"time.end={4 * dt}"]
    with tempfile.TemporaryDirectory() as folder:
        command = [program, "run", scene, "--json", "--threads", "1", "-o",
                   os.path.join(folder, "run.vtkhdf")]
        done = subprocess.run(command + options, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        print(done.stderr, end="")
    return json.loads(done.stdout, parse_constant=refuse) if done.stdout else None


def unknowns_of(program, scene, options=()):
    done = subprocess.run([program, "check", scene, "--json", *options], capture_output=True,
                          text=True, check=True)
    return json.loads(done.stdout)["unknowns"]


def time_of_picture(page, scene):
    """Of the frame that the page's `nmm plot` draws, as the scene plans it."""
    frame = re.search(r"^nmm plot .*--frame (\d+)", page, re.M)
    key = "every" if frame else "end"
    return float(re.search(rf"\b{key}: ([\d.e+-]+)", scene)[1]) * (int(frame[1]) if frame else 1)


def sizes_of(page):
    """Sizes of covers that the page names: the setting, and unknowns."""
    return re.findall(r"`--set (covers\.size=[\d.]+)` gives (\d+)", page)


def rows_of(table, words, size=None):
    """What the table expects of a run: (quantity, expected); of a run with another size where the
    table names the size, else as of the run without it."""
    rows = {q: expected for run, q, expected in table if run == words}
    if size is not None:
        rows |= rows_of(table, f"--set {size}")
    return rows


def promises(program, folder):
    """What the text says beside the table; yields (what, is it so?)."""
    path = os.path.join(folder, "scene.yaml")
    with open(os.path.join(folder, "README.md"), encoding="utf-8") as file:
        page = file.read()
    with open(path, encoding="utf-8") as file:
        scene = file.read()
    if found := re.search(r"The scene has (\d+) unknowns", page):
        yield f"{found[1]} unknowns", unknowns_of(program, path) == int(found[1])
    for setting, number in sizes_of(page):
        yield (f"{setting} gives {number} unknowns",
               unknowns_of(program, path, ("--set", setting)) == int(number))
    if found := re.search(r"^\| before \| after ([\d.]+) s", page, re.M):
        yield (f"the picture is of {found[1]} s",
               math.isclose(time_of_picture(page, scene), float(found[1]), rel_tol=1e-9))


def pictures_of(folder):
    """Those that the page shows, and those that it must show."""
    with open(os.path.join(folder, "README.md"), encoding="utf-8") as file:
        shown = re.findall(r"!\[[^\]]*\]\(([^)]+)\)", file.read())
    of_paper = os.path.basename(os.path.dirname(os.path.abspath(folder))) == "paper"
    return sorted({"picture.png", *shown, *(["before.png"] if of_paper else [])})


class Checks:
    """Prints what is checked, and counts what failed."""

    def __init__(self):
        self.failed = 0

    def tell(self, what, good):
        self.failed += not good
        print(f"{'ok    ' if good else 'FAILED'} {what}")

    def check_run(self, name, result, rows):
        """What holds always of a run, and its rows of the table."""
        if result is None:
            self.tell(f"{name}: no result", False)
            return
        print(f"\n{name}: {result['unknowns']} unknowns, {result['steps']} steps, "
              f"{result['wall_seconds']:.1f} s")
        for what, good in always(result):
            self.tell(what, good)
        for quantity, expected in rows.items():
            value = look_up(result, quantity)
            self.tell(f"{quantity} = {value}, expected {expected}", is_met(value, expected))


def check_page(program, folder, checks):
    """Pictures, and what the text says."""
    for name in pictures_of(folder):
        picture = os.path.join(folder, name)
        checks.tell(f"{name} is there and small",
                    os.path.exists(picture) and 0 < os.path.getsize(picture) < PICTURE)
    for what, good in promises(program, folder):
        checks.tell(what, good)


def check(program, folder, how):
    """how: None, "--quick" or "--large"; returns how many failed."""
    readme, scene = os.path.join(folder, "README.md"), os.path.join(folder, "scene.yaml")
    table = read_table(readme)
    with open(readme, encoding="utf-8") as file:
        sizes = [setting for setting, _ in sizes_of(file.read())]
    checks = Checks()
    if how == "--large":
        result = run(program, scene, ["--set", sizes[-1]], False)
        checks.check_run(sizes[-1], result, rows_of(table, "as given", sizes[-1]))
        return checks.failed
    check_page(program, folder, checks)
    checks.tell("a bound on the penetration is promised",
                "max_penetration" in rows_of(table, "as given"))
    quick = how == "--quick"
    for setting in [] if quick else sizes:
        checks.check_run(f"{setting}, four steps", run(program, scene, ["--set", setting], True), {})
    large = [f"--set {setting}" for setting in sizes[-1:]]
    for words in dict.fromkeys(run for run, _, _ in table if run not in large):
        options = [] if words == "as given" else shlex.split(words)
        rows = {} if quick else rows_of(table, words)
        checks.check_run(words, run(program, scene, options, quick), rows)
    return checks.failed


if __name__ == "__main__":
    failures = check(*sys.argv[1:3], sys.argv[3] if len(sys.argv) > 3 else None)
    print(f"\n{failures} failed")
    sys.exit(failures > 0)
