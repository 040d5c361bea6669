# SPDX-License-Identifier: MIT
"""Collapse load of the arch on two columns by limit analysis, independent of nmm.

Static theorem (Heyman): rigid stones, joints without tension, no sliding. Arch, columns and load are
the same on both sides, so half of them is looked at, cut through the crown. There act half the load,
a thrust H, and a moment M about the middle of the arch. The load P that can just be borne is the
largest for which the resultant passes between the two ends of every joint, down to the foot of the
column. Each joint gives two inequalities in (H, M, P); at the best corner three of them are
equalities: the hinges of one half of the mechanism.

    python3 limit.py            prints loads, hinges and the friction that is needed
    python3 limit.py --scene    prints corners and joints for the scene file
"""

import itertools
import math
import sys

INNER, OUTER, VOUSSOIRS, BASE = 1.75, 2.25, 11, 3.0  # arch, and level of its springing
COLUMN = (1.65, 2.75)  # inner and outer face of a column
UNIT_WEIGHT = 2400 * 9.81  # N/m3


def corners(k):
    """Intrados and extrados end of joint k, counted from the right springing."""
    turn = math.pi * k / VOUSSOIRS
    return [(r * math.cos(turn), BASE + r * math.sin(turn)) for r in (INNER, OUTER)]


def area_and_centre(polygon):
    twice, x = 0, 0
    for (x0, y0), (x1, y1) in zip(polygon, polygon[1:] + polygon[:1]):
        cross = x0 * y1 - x1 * y0
        twice, x = twice + cross, x + (x0 + x1) * cross
    return twice / 2, x / (3 * twice)


def joints(columns):
    """Joints of the right half from the crown down: (name, ends, weights above with their x)."""
    half = VOUSSOIRS // 2
    low, high = corners(half)
    above = [area_and_centre([low, high, (0, high[1]), (0, low[1])])]  # half of the key stone
    found = []
    for k in range(half, -1, -1):
        found.append((f"joint {k}", corners(k), list(above)))
        if k > 0:
            (in0, out0), (in1, out1) = corners(k - 1), corners(k)
            above.append(area_and_centre([in0, out0, out1, in1]))
    if not columns:
        return found
    above.append(((COLUMN[1] - COLUMN[0]) * BASE, sum(COLUMN) / 2))
    found.append(("foot", [(COLUMN[0], 0), (COLUMN[1], 0)], above))
    return found


def inequalities(columns):
    """Rows (name, a, b): a . (H, M, P) <= b."""
    crown = BASE + (INNER + OUTER) / 2
    rows = []
    for name, ends, above in joints(columns):
        for sign, where, (x, y) in ((-1, "inner", ends[0]), (1, "outer", ends[1])):
            # Clockwise moment about (x, y) of all that acts above: H to the right at the crown, half
            # of the load and the weights down. Turning about the inner end it must close the joint,
            # that is turn clockwise; about the outer end, counter-clockwise.
            row = [crown - y, 1.0, -x / 2]
            weights = sum(a * UNIT_WEIGHT * (cx - x) for a, cx in above)
            rows.append((f"{name} {where}", [sign * r for r in row], -sign * weights))
    return rows


def solve(a, b):
    """Three equations by Cramer's rule; None when singular."""
    def det(m):
        return (m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1])
                - m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0])
                + m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0]))
    whole = det(a)
    if abs(whole) < 1e-9:
        return None
    return [det([row[:i] + [c] + row[i + 1:] for row, c in zip(a, b)]) / whole for i in range(3)]


def collapse(columns):
    """Largest P, its three hinges and (H, M, P), on free columns or on columns that are held."""
    rows = inequalities(columns)
    best = None
    for pick in itertools.combinations(rows, 3):
        x = solve([row for _, row, _ in pick], [b for _, _, b in pick])
        if x is None or (best is not None and x[2] <= best[0]):
            continue
        if all(sum(c * v for c, v in zip(a, x)) <= b + 1e-4 for _, a, b in rows):
            best = (x[2], [name for name, _, _ in pick], x)
    return best


def friction_needed(x, columns):
    """Largest angle between resultant and normal of a joint [degrees]."""
    worst = 0
    for _, ((x0, y0), (x1, y1)), above in joints(columns):
        down = x[2] / 2 + sum(a * UNIT_WEIGHT for a, _ in above)
        along = math.atan2(y1 - y0, x1 - x0)
        normal = x[0] * math.sin(along) + down * math.cos(along)
        shear = x[0] * math.cos(along) - down * math.sin(along)
        worst = max(worst, abs(math.degrees(math.atan2(shear, normal))))
    return worst


def print_scene():
    ring = [corners(k) for k in range(VOUSSOIRS + 1)]
    for x, y in [out for _, out in ring] + [low for low, _ in reversed(ring)]:
        print(f"[{x:.6f}, {y:.6f}],")
    for k in range(1, VOUSSOIRS):
        c, s = math.cos(math.pi * k / VOUSSOIRS), math.sin(math.pi * k / VOUSSOIRS)
        print(f"  - {{polyline: [[{1.6 * c:.6f}, {3 + 1.6 * s:.6f}], "
              f"[{2.4 * c:.6f}, {3 + 2.4 * s:.6f}]]}}")


if __name__ == "__main__":
    if "--scene" in sys.argv:
        print_scene()
    else:
        for on in (True, False):
            P, hinges, unknowns = collapse(on)
            print(f"{'free' if on else 'held'} columns: collapse load {P:.1f} N, hinges {hinges}, "
                  f"friction angle needed {friction_needed(unknowns, on):.1f} degrees")
