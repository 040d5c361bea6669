# SPDX-License-Identifier: MIT
"""Makes the tables and pictures of docs/experiments.md and docs/only.md out of `nmm bench`.

    python3 experiments.py NMM [--only NAME]... [--quick] [--docs FOLDER]

Runs each experiment, says how long it took, writes its table between the page's markers and its
picture into the folder `pictures` beside the page. What was measured on a GPU elsewhere (`nmm bench
fig7 --device target`) is kept in experiments-gpu.csv beside the page, and shown where that file is.
"""

import csv
import json
import os
import shutil
import subprocess
import tempfile

from pages import (ROOT, make_parts, number, percent, read_choices, table, tell_machine,
                   write_part)

NAMES = ("table1", "fig6", "fig7", "contact", "wall", "growth", "only")
OF_SCENES = ("table1", "fig6", "fig7")  # the others have scenes of their own


# --- One function for each table; `result` is what `nmm bench NAME --json` prints

def show_table1(result):
    head = ["*scene", "blocks", "order", "steps", "SOR: contact", "assembly", "solver", "rest",
            "ms a step", "ours: contact", "assembly", "solver", "rest", "ms a step", "threads",
            "times faster", "differ", "ours alone", "shortened"]
    rows = []
    for r in result["rows"]:
        shares = [[percent(r[side + part + "_share"]) for part in
                   ("contact", "assembly", "solver", "rest")] for side in ("sor_", "")]
        rows.append([f"[{r['scene']}](../examples/paper/{r['scene']}/README.md)",
                     *(number(r[k]) for k in ("blocks", "unknowns", "steps")),
                     *shares[0], number(r["sor_step_ms"]), *shares[1], number(r["step_ms"]),
                     number(r["threads"]), number(r["speedup"]), number(r["difference"], 2),
                     number(r["own_difference"], 2), f"{number(r['sor_cuts'])}, {number(r['cuts'])}"])
    return table(head, rows)


def show_fig6(result):
    names = [("sor", "SOR(1.9)"), ("gauss_seidel", "Gauss-Seidel"), ("jacobi", "Jacobi"),
             ("damped_jacobi", "damped Jacobi"), ("chebyshev", "Chebyshev"), ("pcg", "PCG, 2x2"),
             ("pcg_body", "PCG, bodies")]
    wanted, rows = 1, []
    for r in result["rows"]:
        # About four rows for each power of ten.
        if r["iteration"] < wanted:
            continue
        wanted = 1.7 * r["iteration"]
        rows.append([number(r["iteration"]), *(number(r[key], 2) for key, _ in names)])
    return table(["iteration"] + [title for _, title in names], rows)


def show_fig7(result):
    systems = {}
    for r in result["rows"]:
        if r["threads"] is not None:
            systems.setdefault((r["times"], r["scene"]), []).append(r)
    threads = sorted({r["threads"] for rows in systems.values() for r in rows})
    head = ["*scene", "order", "*method", "SOR iterations", "iterations", "SOR ms"]
    head += [f"ms, {t} thread{'s' if t > 1 else ''}" for t in threads]
    head += [f"over SOR, {t}" for t in threads]
    rows = []
    for (_, scene), found in systems.items():
        by_threads = {r["threads"]: r for r in found}
        first = found[0]
        rows.append([scene, number(first["order"]), first["method"], number(first["sor_iterations"]),
                     number(first["iterations"]), number(first["sor_ms"]),
                     *(number(by_threads[t]["ms"]) if t in by_threads else "" for t in threads),
                     *(number(by_threads[t]["speedup_over_sor"]) if t in by_threads else ""
                       for t in threads)])
    return table(head, rows)


def show_contact(result):
    keys = ("blocks", "edges", "contacts", "threads", "step_ms", "step_us_per_block", "index_ms",
            "bytes_per_block")
    return table(["blocks", "edges", "contacts", "threads", "ms a step", "us a block",
                  "ms with a new index", "bytes a block"],
                 [[number(r[k]) for k in keys] for r in result["rows"]])


def show_wall(result):
    keys = ("blocks", "unknowns", "contacts", "steps", "passes", "step_ms", "first_step_ms",
            "next_steps_ms", "contact_ms", "assembly_ms", "solver_ms", "public_dda_ms", "part_of_public_dda")
    return table(["blocks", "unknowns", "contacts", "balance", "steps", "passes", "ms a step",
                  "the first one", "the next nine", "contact", "assembly", "solver",
                  "public DDA", "part of it"],
                 [[*(number(r[k]) for k in keys[:3]), f"{r['balance']:.0e}",
                   *(number(r[k]) for k in keys[3:])] for r in result["rows"]])


def show_growth(result):
    keys = ("unknowns", "contacts", "create_ms", "contact_ms", "assembly_ms", "solver_ms",
            "rest_ms", "step_ms", "passes", "megabytes")
    return table(["*scene", "unknowns", "contacts", "ms to create", "contact", "assembly", "solver",
                  "rest", "ms a step", "passes", "MB"],
                 [[r["scene"], *(number(r[k]) for k in keys)] for r in result["rows"]])


def show_only(result):
    keys = ("without_ms", "with_ms", "time_saved", "without_mb", "with_mb", "memory_saved",
            "file_without_mb", "file_with_mb")
    return table(["*feature", "*scene", "unknowns", "ms a step without", "with", "time saved",
                  "MB without", "with", "memory saved", "run file, MB without", "with"],
                 [[r["feature"], r["scene"], number(r["unknowns"]),
                   *(percent(r[k]) if k.endswith("saved") else number(r[k]) for k in keys)]
                  for r in result["rows"]])


SHOW = {"table1": show_table1, "fig6": show_fig6, "fig7": show_fig7, "contact": show_contact,
        "wall": show_wall, "growth": show_growth, "only": show_only}


def show_gpu(page):
    path = os.path.join(os.path.dirname(page), "experiments-gpu.csv")
    if not os.path.exists(path):
        return "Not run on a GPU."
    with open(path, newline="", encoding="utf-8") as file:
        rows = [r for r in csv.DictReader(file) if r["ms"] and not r["threads"]]
    if not rows:
        return "Not run on a GPU."
    head = ["*device", "*scene", "order", "*method", "iterations", "SOR ms there", "our serial ms",
            "ms", "over SOR", "over serial"]
    keys = ("sor_ms", "serial_ms", "ms", "speedup_over_sor", "speedup_over_serial")
    return "On a GPU, beside the processor of that machine:\n\n" + table(
        head, [[r["device"], r["scene"], number(r["order"]), r["method"], number(r["iterations"]),
                *(number(r[k]) for k in keys)] for r in rows])


# --- Measuring, and the page

def measure(program, name, quick, folder):
    words = [program, "bench", name, "--json", "-o", folder]
    if name in OF_SCENES:
        words += ["--scenes", os.path.join(ROOT, "examples", "paper")]
    done = subprocess.run(words + ["--quick"] * quick, stdout=subprocess.PIPE, text=True,
                          check=False)
    if done.returncode != 0:
        raise SystemExit(f"{name}: ended with status {done.returncode}")
    return json.loads(done.stdout)


def write_result(docs, name, result, folder):
    """Table, notes and picture of an experiment."""
    page, picture = os.path.join(docs, "experiments.md"), f"experiments-{name}.svg"
    if name == "only":
        page, picture = os.path.join(docs, "only.md"), "only.svg"
    body = SHOW[name](result)
    if result["notes"]:
        body += "\n\n" + "\n".join(result["notes"])
    write_part(page, name, body)
    shutil.copyfile(os.path.join(folder, name + ".svg"), os.path.join(docs, "pictures", picture))


def main():
    given = read_choices("Tables and pictures of docs/experiments.md", NAMES,
                         "numbers are worth nothing")
    page = os.path.join(given.docs, "experiments.md")
    with tempfile.TemporaryDirectory() as folder:
        def make(name):
            write_result(given.docs, name, measure(given.nmm, name, given.quick, folder), folder)
        took = make_parts(given.only or NAMES, make)
    write_part(page, "gpu", show_gpu(page))
    # Where a part was measured alone, the others may be another machine's.
    if not given.only:
        tell_machine(page, given.nmm, took)


if __name__ == "__main__":
    main()
