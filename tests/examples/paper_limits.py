# SPDX-License-Identifier: MIT
"""Numbers that scenes of examples/paper are measured by, independent of nmm.

    arch_abutments   least thrust of the arch (three hinges), friction that its abutments need
    ring_voussoirs   largest pair of forces for which a line of thrust stays inside all joints
    slope_circular   friction that the slip line needs by the simplified method of Bishop
    push_block       work of the push on a rigid block that turns about its foot
    rings_halfplane  weight of the wedge over the tunnel, and the thrust that holds it

    python3 paper_limits.py          prints them, one a line
"""

import math

GRAVITY = 9.81


def area_and_x(polygon):
    """Area and x of the centroid."""
    twice, moment = 0, 0
    for (x0, y0), (x1, y1) in zip(polygon, polygon[1:] + polygon[:1]):
        cross = x0 * y1 - x1 * y0
        twice, moment = twice + cross, moment + (x0 + x1) * cross
    return abs(twice / 2), moment / (3 * twice)


def halve(holds, low, high):
    """The number between low, which holds, and high, which does not, where that changes."""
    for _ in range(80):
        middle = (low + high) / 2
        low, high = (middle, high) if holds(middle) else (low, middle)
    return low


def arch_abutments(inner=4.0, outer=4.8, stones=11, half=math.radians(60), density=2400):
    """Thrust, and the friction angle of the abutment's upper joint that bears it."""
    step = 2 * half / stones
    inside, outside = ([(radius * math.sin(a), radius * math.cos(a))
                        for a in [0.5 * step + k * step for k in range(stones // 2 + 1)]]
                       for radius in (inner, outer))
    top, low = outside[0][1], inside[0][1]
    parts = [area_and_x([(0, low), inside[0], outside[0], (0, top)])]
    thrust = 0
    for k, (x, y) in enumerate(inside):
        moment = sum(area * (x - centre) for area, centre in parts) * density * GRAVITY
        thrust = max(thrust, moment / (top - y))
        if k + 1 < len(inside):
            parts.append(area_and_x([inside[k], inside[k + 1], outside[k + 1], outside[k]]))
    block = area_and_x([(inside[-1][0], 1.6), (5.6, 1.6), (5.6, 2.6), (outside[-1][0], 2.6),
                        outside[-1], inside[-1]])[0]
    weight = (sum(area for area, _ in parts) + block) * density * GRAVITY
    return thrust, math.degrees(math.atan(thrust / weight))


def ring_voussoirs(inner=3.0, outer=3.5, stones=16, pressure=100e3):
    """Largest force on each of two opposite stones; a quarter of the ring, its thrust known."""
    half = math.pi / stones
    angles = [math.pi / 2 - half - 2 * half * k for k in range(stones // 4)]
    radius = outer * math.cos(half)
    thrust = pressure * radius
    face = [(0, radius)] + [(outer * math.cos(a), outer * math.sin(a)) for a in angles]

    def height(corner, k, force):
        """Height of the thrust at the crown with which it passes through a corner of joint k."""
        moment = corner[1] * thrust + corner[0] * force / 2
        for (x0, y0), (x1, y1) in zip(face[:k + 1], face[1:]):
            moment += pressure * (((x0 + x1) / 2 - corner[0]) * (x0 - x1)
                                  + ((y0 + y1) / 2 - corner[1]) * (y0 - y1))
        return moment / thrust

    def holds(force):
        bounds = [[height((r * math.cos(a), r * math.sin(a)), k, force)
                   for k, a in enumerate(angles)] for r in (inner, outer)]
        return max(bounds[0]) <= min(bounds[1])

    return halve(holds, 0, 1e6)


def slope_circular(centre=(16.0, 22.0), radius=16.0, bench=8.0, top=20.0, pieces=40, slices=10):
    """Friction angle at which ten dry slices without friction between them are at their limit."""
    first = math.atan2(bench - centre[1], -math.sqrt(radius**2 - (bench - centre[1])**2))
    last = math.atan2(top - centre[1], math.sqrt(radius**2 - (top - centre[1])**2))
    line = [(centre[0] + radius * math.cos(a), centre[1] + radius * math.sin(a))
            for a in (first + (last - first) * k / slices for k in range(slices + 1))]
    assert pieces % slices == 0

    def ground(x):
        return min(max(x - 14 + bench, bench), top)

    weight, slope = [], []
    for (x0, y0), (x1, y1) in zip(line, line[1:]):
        cuts = [x0] + [x for x in (14.0, 26.0) if x0 < x < x1] + [x1]
        weight.append(sum((ground(a) + ground(b) - 2 * y0
                           - (y1 - y0) * (a + b - 2 * x0) / (x1 - x0)) / 2 * (b - a)
                          for a, b in zip(cuts, cuts[1:])))
        slope.append(math.atan2(y1 - y0, x1 - x0))

    def slides(friction):
        t = math.tan(math.radians(friction))
        bears = sum(w * t / (math.cos(a) + math.sin(a) * t) for w, a in zip(weight, slope))
        return bears < sum(w * math.sin(a) for w, a in zip(weight, slope))

    return halve(slides, 1, 60)


def push_block(push=17167.5, at=1.8, mass=5000.0, dt=2e-5):
    """Work of the push: grows over 0.1 s, constant until 0.8 s, gone at 0.81 s."""
    turn = speed = work = 0.0
    inertia = mass * (1**2 + 2**2) / 3
    before = 0.0
    for step in range(int(0.81 / dt)):
        time = step * dt
        force = push * min(time / 0.1, 1, max((0.81 - time) / 0.01, 0))
        cos, sin = math.cos(turn), math.sin(turn)
        lever, arm = at * cos + sin, 0.5 * cos - sin
        speed += (force * lever - mass * GRAVITY * arm) / inertia * dt
        if turn <= 0 and speed < 0:
            speed = 0
        turn += speed * dt
        place = at * math.sin(turn) - math.cos(turn)
        if step > 0:
            work += force * (place - before)
        before = place
    return work


def rings_halfplane(radius=3.0, top=5.4, low=(1.000258, 2.6), lean=math.radians(15), friction=45,
                    density=2500):
    """Weight of the wedge between the faults, from the tunnel of 36 sides to the surface, and the
    level thrust that holds it."""
    def fault(y):
        return low[0] - (y - low[1]) * math.tan(lean)

    a, b = ((radius * math.sin(k * math.pi / 18), radius * math.cos(k * math.pi / 18))
            for k in (1, 2))
    # Where the fault meets the side from a to b.
    part = halve(lambda s: a[0] + s * (b[0] - a[0]) < fault(a[1] + s * (b[1] - a[1])), 0, 1)
    foot = (a[0] + part * (b[0] - a[0]), a[1] + part * (b[1] - a[1]))
    half = area_and_x([(0, radius), a, foot, (fault(top), top), (0, top)])[0]
    weight = 2 * half * density * GRAVITY
    return weight, weight / (2 * math.tan(math.radians(friction) - lean))


if __name__ == "__main__":
    print("arch_abutments  thrust %.0f N, friction %.2f degrees" % arch_abutments())
    print("ring_voussoirs  force %.0f N" % ring_voussoirs())
    print("slope_circular  friction %.2f degrees" % slope_circular())
    print("push_block      work %.0f J" % push_block())
    print("rings_halfplane weight %.0f N, thrust %.0f N" % rings_halfplane())
