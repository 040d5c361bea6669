#!/usr/bin/python3
# SPDX-License-Identifier: MIT
"""Measures the solvers and writes docs/solvers.md and its pictures. Called by run.sh.

Usage: bench.py --build FOLDER [--long] [--only SECTION]... [--system NAME]... [--budget SECONDS]

Sections, in order (--only runs some of them; results of the others stay in the build folder):
systems   linear systems from the shipped scenes and from jointed rock of several sizes
peers     our methods and other libraries' on each system, in at most 20 s each from 20 000 unknowns
long      the same for systems of 200 000 and 10^6 unknowns; only with --long
family    the plain methods without acceleration, on small systems
threads   a solve on one thread and on two, beside what the machine allows two threads
sweeps    memory bandwidth of a sweep; cost of sums in a fixed order, and of unfused multiply-add
jacobi    Jacobi's region of convergence over dt; the fifteen scenes of the paper
contacts  numbers of contacts and penalties
runs      the first 100 steps of each shipped scene with each choice of solver
write     tables and pictures from all results that are there

--long adds section long, the systems of 200 000 and 10^6 unknowns, half an hour: each method in a
process of its own, with a limit of memory and one of time.
"""

import argparse
import os
import resource
import subprocess
import sys
import time

import pictures
import results
import tables

HERE = os.path.dirname(os.path.abspath(__file__))
ROOT = os.path.abspath(os.path.join(HERE, "..", "..", ".."))
ROCK = os.path.join(HERE, "rock.yaml")

# Shipped scenes: a step in the middle of the run.
SCENES = {"incline": 200, "strut": 250, "arch": 845, "wall": 1250, "slope": 507, "beam": 500,
          "dam": 100}
PAPER = {"strut_whole": 175, "strut_joint": 175, "push_block": 1500, "ball_plates": 100,
         "ring_strut": 300, "ring_voussoirs": 375, "rings_halfplane": 200, "arch_abutments": 625,
         "arch_columns": 650, "slope_joint": 1000, "slope_circular": 250, "beam_18": 500,
         "beam_44": 400, "dam_joints_a": 200, "dam_joints_b": 250}
# Jointed rock: name -> size of covers [m], spacings of the two joint sets [m].
ROCKS = {"rock-200": (13.3, 11.5, 11), "rock-500": (5.6, 6.8, 8.2), "rock-1000": (3.6, 4.8, 5.7),
         "rock-2200": (2.15, 3.3, 3.9), "rock-20k": (0.54, 1.4, 1.65),
         "rock-200k": (0.125, 1.1, 1.3), "rock-1M": (0.052, 0.9, 1.05)}
LONG = ("rock-200k", "rock-1M")
COURANTS = ("0.3", "1", "10", "1e5")
# Near dynamics, near statics.
LONG_COURANTS = ("1", "1e5")
# What is sensible at these sizes, ours first; those that can use two threads are tried with both.
LONG_METHODS = ("auto", "direct", "pcg-cover", "pcg-cluster", "pcg-body", "cholmod", "mumps",
                "petsc-cg-2x2", "petsc-cg-icc1", "petsc-cg-icc3", "petsc-gamg", "eigen-cg-icc")
# From 20 000 unknowns on each method runs by itself, so that one that finds no end costs the others
# nothing: seconds for a method and a system, reading and analysis included; GiB of addresses.
ALONE_SECONDS = {"rock-20k": 20, "rock-200k": 20, "rock-1M": 60}
ALONE_MEMORY = 20
# All but PLAIN; each stands for its mixed form, too.
METHODS = ("auto", "direct", "pcg-cover", "pcg-cluster", "pcg-body", "chebyshev-cover",
           "chebyshev-cluster", *tables.PEERS)
# Pressure waves in the rock [m/s], for the first steps, which are made with C = 1.
WAVE_SPEED = 1549.2
WARM_STEPS = 3
REGION = ("1e-3", "3e-3", "0.01", "0.02", "0.03", "0.04", "0.05", "0.06", "0.08", "0.1", "0.2",
          "0.5", "1", "3", "10", "100", "1e3", "1e4", "1e5")
# The paper's scenes at their own dt, and at shorter ones; mass is consistent unless told otherwise.
PAPER_STEPS = (("own", 0, ()), ("C0.3", 0.3, ()), ("C0.03", 0.03, ()),
               ("lumped_C0.3", 0.3, ("analysis.mass=lumped",)),
               ("lumped_C0.03", 0.03, ("analysis.mass=lumped",)))
PENALTIES = ("1", "10", "100", "1000")
# Spacing of the joints as a multiple of rock-2200's; the covers stay.
SPACINGS = ("8", "4", "2", "1", "0.7")
# Methods without acceleration, which take seconds where others take milliseconds.
PLAIN = ("jacobi-cover", "jacobi-cluster", "jacobi-plain", "sor", "gauss-seidel")


def scene_of(name):
    folder = os.path.join("paper", name) if name in PAPER else name
    return os.path.join(ROOT, "examples", folder, "scene.yaml")


class Bench:
    def __init__(self, given):
        self.given = given
        self.programs = os.path.join(given.build, "tests", "solve", "peers")
        self.results = os.path.join(given.build, "results")
        self.systems = os.path.join(given.build, "systems")
        os.makedirs(self.results, exist_ok=True)
        os.makedirs(self.systems, exist_ok=True)

    def call(self, program, *words):
        command = [os.path.join(self.programs, program)] + [str(w) for w in words]
        done = subprocess.run(command, stdout=subprocess.PIPE, text=True, check=False)
        if done.returncode != 0:
            sys.exit(f"error: {' '.join(command)} ended with {done.returncode}")
        return done.stdout

    def keep(self, name, text):
        with open(os.path.join(self.results, name + ".tsv"), "w", encoding="utf-8") as file:
            file.write(text)

    # --- Systems

    def dump(self, name, scene, step, courant, settings=()):
        """The file of a system; made when it is not there, or older than its scene or what makes it."""
        path = os.path.join(self.systems, name + ".sys")
        made_from = scene, os.path.join(self.programs, "dump_system")
        if not os.path.exists(path) or os.path.getmtime(path) < max(map(os.path.getmtime, made_from)):
            print(self.call("dump_system", scene, step, courant, path, *settings), end="")
        return path

    def rock(self, name, rock, courant, settings=(), spacing=1.0):
        size, first, second = ROCKS[rock]
        given = [f"covers.size={size}", f"joint_sets[0].spacing={first * spacing}",
                 f"joint_sets[1].spacing={second * spacing}", f"time.dt={size / WAVE_SPEED}"]
        return self.dump(name, ROCK, WARM_STEPS, courant, given + list(settings))

    def all_systems(self):
        files = {}
        for scene, step in (SCENES | PAPER).items():
            if self.wanted(scene):
                files[scene] = self.dump(scene, scene_of(scene), step, 0)
        for rock in (name for name in ROCKS if name not in LONG):
            for courant in COURANTS:
                name = f"{rock}_C{courant}"
                if self.wanted(name):
                    files[name] = self.rock(name, rock, courant)
        return files

    def wanted(self, name):
        return not self.given.system or any(part in name for part in self.given.system)

    # --- Sections

    def run_systems(self):
        self.all_systems()

    def solve(self, files, *words):
        budget = ["-b", self.given.budget, "-s", 5]
        return self.call("bench_peers", *budget, "-t", "1e-6", "-t", "1e-10", *words, *files)

    def run_peers(self):
        without = [word for name in PLAIN for word in ("-x", name)]
        for name, path in self.all_systems().items():
            if name.split("_")[0] in ALONE_SECONDS:
                self.solve_in_turn(name, path, METHODS, "-b", self.given.budget, *without)
            else:
                self.keep("peers_" + name, self.solve([path], "-j", 1, "-j", 2, *without))
            print(name, flush=True)

    def solve_in_turn(self, name, path, methods, *words):
        """Each method in a process of its own, with what it reached in its time."""
        found = []
        for method in methods:
            text, why = self.solve_alone(name, path, method, words)
            found.append(results.completed(name, method, text, why))
            print(found[-1], end="", flush=True)
        self.keep("peers_" + name, "".join(found))

    def solve_alone(self, name, path, method, words):
        """One method by itself: what it printed, and why it ended if that was not the last line."""
        limit = ALONE_SECONDS[name.split("_")[0]]
        command = [os.path.join(self.programs, "bench_peers"), "-s", str(limit / 3), "-t", "1e-6",
                   "-t", "1e-10", "-j", "1", "-j", "2", "-o", method, *map(str, words), path]
        memory = ALONE_MEMORY << 30
        try:
            done = subprocess.run(
                command, stdout=subprocess.PIPE, text=True, check=False, timeout=limit,
                preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_AS, (memory, memory)))
        except subprocess.TimeoutExpired as late:
            return (late.stdout or b"").decode(), f"> {limit} s"
        why = f"ended with {done.returncode}: memory?" if done.returncode != 0 else ""
        return done.stdout, why

    def run_long(self):
        if not self.given.long:
            return
        for rock in LONG:
            for courant in LONG_COURANTS:
                name = f"{rock}_C{courant}"
                if not self.wanted(name):
                    continue
                path = self.rock(name, rock, courant)
                self.solve_in_turn(name, path, LONG_METHODS, "-b", 1)

    def run_family(self):
        only = [word for name in PLAIN for word in ("-o", name)]
        files = [self.rock(f"{rock}_C{courant}", rock, courant)
                 for rock in ("rock-200", "rock-2200") for courant in ("0.3", "1", "10")]
        self.keep("family", self.solve(files, "-r", 3, *only))

    def run_threads(self):
        rocks = ["rock-20k", "rock-200k"] + (["rock-1M"] if self.given.long else [])
        files = [self.rock(f"{rock}_C{courant}", rock, courant)
                 for rock in rocks for courant in ("0.3", "1", "1e5")
                 if courant != "0.3" or rock not in LONG]
        self.keep("threads", self.call("bench_sweeps", "threads", *files))

    def run_sweeps(self):
        sizes = ["rock-2200", "rock-20k", "rock-200k"] + (["rock-1M"] if self.given.long else [])
        files = [self.rock(f"{rock}_C1", rock, "1") for rock in sizes]
        self.keep("bandwidth", self.call("bench_sweeps", "bandwidth", *files[1:]))
        self.keep("sums", self.call("bench_sweeps", "sums", *files))
        direct = [self.rock(f"{rock}_C1", rock, "1")
                  for rock in ("rock-500", "rock-1000", "rock-2200", "rock-20k")]
        self.keep("fused", self.call("bench_sweeps", "fused", *direct))

    def run_jacobi(self):
        files = [self.rock(f"region_{mass}_C{courant}", "rock-1000", courant,
                           [f"analysis.mass={mass}"])
                 for mass in ("lumped", "consistent") for courant in REGION]
        self.keep("jacobi", self.call("bench_sweeps", "jacobi", *files))
        scenes = [self.dump(f"{scene}-{name}", scene_of(scene), step, courant, settings)
                  for scene, step in PAPER.items() for name, courant, settings in PAPER_STEPS]
        self.keep("paper", self.call("bench_sweeps", "jacobi", *scenes))

    def run_contacts(self):
        penalties = [self.rock(f"penalty_{penalty}_C{courant}", "rock-2200", courant,
                               [f"contact.penalty={penalty}"])
                     for courant in ("1", "10", "1e5") for penalty in PENALTIES]
        numbers = [self.rock(f"contacts_{spacing}_C{courant}", "rock-2200", courant,
                             spacing=float(spacing))
                   for courant in ("10", "1e5") for spacing in SPACINGS]
        ours = ["-o", "auto", "-o", "pcg"]
        self.keep("penalty", self.solve(penalties, *ours))
        self.keep("contacts", self.solve(numbers, *ours))

    def run_runs(self):
        lines = []
        for scene in SCENES | PAPER:
            if not self.wanted(scene):
                continue
            lines.append(self.call("bench_runs", scene_of(scene), self.given.steps, 1, 3))
            print(scene, flush=True)
        self.keep("runs", "".join(lines).replace(os.path.join(ROOT, "examples", ""), ""))

    def run_write(self):
        docs = os.path.join(ROOT, "docs")
        tables.write(self.results, os.path.join(docs, "solvers.md"))
        pictures.draw(self.results, os.path.join(docs, "pictures"))


SECTIONS = ("systems", "peers", "long", "family", "threads", "sweeps", "jacobi", "contacts", "runs", "write")


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", required=True, help="folder of the build, and of the results")
    parser.add_argument("--long", action="store_true", help="section long, too")
    parser.add_argument("--only", action="append", choices=SECTIONS, default=[])
    parser.add_argument("--system", action="append", default=[],
                        help="only systems whose name contains this")
    parser.add_argument("--budget", type=float, default=0.1,
                        help="seconds for one method in one system")
    parser.add_argument("--steps", type=int, default=100, help="steps of section runs")
    bench = Bench(parser.parse_args())
    for section in SECTIONS:
        if bench.given.only and section not in bench.given.only:
            continue
        start = time.monotonic()
        getattr(bench, "run_" + section)()
        print(f"{section}: {time.monotonic() - start:.0f} s", flush=True)


if __name__ == "__main__":
    main()
