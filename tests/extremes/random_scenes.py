#!/usr/bin/python3
# SPDX-License-Identifier: MIT
"""Random scenes: each is run for a few steps, and again in other words that must not matter.

    random_scenes.py PROGRAM SEED COUNT [--seconds S] [--workers N] [--keep FOLDER] [--book FILE]
    random_scenes.py PROGRAM --scene SEED

Scene k of a run has the seed SEED + k: domains that joints and joint sets cut, walls and heaps of
blocks, materials over many decades, supports, loads and settings of any kind. Of each run it is
asked that the status is one of the contract and a cause is told, that all numbers are finite, that
the ledger closes, and that no energy comes from nowhere: where the program says so itself the scene
is counted as told, where it is silent as failed. Then everything is listed in another order, the
scene is mirrored, put upside down, turned, shifted to map coordinates, scaled by 1024 and by 1000:
all monitors must move as the scene does. And its blocks fall freely and are squeezed, which has an
answer of its own (absolute.py).

Where they do not, the scene and the copy are sheared by 1e-12 to 1e-9, both ways: one that answers
with a difference as large decides something at a rounding, and is counted as sensitive, which is no
finding. So does one that another method of the solver leads to another balance. Copies whose steps are cut at other places are counted as such, where the errors of the
steps of both, by steps of a third, make as much of a difference, and so are those whose lattice is
another one.

--keep writes the scenes with findings; --seconds begins no scene after that time; --book puts the
counts into a document.
"""

import collections
import concurrent.futures
import itertools
import math
import os
import random
import re
import sys
import time

import numpy

from absolute import absolutes
from copies import NUDGES, back, in_other_passes, in_shorter_steps, nudged, size_of, variants
from scene import Fault, Late, area_of, distance, material, numbers_of, run, square, text_of, way_of

# Largest difference over the largest number of all monitors, after a few steps. Contacts that set
# in at a rounding earlier or later make the differences of exact copies grow. A lattice of another
# direction is another discretization: turned scenes are compared with whole blocks only.
NEAR = {"displacement": 1e-4, "velocity": 1e-3, "stress": 1e-2}
OTHERWISE = 1e3  # an end that is another one, in such differences
GAIN = 0.02  # energy from nowhere over the largest term: finite steps in which compressed bodies turn
# At map coordinates places have digits of 1e-9 m, and points nearer than this are one: what moves by
# so little may move otherwise.
DIGITS = 2e-8
TWO_LAWS = 12200000  # first seed of those whose joints may have two interfaces
TIMEOUT = 20  # [s] of one run; one that takes longer is counted as slow
LONG = 3  # [s] of a run after which its scene is not run in all copies


def decades(dice, low, high):
    """Evenly distributed in the logarithm."""
    return 10 ** dice.uniform(math.log10(low), math.log10(high))


def rounded(x):
    """A multiple of 2^-16: shifts by whole numbers are exact."""
    return round(x * 65536) / 65536


def random_polygon(dice, size):
    """Star-shaped about (size / 2, size / 2), four to nine corners."""
    n = dice.randint(4, 9)
    start = dice.uniform(0, 2 * math.pi)
    corners = []
    for k in range(n):
        angle = start + 2 * math.pi * (k + dice.uniform(-0.3, 0.3)) / n
        radius = size * dice.uniform(0.3, 0.5)
        corners.append([rounded(size / 2 + radius * math.cos(angle)),
                        rounded(size / 2 + radius * math.sin(angle))])
    return corners


def random_materials(dice, n):
    """Moduli within eight decades, densities within four."""
    base, heavy = decades(dice, 1e5, 1e11), decades(dice, 1, 1e4)
    return {f"m {i}": material(base * decades(dice, 1e-2, 1e2), heavy * decades(dice, 0.1, 10),
                               dice.choice([0, 0.25, 0.45, 0.49]),
                               plane=dice.choice(["strain", "stress"])) for i in range(n)}


def random_interface(dice):
    bonded = dice.random() < 0.3
    return {"friction_angle": dice.choice([0, 10, 30, 45, 80]),
            "cohesion": decades(dice, 1e2, 1e6) if bonded else 0,
            "tensile_strength": decades(dice, 1e2, 1e6) if bonded else 0}


def random_joint(dice, size):
    corners = [[rounded(dice.uniform(-0.2, 1.2) * size), rounded(dice.uniform(-0.2, 1.2) * size)]
               for _ in range(dice.choice([2, 2, 2, 3]))]
    # It must reach into the domain.
    corners[0] = [rounded(dice.uniform(0.35, 0.65) * size), rounded(dice.uniform(0.35, 0.65) * size)]
    if len(corners) == 3 or dice.random() < 0.5:  # the inner corner in the middle: through-going
        corners.insert(1, corners.pop(0))
    if len(corners) == 2 and dice.random() < 0.7:
        (x, y), (p, q) = corners
        corners[0] = [rounded(x - 2 * (p - x)), rounded(y - 2 * (q - y))]
    return {"polyline": corners}


def random_rock(dice, size):
    """A domain with joints, held at its bottom."""
    scene = {"domain": [{"polygon": random_polygon(dice, size)}],
             "joints": [random_joint(dice, size) for _ in range(dice.randint(0, 6))]}
    if dice.random() < 0.3:
        scene["domain"] = [{"polygon": square(0.0, 0.0, size)}]
    low = min(y for _, y in scene["domain"][0]["polygon"])
    if not scene["joints"]:
        del scene["joints"]
    scene["supports"] = [{"box": [[-size, rounded(low - size)], [2 * size, rounded(low + 0.2 * size)]],
                          "fix": dice.choice(["xy", "xy", "y"])}]
    return scene


def random_heap(dice, size):
    """Blocks apart or side by side over a fixed floor."""
    n_x, n_y = dice.randint(1, 4), dice.randint(1, 3)
    side = rounded(size / 5)
    gap = dice.choice([0.0, 0.0, rounded(side / 8)])
    blocks = [{"name": "floor", "polygon": square(-size, -side, 3 * size, side), "velocity": [0, 0, 0]}]
    for i in range(n_x):
        for j in range(n_y):
            if dice.random() < 0.2:
                continue
            x, y = i * (side + gap), j * (side + gap)
            polygon = square(x, y, side)
            if dice.random() < 0.3:
                polygon = polygon[:2] + [[x + side, y + side / 2], [x + side / 2, y + side]] + polygon[3:]
            velocity = [dice.uniform(-1, 1), dice.uniform(-1, 0), dice.uniform(-1, 1)]
            blocks.append({"name": f"block {i} {j}", "polygon": polygon,
                           "velocity": velocity if dice.random() < 0.4 else [0, 0, 0]})
    return {"blocks": blocks, "supports": [{"block": "floor", "fix": "xy"}]}


def monitors_of(scene, size):
    """Centres of blocks; for a domain places about its middle. A place in a hole is no error here."""
    if "blocks" in scene:
        points = [[sum(p[k] for p in block["polygon"]) / len(block["polygon"]) for k in (0, 1)]
                  for block in scene["blocks"][1:]] or [[0.0, -0.01 * size]]
    else:
        corners = scene["domain"][0]["polygon"]
        centre = [sum(p[k] for p in corners) / len(corners) for k in (0, 1)]
        points = [centre] + [[0.5 * (centre[k] + p[k]) for k in (0, 1)] for p in corners]
    return [{"name": f"p {i:02}", "point": [rounded(x), rounded(y)]} for i, (x, y) in enumerate(points)]


def beside(scene, size):
    """Monitors a little beside where loads are: not on a node of the lattice, where stress is that of
    any element round it."""
    return [{**m, "point": [m["point"][0] + rounded(0.0137 * size), m["point"][1] + rounded(0.0071 * size)]}
            for m in scene["monitors"]]


def random_settings(dice, size):
    dt = decades(dice, 1e-5, 1e-2)
    scene = {"gravity": dice.choice([[0, -9.81], [0, -9.81], [3.0, -8.0], [0, 0]]),
             "analysis": {"tolerance": 1e-8}, "solver": {"tolerance": 1e-10},
             "time": {"dt": dt, "end": dt * dice.randint(3, 12), "max_move": 0.05},
             "output": {"every": 1e9}}
    if dice.random() < 0.3:
        scene["analysis"]["scheme"] = "newmark"
    elif dice.random() < 0.15:
        scene["analysis"]["kind"] = "static"
        del scene["time"]
    if dice.random() < 0.3:
        scene["covers"] = {"mesh": "block"}
    else:
        scene["covers"] = {"size": rounded(size / dice.uniform(4, 12))}
    if dice.random() < 0.3:
        scene["contact"] = {"method": dice.choice(["penalty", "augmented"]),
                            "penalty": round(decades(dice, 0.1, 1e3), 6)}
    if dice.random() < 0.2:
        scene["analysis"]["damping"] = decades(dice, 0.1, 100)
    if dice.random() < 0.3:
        scene["solver"]["method"] = dice.choice(["pcg", "direct", "gauss-seidel"])
    return scene


def random_scene(seed):
    dice = random.Random(seed)
    size = dice.choice([1.0, 8.0, 64.0])
    scene = random_rock(dice, size) if dice.random() < 0.6 else random_heap(dice, size)
    scene.update(random_settings(dice, size))
    scene["materials"] = random_materials(dice, dice.choice([1, 1, 2, 3]))
    names = list(scene["materials"])
    for entry in scene.get("blocks", []) + scene.get("domain", []):
        entry["material"] = dice.choice(names)
    if "domain" in scene and len(names) > 1:
        # Not through the middle, where a monitor is: on a border its stress is that of either side.
        scene["regions"] = [{"polygon": square(0.0, 0.0, rounded(size * 0.51)), "material": names[1]}]
    scene["interfaces"] = {"i": random_interface(dice)}
    scene["monitors"] = monitors_of(scene, size)
    if dice.random() < 0.4:
        weight = 9.81 * size * size * max(m["density"] for m in scene["materials"].values())
        force = [dice.uniform(-1, 1) * weight * 0.1, dice.uniform(-1, 0.2) * weight * 0.1]
        scene["loads"] = [{"point": dice.choice(scene["monitors"])["point"], "force": force}]
    if dice.random() < 0.1:
        scene["initial_stress"] = {"kind": "uniform", "xx": -1e4, "yy": -2e4, "xy": 0}
    scene["monitors"] = beside(scene, size)
    # Not by the dice: the scenes of order 0 stay what they were.
    if "size" in scene["covers"] and seed % 5 in (1, 3):
        scene["covers"]["order"] = 1 + seed % 5 // 2
    if "joints" in scene and seed >= TWO_LAWS and seed % 2:
        scene["interfaces"]["k"] = random_interface(random.Random(seed))
        scene["interface"] = "i"
        scene["joints"] = [{**joint, "interface": "ik"[n % 2]} for n, joint in enumerate(scene["joints"])]
    # A reference for small systems with much inertia only.
    small = "mesh" in scene["covers"] and "kind" not in scene["analysis"]
    if scene["solver"].get("method") == "gauss-seidel" and not small:
        del scene["solver"]["method"]
    return scene


# --- Findings

def same_steps(result, other, name):
    """Steps of the same lengths: where as many are cut in both, they may be others."""
    a, b = result.steps, other.steps / size_of(name)
    return len(a) == len(b) and numpy.allclose(a, b, rtol=1e-3, atol=0)


def same_mesh(result, other, name):
    """Is the mesh of the other copy that of the first one, moved as the copy is? A lattice begins
    where slivers along straight sides are avoided, which need not be symmetric."""
    a = result.places
    b = numpy.array(back("displacement", [x for p in other.places for x in p], name)).reshape(-1, 2)
    if len(a) != len(b):
        return False
    a, b = (p - 0.5 * (p.min(axis=0) + p.max(axis=0)) for p in (a, b))
    unit = 1e-6 * numpy.abs(a).max()

    def listed(places):
        return sorted((round(x / unit), round(y / unit)) for x, y in places.tolist())
    near = sum(max(abs(p[0] - q[0]), abs(p[1] - q[1])) > 1 for p, q in zip(listed(a), listed(b)))
    return near <= 0.05 * len(a)  # neighbours in the list may change places


def worst_of(result, other, name, floors):
    """How far the numbers of two runs are apart, in words, and how often the largest difference
    that is let pass, of the kind that is worst. Numbers below their floor have no digits."""
    worst, words = 0.0, None
    for kind, limit in NEAR.items():
        a, b = numbers_of(result, kind), back(kind, numbers_of(other, kind), name)
        error = distance([*a, floors[kind]], [*b, floors[kind]])
        if error / limit > worst:
            worst, words = error / limit, f"{name}: {kind} differs by {error:.1e}"
    return words, worst


def ends_alike(result, other):
    """Two that end without an answer may be told so in other steps of the search; the cause, behind
    the last colon, is the same. A search for equilibrium that finds none may end by the way or by
    an element that is turned inside out on it."""
    if (result.status, result.get("end")) == (other.status, other.get("end")):
        return True
    causes = [run.cause.rsplit(": ", 1)[-1] for run in (result, other)]
    none = {result.get("end"), other.get("end")} == {"no_equilibrium", "step_too_small"}
    return result.status == other.status == 1 and (none or causes[0] == causes[1])


def compare(result, other, name, floors):
    """What differs, in words, and how often as much as is let pass: 0 for no more than that."""
    if not ends_alike(result, other):
        return f"{name}: ends otherwise: {result.cause or 'completed'} / {other.cause or 'completed'}", OTHERWISE
    if result.status != 0:
        return None, 0.0
    if result["blocks"] != other["blocks"]:
        return f"{name}: {result['blocks']} blocks, then {other['blocks']}", OTHERWISE
    words, worst = worst_of(result, other, name, floors)
    return (words, worst) if worst > 1 else (None, 0.0)


def extent_of(scene):
    corners = [p for part in ("domain", "blocks") for entry in scene.get(part, []) for p in entry["polygon"]]
    return max(abs(x) for p in corners for x in p)


def rounding_of(scene):
    """Energy [J] and force [N] below which there are no digits: what strains of 1e-12 of the whole
    store, springs included, and their push where a place is rounded."""
    size, stiffest = extent_of(scene), max(m["youngs_modulus"] for m in scene["materials"].values())
    springs = max(1.0, 2 * scene.get("contact", {}).get("penalty", 40.0))  # as in eq. (4.19)
    return 1e-24 * size * size * stiffest * springs, 1e-15 * size * stiffest * springs


def way_of_rounding(scene):
    """Displacement [m] and velocity [m/s] that the lightest body gets where forces are balanced as
    well as they can be told: a quarter of the force above stays unbalanced for all of the time."""
    if "time" not in scene:
        return 0.0, 0.0
    bodies = scene.get("domain", []) + scene.get("blocks", [])[1:]
    lightest = min(scene["materials"][b["material"]]["density"] * area_of(b["polygon"])
                   for b in bodies) if bodies else math.inf
    velocity = 0.25 * rounding_of(scene)[1] / lightest * scene["time"]["end"]
    return 0.5 * velocity * scene["time"]["end"], velocity


class Findings(list):
    """What is wrong with a scene: (failed | told | ended | slow | other steps | sensitive | other mesh,
    words)."""

    def __init__(self, program, scene):
        super().__init__()
        self.program, self.scene = program, scene
        self.floor, self.force = rounding_of(scene)
        self.stiffest = max(m["youngs_modulus"] for m in scene["materials"].values())
        self.own_answer = self.of_steps = None
        self.end = "none"
        result = self.attempt("as it is", scene)
        if result is not None:
            self.end = result.get("end") or f"refused: {re.sub(r'[(0-9].*', '', result.cause)[:60].strip()}"
        if result is None or result.status == 3:
            return
        self.look_for_gain(result)
        self.extend(("told", f"{words}: {result['ledger']['warning']}") for words in result.told)
        for name, other, judge in absolutes(scene):
            self.look_at_absolute(name, other, judge)
        copies = None if result["wall_seconds"] < LONG else 1
        for name, other in itertools.islice(variants(scene), copies):
            self.look_for_difference(result, name, other)

    def attempt(self, name, scene):
        try:
            # Energies of a slice go by the square of its size.
            size = size_of(name)
            return run(self.program, scene, timeout=TIMEOUT, floor=self.floor * size * size,
                       force=self.force * size, told=True)
        except Late as late:
            self.append(("slow", f"{name}: {late}"))
        except Fault as fault:
            self.append(("failed", f"{name}: {fault}"))
        return None

    def look_at_absolute(self, name, scene, judge):
        """One whose answer is known, or that ends with the cause."""
        result = self.attempt(name, scene)
        if result and not result.completed:
            self.append(("ended", f"{name}: {result.cause}"))
        elif result and (words := judge(scene, result)):
            self.append(("failed", f"{name}: {words}"))

    def floors_of(self, name):
        """Largest numbers of each kind that are no more than what rounding may make of them."""
        dt = self.scene.get("time", {}).get("dt", math.inf)
        digits = 1e-15 * extent_of(self.scene)
        floors = {"displacement": digits / NEAR["displacement"], "velocity": 2 * digits / dt / NEAR["velocity"],
                  "stress": 1e-9 * self.stiffest}
        way, velocity = way_of_rounding(self.scene)
        floors["displacement"] += way / NEAR["displacement"]
        floors["velocity"] += velocity / NEAR["velocity"]
        if name == "shifted":
            size = self.scene["covers"].get("size", 1.0)
            floors = {"displacement": floors["displacement"] + DIGITS / NEAR["displacement"],
                      "velocity": floors["velocity"] + 2 * DIGITS / dt / NEAR["velocity"],
                      "stress": floors["stress"] + self.stiffest * DIGITS / size / NEAR["stress"]}
        return floors

    def look_for_gain(self, result):
        gained, largest = result.most_gained, result.largest_energy
        told = "energy from nowhere" in result.told
        if gained > max(GAIN * largest, self.floor, self.force * way_of(result)) and not told:
            self.append(("failed", f"energy from nowhere: {gained:.3g} of {largest:.3g} J"))

    def look_for_difference(self, result, name, scene):
        other = self.attempt(name, scene)
        if other is None:
            return
        floors = self.floors_of(name)
        words, error = compare(result, other, name, floors)
        if words is None:
            return
        if name in ("mirrored", "upside down", "turned round") and not same_mesh(result, other, name):
            self.append(("other mesh", words))
            return
        if self.own_answer is None:
            self.own_answer = max(self.answers_to_nothing("as it is", self.scene, result))
        sensitive = (self.own_answer > 0.1 * error or
                     any(x > 0.1 * error for x in self.answers_to_nothing(name, scene, other)))
        self.append(("sensitive" if sensitive else
                     "other steps" if self.is_of_steps(result, other, name, scene, error) else "failed",
                     words))

    def scaled_floors(self, name):
        """Of a copy by itself, in its own lengths."""
        floors = self.floors_of(name)
        floors["displacement"] *= size_of(name)
        return floors

    def answers_to_nothing(self, name, scene, result):
        """The differences that shears make which nobody can see, and that the way of the passes makes:
        with much friction forces of a step may balance at several places. Asked of copies too: where
        a scene has two answers, only one of both may lie near the border between them."""
        changes = [("nudged", nudged(scene, part)) for part in NUDGES]
        for words, change in [*changes, ("in other passes", in_other_passes(scene))]:
            near = self.attempt(f"{name}, {words}", change)
            yield compare(result, near, words, self.scaled_floors(name))[1] if near else 0.0

    def is_of_steps(self, result, other, name, scene, error):
        """One that comes through in other steps has another error of its steps: are both together as
        large? A third of the step leaves a third of an error of first order. Where friction holds,
        the equilibrium that is found depends on the way there."""
        if same_steps(result, other, name):
            return False
        if self.of_steps is None:
            self.of_steps = self.error_of_steps("as it is", self.scene, result)
        return error <= self.of_steps + self.error_of_steps(name, scene, other)

    def error_of_steps(self, name, scene, result):
        finer = self.attempt(f"{name}, shorter steps", in_shorter_steps(scene))
        floors = self.scaled_floors(name)
        return 1.5 * worst_of(result, finer, "", floors)[1] if finer and finer.completed else 0.0


def show(program, seed):
    scene = random_scene(seed)
    print(text_of(scene))
    for state, words in Findings(program, scene):
        print(f"{state}: {words}", file=sys.stderr)


def look_at(program, seed):
    """One scene, in a process of its own."""
    start = time.monotonic()
    scene = random_scene(seed)
    found = Findings(program, scene)
    return seed, found.end, list(found), time.monotonic() - start


def look_at_all(program, seeds, workers, limit):
    """As they come; none begins after `limit` seconds."""
    start = time.monotonic()
    with concurrent.futures.ThreadPoolExecutor(workers) as pool:
        def look(seed):
            return look_at(program, seed) if time.monotonic() - start < limit else None
        for result in pool.map(look, seeds):
            if result is not None:
                yield result


class Counts:
    """What a run of many scenes found."""

    def __init__(self):
        self.ends, self.kinds, self.scenes = (collections.Counter() for _ in range(3))
        self.slowest = []

    def add(self, seed, end, found, seconds):
        self.ends[end] += 1
        self.scenes.update({state for state, _ in found})
        self.kinds.update(f"{state}: {text.split(':')[0]}" for state, text in found)
        self.slowest = sorted(self.slowest + [(round(seconds, 1), seed)], reverse=True)[:5]

    def table(self):
        n = sum(self.ends.values())
        lines = ["| | scenes | |", "|---|---|---|",
                 f"| tried | {n} | {', '.join(f'{end}: {k}' for end, k in self.ends.most_common())} |"]
        for state in ("failed", "told", "ended", "slow", "other steps", "sensitive", "other mesh"):
            kinds = [f"{kind.split(': ')[1]}: {k}" for kind, k in self.kinds.most_common()
                     if kind.startswith(state)]
            lines.append(f"| {state} | {self.scenes[state]} | {', '.join(kinds)} |")
        return lines


def write_book(path, lines):
    with open(path, encoding="utf-8") as file:
        text = file.read()
    new = "\n".join(["<!-- begin random -->", "", *lines, "", "<!-- end random -->"])
    text, n = re.subn("<!-- begin random -->.*?<!-- end random -->", lambda _: new, text, flags=re.S)
    if n != 1:
        sys.exit(f"{path}: no place for the counts")
    with open(path, "w", encoding="utf-8") as file:
        file.write(text)


def main(program, *words):
    if words[0] == "--scene":
        return show(program, int(words[1]))
    first, count = int(words[0]), int(words[1])
    options = dict(zip(words[2::2], words[3::2]))
    keep, limit = options.get("--keep"), float(options.get("--seconds", math.inf))
    counts = Counts()
    start = time.monotonic()
    for seed, end, found, seconds in look_at_all(program, range(first, first + count),
                                                 int(options.get("--workers", 1)), limit):
        counts.add(seed, end, found, seconds)
        for state, text in found:
            if state in ("failed", "told", "ended"):
                print(f"{state.upper()} seed {seed}: {text}", flush=True)
        if keep and any(state == "failed" for state, _ in found):
            with open(os.path.join(keep, f"seed_{seed}.yaml"), "w", encoding="utf-8") as file:
                file.write(text_of(random_scene(seed)))
    lines = counts.table()
    print(f"from seed {first}, {time.monotonic() - start:.0f} s, slowest: {counts.slowest}", *lines, sep="\n")
    if "--book" in options:
        write_book(options["--book"], lines)
    sys.exit(counts.scenes["failed"] > 0)


if __name__ == "__main__":
    if len(sys.argv) < 2 or sys.argv[1] in ("-h", "--help"):
        sys.exit(__doc__)
    main(*sys.argv[1:])
