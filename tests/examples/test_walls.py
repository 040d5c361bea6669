#!/usr/bin/python3
# SPDX-License-Identifier: MIT
"""Brick walls with one cover for each block, of 64 x 64 and of 200 x 200 bricks: they run, six unknowns
a block, and move as gravity moves them.

Gravity sets in at once, so all that the wave from the base has not reached falls freely: the work of
gravity is m g (g t^2 / 2) but for the part below that wave, c t high with c = sqrt(E / density).

Usage: test_walls.py PROGRAM
"""

import math
import os
import sys
import tempfile

import performance
from test_examples import always

G, DENSITY, E = 9.81, 2500, 1e9


def check(program, side, steps):
    """What went wrong, as a list."""
    with tempfile.TemporaryDirectory() as folder:
        scene = os.path.join(folder, "wall.yaml")
        with open(scene, "w", encoding="utf-8") as file:
            file.write(performance.wall_scene(side, steps, "{mesh: block}"))
        result = performance.run(os.path.abspath(program), scene, 2)
    time = result["time"]
    free = DENSITY * side * 0.5 * side * G * G * time**2 / 2
    reached = math.sqrt(E / DENSITY) * time / (0.5 * side)
    work = result["energy"]["external"] / free
    # A course of 64 has half a brick at both ends in every other course.
    blocks = side * side + side // 2 + 1
    found = [what for what, good in always(result) if not good]
    for name, value, good in (
            ("steps", result["steps"], result["steps"] == steps),
            ("blocks", result["blocks"], result["blocks"] == blocks),
            ("unknowns", result["unknowns"], result["unknowns"] == 6 * blocks),
            ("work over that of free fall", work, 1 - 1.2 * reached < work < 1),
            ("penetration", result["max_penetration"], result["max_penetration"] < 1e-4)):
        print(f"{'ok    ' if good else 'FAILED'} {side} x {side}: {name} {value:.6g}")
        if not good:
            found.append(name)
    return found


if __name__ == "__main__":
    sys.exit(bool(check(sys.argv[1], 64, 10) + check(sys.argv[1], 200, 2)))
