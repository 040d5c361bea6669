# SPDX-License-Identifier: MIT
"""What the programs of the benchmark printed, as cells that can be asked for by name."""

import glob
import os
import re

FIELDS = ("system", "order", "blocks", "contacts", "closed", "dt", "courant", "tolerance",
          "threads", "method", "family", "ms", "least", "iterations", "residual", "note")
WHOLE = ("order", "blocks", "contacts", "closed", "threads", "iterations")
REAL = ("dt", "courant", "ms", "least", "residual")


class Cell:
    """One method on one system; ms is None where it could not solve it."""

    def __init__(self, line):
        words = dict(zip(FIELDS, line.split("\t")))
        for name in FIELDS:
            text = words.get(name, "").strip()
            value = text
            if name in WHOLE + REAL:
                value = None if text == "-" else (int if name in WHOLE else float)(text)
            setattr(self, name, value)


class Group:
    """All methods on one system to one tolerance."""

    def __init__(self, cells):
        self.cells = cells
        first = next((c for c in cells if c.order is not None), cells[0])
        self.system, self.order, self.courant = first.system, first.order, first.courant
        self.contacts, self.closed, self.tolerance = first.contacts, first.closed, first.tolerance

    def get(self, method, threads=1):
        for cell in self.cells:
            if cell.method == method and cell.threads == threads and cell.ms is not None:
                return cell
        return None

    def why_not(self, method):
        """Why there is no time, in a word or two: for a method that ran by itself."""
        notes = [c.note for c in self.cells if c.method == method and c.ms is None]
        note = notes[0] if notes else ""
        late = re.match(r"> (\d+) s", note)
        if late:
            return f"> {late.group(1)} s"
        if note.startswith("left out"):
            return "left out"
        return "memory" if "memory" in note else "-"

    def best(self, family, threads=1):
        """The fastest of a family on at most so many threads; auto is not one of ours here."""
        able = [c for c in self.cells if c.family == family and c.ms is not None and
                c.threads <= threads and c.method != "auto"]
        return min(able, key=lambda c: c.ms, default=None)


def lines(folder, name):
    path = os.path.join(folder, name + ".tsv")
    if not os.path.exists(path):
        return []
    with open(path, encoding="utf-8") as file:
        return [line.rstrip("\n") for line in file]


def completed(system, method, text, why):
    """What a program printed before its end, with a line for each tolerance that it did not reach."""
    printed = [line for line in text.splitlines(keepends=True) if line.endswith("\n")]
    if not why:
        return "".join(printed)
    cells = [Cell(line.rstrip("\n")) for line in printed]
    for tolerance in ("1e-06", "1e-10"):
        if not any(c.tolerance == tolerance and c.threads == 1 for c in cells):
            words = [system, "-", "-", "-", "-", "-", "-", tolerance, "1", method, "-", "-", "-", "-",
                     "-", why]
            printed.append("\t".join(words) + "\n")
    return "".join(printed)


def groups(folder, pattern):
    """Groups of all results files that match, small systems first."""
    found = {}
    for path in sorted(glob.glob(os.path.join(folder, pattern + ".tsv"))):
        for line in lines(folder, os.path.basename(path)[:-4]):
            cell = Cell(line)
            found.setdefault((cell.system, cell.tolerance), []).append(cell)
    made = [g for g in map(Group, found.values()) if g.order is not None]
    generated = re.compile("rock-")
    return sorted(made, key=lambda g: (generated.match(g.system) is None, g.order, g.courant,
                                       g.tolerance == "1e-10"))


def is_rock(group):
    return group.system.startswith("rock-")


def short(value):
    """Three digits, no exponent."""
    if value >= 100:
        return f"{value:.0f}"
    return f"{value:.3g}" if value >= 0.01 else f"{value:.4f}"
