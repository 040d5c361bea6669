# SPDX-License-Identifier: MIT
"""Scenes as Python maps, runs of the program on them, and what must hold for every run.

A scene is written as JSON, which is YAML. A run that ends with status 0 or 1 must print finite
numbers and a ledger that closes; any other end must name its cause. Everything else is a fault.
"""

import json
import math
import os
import subprocess
import sys
import tempfile

try:
    import h5py
    import numpy
except ImportError as missing:
    print(f"skipped: {missing}")
    sys.exit(77)

LEDGER = 1e-5  # residual over the largest term of any step; settings have a tolerance of 1e-6
TERMS = ("kinetic", "strain", "contact", "friction", "fracture", "support", "damping", "external",
         "numerical")


class Fault(Exception):
    """Something that no scene may bring about."""


class Late(Fault):
    """No end within the time that was given."""


class Result(dict):
    """What `nmm run --json` printed, its status and messages, and the peaks of the ledger."""

    def __init__(self, numbers, status, messages):
        super().__init__(numbers)
        self.status = status
        self.messages = messages
        self.largest_energy = 0.0  # of any term of the ledger, at any step
        self.most_gained = 0.0  # energy that came from nowhere, at any step: eq. (4.18)
        self.places = numpy.zeros((0, 2))  # of the corners of all elements, at the start
        self.stress = numpy.zeros((0, 3))  # xx, yy, xy of all elements, in the last frame

    @property
    def completed(self):
        return self.status == 0

    def monitor(self, name, kind="displacement"):
        return self["monitors"][name][kind]

    @property
    def told(self):
        """What the program itself says of its ledger, in short."""
        ledger = self.get("ledger", {})
        words = {"gain_step": "energy from nowhere", "residual_step": "ledger"}
        return [text for step, text in words.items() if ledger.get(step, 0) > 0]

    @property
    def cause(self):
        """In one line: what ended the run."""
        if self.completed:
            return ""
        if self.status == 1:
            return f"{self['end']}: {self['reason']}"
        lines = [line for line in self.messages.splitlines() if "error:" in line]
        return lines[0].split("error:", 1)[1].strip() if lines else ""

    def read_ledger(self, path):
        with h5py.File(path, "r") as file:
            table = file["nmm/ledger"]
            names = [name.decode() for name in table.attrs["columns"]]
            data = table[:]
            grid = file["VTKHDF"]
            self.places = grid["Points"][:grid["NumberOfPoints"][0], :2]
            if "CellData/stress" in grid:
                self.stress = grid["CellData/stress"][-grid["NumberOfCells"][-1]:][:, [0, 1, 3]]
        if not numpy.isfinite(data).all():
            raise Fault("a number in the ledger is not finite")
        terms = data[:, [names.index(name) for name in TERMS]]
        self.largest_energy = float(numpy.abs(terms).max(initial=self.largest_energy))
        lost = numpy.concatenate([[0.0], data[:, names.index("numerical")]])
        self.most_gained = float((numpy.maximum.accumulate(lost) - lost).max())

    def check(self, ledger, floor, force, told):
        """What must hold for every run that has results. `told`: a ledger that does not close may be,
        where the program says so itself."""
        residual = abs(self["energy"]["residual"])
        may = told and "ledger" in self.told
        if residual > max(ledger * self.largest_energy, floor, force * way_of(self)) and not may:
            raise Fault(f"ledger: residual {residual:.3g} of {self.largest_energy:.3g} J")
        if (self.status == 0) != (self["end"] == "completed"):
            raise Fault(f"status {self.status}, but the end is {self['end']}")
        if self.status == 1 and not self["reason"]:
            raise Fault(f"ended early ({self['end']}) without a reason")


def square(x, y, width, height=None):
    """Corners of a rectangle from its lower left one."""
    height = width if height is None else height
    return [[x, y], [x + width, y], [x + width, y + height], [x, y + height]]


def material(youngs_modulus=1e9, density=2500, poissons_ratio=0.25, **more):
    return {"density": density, "youngs_modulus": youngs_modulus, "poissons_ratio": poissons_ratio,
            **more}


def change(scene, **parts):
    """A copy with other parts; a map is merged, anything else replaced."""
    scene = dict(scene)
    for name, value in parts.items():
        if isinstance(value, dict) and isinstance(scene.get(name), dict):
            value = {**scene[name], **value}
        scene[name] = value
    return scene


def area_of(corners):
    return abs(sum(a[0] * b[1] - a[1] * b[0] for a, b in zip(corners, [*corners[1:], corners[0]]))) / 2


def kinetic_energy(scene):
    """At the start: the ledger holds changes only. A disc stands for each block that turns."""
    energy = 0.0
    density = max(float(m["density"]) for m in scene["materials"].values())
    for block in scene.get("blocks", []):
        vx, vy, spin = block.get("velocity", (0, 0, 0))
        area = area_of(block["polygon"])
        energy += density * area * (vx * vx + vy * vy + area / 6 * spin * spin) / 2
    return energy


def text_of(scene):
    return json.dumps({"nmm": 1, **scene})


def reject(word):
    raise Fault(f"{word} among the results")


def start(line, scene, timeout):
    try:
        done = subprocess.run(line, input=text_of(scene), text=True, capture_output=True,
                              timeout=timeout, check=False)
    except subprocess.TimeoutExpired as late:
        raise Late(f"no end within {timeout} s") from late
    if done.returncode not in (0, 1, 3, 4) or "Sanitizer" in done.stderr:
        raise Fault(f"exit status {done.returncode}: {done.stderr[-2000:]}")
    return done


def run(program, scene, *words, command="run", timeout=600, ledger=LEDGER, floor=1e-200, force=0,
        told=False):
    """Run a scene, or only check it. Raises Fault for what no scene may bring about. A ledger may
    miss `ledger` of its largest term, or `floor` [J], or the work of `force` [N]; more where the program tells it and `told` lets it."""
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "run.vtkhdf")
        more = ["-q", "--threads", "1", "-o", path] if command == "run" else []
        done = start([program, command, "-", "--json", *more, *words], scene, timeout)
        if done.returncode > 1:
            result = Result({}, done.returncode, done.stderr)
            if not result.cause:
                raise Fault(f"exit status {done.returncode} without a cause: {done.stderr!r}")
            return result
        numbers = json.loads(done.stdout, parse_constant=reject)
        result = Result(numbers, done.returncode, done.stderr)
        if command == "run":
            result.largest_energy = kinetic_energy(scene)
            result.read_ledger(path)
            result.check(ledger, floor, force, told)
    return result


def numbers_of(result, kind):
    """All numbers of all monitors, in the order of their names."""
    return [x for name in sorted(result["monitors"]) for x in result["monitors"][name][kind]]


def way_of(result):
    """Largest displacement of a monitor."""
    return max((abs(x) for x in numbers_of(result, "displacement")), default=0)


def distance(a, b):
    """Largest difference over the largest number; 0 where all are 0."""
    largest = max((abs(x) for x in [*a, *b]), default=0)
    return max((abs(x - y) for x, y in zip(a, b)), default=0) / largest if largest else 0.0


def digits(error):
    """Decimal digits that are right, of the 15.9 of a double."""
    return 15.9 if error <= 1.2e-16 else max(0.0, -math.log10(error))
