#!/usr/bin/python3
# SPDX-License-Identifier: MIT
"""Writes docs/fields.md from the tables src/model/*_fields.inl.

Usage: docs/fields.py [--print]      (--print: to standard output instead)
"""

import os
import re
import sys

HERE = os.path.dirname(os.path.abspath(__file__))
MODEL = os.path.join(HERE, "..", "src", "model")
TABLES = [
    ("model_fields.inl", "The model", "Constant during a run, shared by threads."),
    ("state_fields.inl", "The state", "Changes from step to step; this is what resume must keep."),
]
ROW = re.compile(r'^FIELD\((\w+),\s*(\w+),\s*([^,]+?),\s*([\w *]+?),\s*"([^"]*)",\s*"(.*)"\)\s*$')
HEAD = """# Fields

Every array of a model and of a state, one row each.
This page is written by `docs/fields.py` from the tables in `src/model`; do not edit it by hand.
The same tables drive allocation, release, the finiteness check and output.
Coordinates are relative to the model's origin; stress is positive in tension; [n][w] means n rows of w numbers.
"""


def rows(name):
    with open(os.path.join(MODEL, name), encoding="utf-8") as file:
        for line in file:
            if not line.startswith("FIELD("):
                continue
            found = ROW.match(line)
            if not found:
                raise SystemExit(f"{name}: cannot read: {line.strip()}")
            yield found.groups()


def page():
    lines = [HEAD]
    for name, title, meaning in TABLES:
        lines += [f"## {title}", "", meaning, "", "| array | shape | type | unit | meaning |",
                  "|---|---|---|---|---|"]
        for kind, field, count, width, unit, text in rows(name):
            shape = f"[{count}]" + (f"[{width}]" if width != "1" else "")
            lines.append(f"| `{field}` | {shape} | {kind} | {unit or '-'} | {text} |")
        lines.append("")
    return "\n".join(lines)


def main():
    if "--print" in sys.argv[1:]:
        sys.stdout.write(page())
        return
    with open(os.path.join(HERE, "fields.md"), "w", encoding="utf-8") as file:
        file.write(page())


if __name__ == "__main__":
    main()
