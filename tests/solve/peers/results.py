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
        first = cells[0]
        self.system, self.order, self.courant = first.system, first.order, first.courant
        self.contacts, self.closed, self.tolerance = first.contacts, first.closed, first.tolerance

    def get(self, method, threads=1):
        for cell in self.cells:
            if cell.method == method and cell.threads == threads and cell.ms is not None:
                return cell
        return None

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


def groups(folder, pattern):
    """Groups of all results files that match, small systems first."""
    found = {}
    for path in sorted(glob.glob(os.path.join(folder, pattern + ".tsv"))):
        for line in lines(folder, os.path.basename(path)[:-4]):
            cell = Cell(line)
            found.setdefault((cell.system, cell.tolerance), []).append(cell)
    made = [Group(cells) for cells in found.values()]
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
