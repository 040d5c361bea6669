# SPDX-License-Identifier: MIT
"""Makes the tables and pictures of docs/experiments.md out of `nmm bench`.

    python3 experiments.py NMM [--only NAME]... [--quick] [--page FILE]

Runs each experiment, writes its table between the page's markers and its picture into the folder
`pictures` beside the page. What was measured on a GPU elsewhere (`nmm bench fig7 --device target`)
is kept in experiments-gpu.csv beside the page, and shown where that file is.
"""

import argparse
import csv
import json
import os
import platform
import re
import shutil
import subprocess
import tempfile

HERE = os.path.dirname(os.path.abspath(__file__))
ROOT = os.path.dirname(os.path.dirname(HERE))
NAMES = ("table1", "fig6", "fig7", "contact", "wall", "growth")


# --- Markdown

def number(value, digits=3):
    """So many digits, without an exponent where that reads well; empty for nothing."""
    if value is None or value == "":
        return ""
    value = float(value)
    if value == int(value) and abs(value) < 1e7:
        return str(int(value))
    if 1e-3 <= abs(value) < 1e5:
        digits_before = len(str(int(abs(value)))) if abs(value) >= 1 else 0
        text = f"{value:.{max(0, digits - digits_before)}f}" if digits_before else f"{value:.{digits}g}"
        return text
    return f"{value:.{digits - 1}e}"


def table(head, rows):
    """Words to the left, numbers to the right: a column whose name begins with a star has words."""
    lines = ["| " + " | ".join(h.lstrip("*") for h in head) + " |",
             "|" + "|".join("---" if h.startswith("*") else "--:" for h in head) + "|"]
    lines += ["| " + " | ".join(row) + " |" for row in rows]
    return "\n".join(lines)


def percent(value):
    return f"{float(value):.0f} %"


# --- One function for each table; `result` is what `nmm bench NAME --json` prints

def show_table1(result):
    head = ["*scene", "blocks", "order", "steps", "SOR: contact", "assembly", "solver", "rest",
            "ms a step", "ours: contact", "assembly", "solver", "rest", "ms a step", "threads",
            "times faster", "differ"]
    rows = []
    for r in result["rows"]:
        shares = [[percent(r[side + part + "_share"]) for part in
                   ("contact", "assembly", "solver", "rest")] for side in ("sor_", "")]
        rows.append([f"[{r['scene']}](../examples/paper/{r['scene']}/README.md)",
                     *(number(r[k]) for k in ("blocks", "unknowns", "steps")),
                     *shares[0], number(r["sor_step_ms"]), *shares[1], number(r["step_ms"]),
                     number(r["threads"]), number(r["speedup"]), number(r["difference"], 2)])
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
    keys = ("blocks", "unknowns", "contacts", "steps", "passes", "step_ms", "first_steps_ms",
            "contact_ms", "assembly_ms", "solver_ms", "public_dda_ms", "part_of_public_dda")
    return table(["blocks", "unknowns", "contacts", "balance", "steps", "passes", "ms a step",
                  "of the first steps", "contact", "assembly", "solver", "public DDA",
                  "part of it"],
                 [[*(number(r[k]) for k in keys[:3]), f"{r['balance']:.0e}",
                   *(number(r[k]) for k in keys[3:])] for r in result["rows"]])


def show_growth(result):
    keys = ("unknowns", "contacts", "create_ms", "contact_ms", "assembly_ms", "solver_ms",
            "rest_ms", "step_ms", "passes", "megabytes")
    return table(["*scene", "unknowns", "contacts", "ms to create", "contact", "assembly", "solver",
                  "rest", "ms a step", "passes", "MB"],
                 [[r["scene"], *(number(r[k]) for k in keys)] for r in result["rows"]])


SHOW = {"table1": show_table1, "fig6": show_fig6, "fig7": show_fig7, "contact": show_contact,
        "wall": show_wall, "growth": show_growth}


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

def machine(program):
    model = platform.machine()
    try:
        with open("/proc/cpuinfo", encoding="utf-8") as file:
            found = re.search(r"model name\s*: (.*)", file.read())
            model = found[1] if found else model
    except OSError:
        pass
    version = subprocess.run([program, "--version"], capture_output=True, text=True, check=True)
    return f"{model}, {os.cpu_count()} cores, {platform.system()}; {version.stdout.strip()}."


def measure(program, name, quick, folder):
    words = [program, "bench", name, "--json", "-o", folder,
             "--scenes", os.path.join(ROOT, "examples", "paper")]
    done = subprocess.run(words + ["--quick"] * quick, stdout=subprocess.PIPE, text=True,
                          check=False)
    if done.returncode != 0:
        raise SystemExit(f"{name}: ended with status {done.returncode}")
    return json.loads(done.stdout)


def replace_part(text, name, body):
    pattern = re.compile(rf"(<!-- bench: {name} -->\n).*?(<!-- end -->)", re.S)
    if not pattern.search(text):
        raise SystemExit(f"the page has no part {name}")
    return pattern.sub(lambda m: m[1] + body + "\n" + m[2], text)


def write_part(page, name, body):
    with open(page, encoding="utf-8") as file:
        text = replace_part(file.read(), name, body)
    with open(page, "w", encoding="utf-8") as file:
        file.write(text)


def main():
    parser = argparse.ArgumentParser(description="Tables and pictures of docs/experiments.md")
    parser.add_argument("nmm", help="the program")
    parser.add_argument("--only", action="append", choices=NAMES, help="only this experiment")
    parser.add_argument("--quick", action="store_true", help="a try: numbers are worth nothing")
    parser.add_argument("--page", default=os.path.join(ROOT, "docs", "experiments.md"))
    given = parser.parse_args()
    program = os.path.abspath(given.nmm)
    pictures = os.path.join(os.path.dirname(os.path.abspath(given.page)), "pictures")
    os.makedirs(pictures, exist_ok=True)
    write_part(given.page, "machine", machine(program))
    write_part(given.page, "gpu", show_gpu(os.path.abspath(given.page)))
    with tempfile.TemporaryDirectory() as folder:
        for name in given.only or NAMES:
            print(f"{name} ...", flush=True)
            result = measure(program, name, given.quick, folder)
            notes = "\n".join(result["notes"])
            write_part(given.page, name, f"{SHOW[name](result)}\n\n{notes}")
            shutil.copyfile(os.path.join(folder, name + ".svg"),
                            os.path.join(pictures, f"experiments-{name}.svg"))


if __name__ == "__main__":
    main()
