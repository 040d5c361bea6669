# SPDX-License-Identifier: MIT
"""Speed of nmm: the tables of docs/performance.md, printed as Markdown.

    python3 bench_examples.py NMM [--part examples|wall|scaling]... [--threads 1,2] [--repeat 3]
                                  [--largest 100000]

examples  time per step and its share by phase, for each folder of examples/
wall      a dry wall of 45 x 45 stones at rest: milliseconds per step
scaling   contact search and assembly per step, for walls of 10^2 to 10^5 stones

Each number is the median of --repeat runs. Times are the wall clock's as `nmm run --json` tells
them by phase; writing of results is left out of the time per step.
"""

import argparse
import json
import os
import platform
import statistics
import subprocess
import tempfile

EXAMPLES = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "examples")
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
covers: {{size: 1.2}}
supports:
  - {{block: base, fix: xy}}
time: {{dt: 1e-3, end: {end}}}
output: {{every: {end}, fields: [displacement]}}
"""


def wall_scene(columns, courses, steps):
    return WALL.format(right=columns + 2, columns=columns, even=(courses + 1) // 2,
                       inner=columns - 1, odd=courses // 2, last=columns - 0.5, end=1e-3 * steps)


def run(program, scene, threads):
    """One run's JSON object; with its wall time per phase in milliseconds per step."""
    with tempfile.TemporaryDirectory() as folder:
        done = subprocess.run([program, "run", scene, "--json", "--threads", str(threads), "-o",
                               os.path.join(folder, "run.vtkhdf")],
                              capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise SystemExit(f"{scene}: {done.stderr}")
    result = json.loads(done.stdout)
    result["ms"] = {p: 1e3 * result["phase_seconds"][p] / result["steps"] for p in PHASES}
    return result


def median_run(program, scene, threads, repeat):
    """The last of `repeat` runs, its times replaced by medians."""
    runs = [run(program, scene, threads) for _ in range(repeat)]
    result = runs[-1]
    result["ms"] = {p: statistics.median(r["ms"][p] for r in runs) for p in PHASES}
    result["ms_step"] = statistics.median(sum(r["ms"].values()) for r in runs)
    result["wall"] = statistics.median(r["wall_seconds"] for r in runs)
    return result


def median_wall(given, columns, courses, steps, threads):
    with tempfile.NamedTemporaryFile("w", suffix=".yaml") as file:
        file.write(wall_scene(columns, courses, steps))
        file.flush()
        return median_run(given.nmm, file.name, threads, given.repeat)


def bench_examples(given):
    print("| example | blocks | unknowns | contacts | steps | passes a step | threads | run s | "
          "ms a step | contact | assemble | solve | advance |")
    print("|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|")
    for name in NAMES:
        for threads in given.threads:
            r = median_run(given.nmm, os.path.join(EXAMPLES, name, "scene.yaml"), threads,
                           given.repeat)
            share = " | ".join(f"{100 * r['ms'][p] / r['ms_step']:.0f} %" for p in PHASES)
            print(f"| {name} | {r['blocks']} | {r['unknowns']} | {r['contacts']} | {r['steps']} | "
                  f"{r['open_close_iterations'] / r['steps']:.1f} | {threads} | {r['wall']:.1f} | "
                  f"{r['ms_step']:.2f} | {share} |", flush=True)


def bench_wall(given):
    print("| stones | unknowns | contacts | passes a step | iterations a solve | threads | "
          "ms a step | contact | assemble | solve | advance |")
    print("|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|")
    for threads in given.threads:
        r = median_wall(given, 45, 45, 100, threads)
        parts = " | ".join(f"{r['ms'][p]:.1f}" for p in PHASES)
        print(f"| {r['blocks'] - 1} | {r['unknowns']} | {r['contacts']} | "
              f"{r['open_close_iterations'] / r['steps']:.1f} | "
              f"{r['solver']['iterations'] / r['solver']['solves']:.0f} | {threads} | "
              f"{r['ms_step']:.1f} | {parts} |", flush=True)


def bench_scaling(given):
    print("| stones | unknowns | contacts | threads | contact ms a step | us a stone | "
          "assemble ms a pass | us a stone |")
    print("|--:|--:|--:|--:|--:|--:|--:|--:|")
    # Low walls: 10 courses, so that only the number of stones changes, not the load on a stone.
    for columns in (10, 30, 100, 300, 1000, 3000, 10000):
        if 10 * columns > given.largest:
            break
        for threads in given.threads:
            r = median_wall(given, columns, 10, 5, threads)
            n = r["blocks"] - 1
            assemble = r["ms"]["assemble"] * r["steps"] / r["open_close_iterations"]
            print(f"| {n} | {r['unknowns']} | {r['contacts']} | {threads} | "
                  f"{r['ms']['contact']:.2f} | {1e3 * r['ms']['contact'] / n:.2f} | "
                  f"{assemble:.2f} | {1e3 * assemble / n:.2f} |", flush=True)


def main():
    parts = {"examples": bench_examples, "wall": bench_wall, "scaling": bench_scaling}
    parser = argparse.ArgumentParser(description="Speed of nmm, as Markdown tables")
    parser.add_argument("nmm", help="the program")
    parser.add_argument("--part", action="append", choices=parts, help="only this part")
    parser.add_argument("--threads", default="1,2", help="numbers of threads, as 1,2")
    parser.add_argument("--repeat", type=int, default=3, help="runs of which the median is taken")
    parser.add_argument("--largest", type=int, default=100000, help="stones of the largest wall")
    given = parser.parse_args()
    given.threads = [int(n) for n in given.threads.split(",")]
    version = subprocess.run([given.nmm, "--version"], capture_output=True, text=True, check=True)
    print(f"{version.stdout.strip()}; {platform.machine()}, {os.cpu_count()} cores; "
          f"median of {given.repeat} runs")
    for part in given.part or parts:
        print(f"\n### {part}\n")
        parts[part](given)


if __name__ == "__main__":
    main()
