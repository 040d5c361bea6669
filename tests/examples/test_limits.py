# SPDX-License-Identifier: MIT
"""The programs behind the examples' closed forms print the numbers that the pages promise.

    python3 test_limits.py

Each program is run as a user runs it. It must end well, and each number is compared with the one
known here, to half a unit of its last place; the page that leans on it must say the same.
"""

import os
import re
import subprocess
import sys

HERE = os.path.dirname(os.path.abspath(__file__))
EXAMPLES = os.path.join(os.path.dirname(os.path.dirname(HERE)), "examples")

# Program, words before the number in what it prints, the number and half of its last place, the
# page, and how the page says it.
PROMISES = [
    ("paper_limits.py", "arch_abutments +thrust", 42340, 10, "paper/arch_abutments", "42.34 kN"),
    ("paper_limits.py", "arch_abutments .*friction", 18.04, 0.005, "paper/arch_abutments",
     "18.04 degrees"),
    ("paper_limits.py", "ring_voussoirs +force", 154900, 50, "paper/ring_voussoirs", "154.9 kN"),
    ("paper_limits.py", "slope_circular +friction", 23.67, 0.005, "paper/slope_circular",
     "23.67 degrees"),
    ("paper_limits.py", "push_block +work", 8908, 0.5, "paper/push_block", "8908 J"),
    ("paper_limits.py", "rings_halfplane +weight", 69800, 50, "paper/rings_halfplane", "69.8 kN"),
    ("paper_limits.py", "rings_halfplane .*thrust", 60400, 50, "paper/rings_halfplane", "60.4 kN"),
    ("limit.py", "free columns: collapse load", 40500, 50, "paper/arch_columns", "40.5 kN"),
    ("limit.py", "free columns: .*friction angle needed", 32.1, 0.05, "paper/arch_columns",
     "32.1 degrees"),
    ("limit.py", "held columns: collapse load", 342000, 500, "paper/arch_columns", "342 kN"),
    ("arch_limit.py", "collapse load", 207400, 50, "arch", "207.4 kN"),
    ("arch_limit.py", "friction angle needed", 28.8, 0.05, "arch", None),
]
PLACES = {"limit.py": os.path.join(EXAMPLES, "paper", "arch_columns")}


def printed_by(program):
    """What it prints; None where it ends badly."""
    path = os.path.join(PLACES.get(program, HERE), program)
    done = subprocess.run([sys.executable, path], capture_output=True, text=True, check=False)
    if done.returncode != 0:
        print(f"{program} ended with status {done.returncode}\n{done.stderr}", end="")
        return None
    return done.stdout


def number_after(text, words):
    """The one number behind these words at the start of a line; None where it is not one."""
    found = re.findall(rf"^{words} ([\d.e+-]+) ", text.replace("\n", " \n") + " ", re.M)
    return float(found[0]) if len(found) == 1 else None


def main():
    failed = 0

    def tell(what, good):
        nonlocal failed
        failed += not good
        print(f"{'ok    ' if good else 'FAILED'} {what}")

    printed = {program: printed_by(program) for program in dict.fromkeys(p[0] for p in PROMISES)}
    for program, text in printed.items():
        tell(f"{program} ends well", text is not None)
    for program, words, expected, half, page, said in PROMISES:
        value = number_after(printed[program] or "", words)
        tell(f"{program}: {words} {value}, expected {expected} ± {half}",
             value is not None and abs(value - expected) <= half)
        if said:
            with open(os.path.join(EXAMPLES, page, "README.md"), encoding="utf-8") as file:
                tell(f"examples/{page} says {said}", said in file.read())
    return failed


if __name__ == "__main__":
    sys.exit(main() > 0)
