# SPDX-License-Identifier: MIT
"""Pages of docs/ that programs write: tables in Markdown, parts of a page between the lines
`<!-- bench: NAME -->` and `<!-- end -->`, the machine that measured."""

import argparse
import os
import platform
import re
import subprocess
import time

HERE = os.path.dirname(os.path.abspath(__file__))
ROOT = os.path.dirname(os.path.dirname(HERE))


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


def percent(value):
    return f"{float(value):.0f} %"


def minutes(seconds):
    return f"{seconds / 60:.1f} min" if seconds >= 60 else f"{seconds:.0f} s"


def table(head, rows):
    """Words to the left, numbers to the right: a column whose name begins with a star has words."""
    lines = ["| " + " | ".join(h.lstrip("*") for h in head) + " |",
             "|" + "|".join("---" if h.startswith("*") else "--:" for h in head) + "|"]
    lines += ["| " + " | ".join(row) + " |" for row in rows]
    return "\n".join(lines)


def machine(program):
    """Processor, number of cores, system, and the version of the program."""
    model = platform.machine()
    try:
        with open("/proc/cpuinfo", encoding="utf-8") as file:
            found = re.search(r"model name\s*: (.*)", file.read())
            model = found[1] if found else model
    except OSError:
        pass
    version = subprocess.run([program, "--version"], capture_output=True, text=True, check=True)
    return f"{model}, {os.cpu_count()} cores, {platform.system()}; {version.stdout.strip()}."


def replace_part(text, name, body):
    pattern = re.compile(rf"(<!-- bench: {re.escape(name)} -->\n).*?(<!-- end -->)", re.S)
    if not pattern.search(text):
        raise SystemExit(f"the page has no part {name}")
    return pattern.sub(lambda m: m[1] + body + "\n" + m[2], text)


def write_part(page, name, body):
    with open(page, encoding="utf-8") as file:
        text = replace_part(file.read(), name, body)
    with open(page, "w", encoding="utf-8") as file:
        file.write(text)


def read_choices(title, parts, quick):
    """What the command line of a program asks for that makes a page in a folder; the folder's
    pictures have a place then."""
    parser = argparse.ArgumentParser(description=title)
    parser.add_argument("nmm", type=os.path.abspath, help="the program")
    parser.add_argument("--only", action="append", choices=parts, help="only this part")
    parser.add_argument("--quick", action="store_true", help=f"a try: {quick}")
    parser.add_argument("--docs", default=os.path.join(ROOT, "docs"), help="folder of the page")
    given = parser.parse_args()
    os.makedirs(os.path.join(given.docs, "pictures"), exist_ok=True)
    return given


def make_parts(parts, make):
    """make(part) for each; says how long each and all took. Returns seconds by part."""
    took = {}
    for part in parts:
        print(f"{part} ...", end=" ", flush=True)
        start = time.monotonic()
        make(part)
        took[part] = time.monotonic() - start
        print(minutes(took[part]), flush=True)
    print(f"all: {minutes(sum(took.values()))}")
    return took


def tell_machine(page, program, took):
    """The part `machine` of a page that was made anew as a whole."""
    parts = ", ".join(f"{part} {minutes(seconds)}" for part, seconds in took.items())
    write_part(page, "machine", f"{machine(program)}\nMeasured in {minutes(sum(took.values()))}: "
                                f"{parts}.")
