#!/usr/bin/python3
# SPDX-License-Identifier: MIT
"""Writes the tables of docs/verification.md from the output of the verification tests.

Usage: table.py DOCUMENT OUTPUT...

Each OUTPUT is what one test program printed; its name without ending is the section that it fills:
the rows between `<!-- begin NAME -->` and `<!-- end NAME -->` of the document.
"""

import os
import re
import sys

HEAD = "| case | expected | measured | error | tolerance | |\n|---|---|---|---|---|---|\n"


def rows_of(path):
    with open(path, encoding="utf-8") as file:
        return [line for line in file if line.startswith("| ")]


def fill(document, name, rows):
    pattern = re.compile(rf"(<!-- begin {name} -->\n).*?(<!-- end {name} -->)", re.DOTALL)
    if not pattern.search(document):
        sys.exit(f"table.py: no section '{name}' in the document")
    return pattern.sub(lambda found: found[1] + HEAD + "".join(rows) + found[2], document)


def main():
    path, outputs = sys.argv[1], sys.argv[2:]
    with open(path, encoding="utf-8") as file:
        document = file.read()
    failed = 0
    for output in outputs:
        rows = rows_of(output)
        failed += sum("**fails**" in row for row in rows)
        document = fill(document, os.path.splitext(os.path.basename(output))[0], rows)
    with open(path, "w", encoding="utf-8") as file:
        file.write(document)
    print(f"{failed} rows fail")


if __name__ == "__main__":
    main()
