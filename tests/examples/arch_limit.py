# SPDX-License-Identifier: MIT
"""Collapse load of the arch of examples/arch by limit analysis, independent of nmm.

Static theorem (Heyman): rigid voussoirs, joints without tension, no sliding. The load that the arch
can just bear is the largest P for which a thrust line stays inside every joint. Unknown are the
reaction (X, Y), its moment about the right springing, and P; each joint gives two inequalities: the
resultant passes above the intrados and below the extrados. At the best corner of this polytope four
of them are equalities: the four hinges of the mechanism.

    python3 arch_limit.py            prints the load, the hinges and the friction that is needed
    python3 arch_limit.py --scene    prints corners and joints for the scene file
"""

import itertools
import math
import sys

INNER, OUTER, VOUSSOIRS, LOADED = 4.5, 5.5, 17, 11  # loaded voussoir counted from the right, from 0
UNIT_WEIGHT = 2400 * 9.81  # N/m3


def corners():
    """Intrados and extrados corner of each joint, from the right springing to the left one."""
    turn = [math.pi * k / VOUSSOIRS for k in range(VOUSSOIRS + 1)]
    return [((INNER * math.cos(a), INNER * math.sin(a)), (OUTER * math.cos(a), OUTER * math.sin(a)))
            for a in turn]


def area_and_centre(polygon):
    twice, x, y = 0, 0, 0
    for (x0, y0), (x1, y1) in zip(polygon, polygon[1:] + polygon[:1]):
        cross = x0 * y1 - x1 * y0
        twice, x, y = twice + cross, x + (x0 + x1) * cross, y + (y0 + y1) * cross
    return twice / 2, (x / (3 * twice), y / (3 * twice))


def voussoirs(joint):
    """Weight and centre of each stone; None: the loaded one's line of action."""
    stones = []
    for (in0, out0), (in1, out1) in zip(joint, joint[1:]):
        area, centre = area_and_centre([in0, out0, out1, in1])
        stones.append((area * UNIT_WEIGHT, centre[0]))
    middle = math.pi * (LOADED + 0.5) / VOUSSOIRS
    return stones, 5.4 * math.cos(middle)


def inequalities(joint):
    """Rows (a, b) of a . (X, Y, M, P) <= b: moments about the ends of each joint have their sign."""
    stones, load = voussoirs(joint)
    mid = ((INNER + OUTER) / 2, 0.0)
    rows = []
    for j, ends in enumerate(joint):
        before = stones[:j]
        for sign, (x, y) in ((-1, ends[0]), (1, ends[1])):
            # Moment (counter-clockwise) about (x, y) of all that acts on the stones before j.
            row = [-(mid[1] - y), mid[0] - x, 1.0, -(load - x) if j > LOADED else 0.0]
            constant = sum(-w * (cx - x) for w, cx in before)
            # What acts on the right part turns it counter-clockwise about the intrados, clockwise
            # about the extrados: the thrust of the left part, between the two, balances both.
            rows.append(([sign * r for r in row], -sign * constant))
    return rows


def solve(matrix, right):
    """Gauss with pivoting; None when singular."""
    n = len(right)
    a = [list(row) + [b] for row, b in zip(matrix, right)]
    for k in range(n):
        pivot = max(range(k, n), key=lambda i: abs(a[i][k]))
        if abs(a[pivot][k]) < 1e-9:
            return None
        a[k], a[pivot] = a[pivot], a[k]
        for i in range(k + 1, n):
            factor = a[i][k] / a[k][k]
            for j in range(k, n + 1):
                a[i][j] -= factor * a[k][j]
    x = [0.0] * n
    for k in reversed(range(n)):
        x[k] = (a[k][n] - sum(a[k][j] * x[j] for j in range(k + 1, n))) / a[k][k]
    return x


def collapse():
    """Largest P, the four hinges (joint, side) and the unknowns there."""
    rows = inequalities(corners())
    scale = UNIT_WEIGHT * OUTER
    best = None
    for pick in itertools.combinations(range(len(rows)), 4):
        x = solve([rows[k][0] for k in pick], [rows[k][1] for k in pick])
        if x is None or (best is not None and x[3] <= best[0]):
            continue
        if all(sum(c * v for c, v in zip(a, x)) <= b + 1e-7 * scale for a, b in rows):
            best = (x[3], [(k // 2, "outer" if k % 2 else "inner") for k in pick], x)
    return best


def friction_needed(x):
    """Largest ratio of shear to thrust over the joints [degrees]."""
    joint = corners()
    stones, _ = voussoirs(joint)
    worst = 0
    for j in range(len(joint)):
        angle = math.pi * j / VOUSSOIRS
        force = (x[0], x[1] - sum(w for w, _ in stones[:j]) - (x[3] if j > LOADED else 0))
        normal = -force[0] * math.sin(angle) + force[1] * math.cos(angle)
        shear = force[0] * math.cos(angle) + force[1] * math.sin(angle)
        worst = max(worst, abs(shear / normal))
    return math.degrees(math.atan(worst))


def print_scene():
    joint = corners()
    ring = [p for _, p in joint] + [p for p, _ in reversed(joint)]
    for x, y in ring:
        print(f"[{x:.6f}, {y:.6f}],")
    for j in range(1, VOUSSOIRS):
        a = math.pi * j / VOUSSOIRS
        print(f"  - {{polyline: [[{4 * math.cos(a):.6f}, {4 * math.sin(a):.6f}], "
              f"[{6 * math.cos(a):.6f}, {6 * math.sin(a):.6f}]]}}")
    a = math.pi * (LOADED + 0.5) / VOUSSOIRS
    print(5.4 * math.cos(a), 5.4 * math.sin(a))


if __name__ == "__main__":
    if "--scene" in sys.argv:
        print_scene()
    else:
        P, hinges, unknowns = collapse()
        print(f"collapse load {P:.1f} N, hinges {hinges}")
        print(f"friction angle needed {friction_needed(unknowns):.1f} degrees")
