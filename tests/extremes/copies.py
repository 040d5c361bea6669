# SPDX-License-Identifier: MIT
"""The same scene in other words: mirrored, turned, shifted, scaled, listed in another order; nearly
the same; and how its numbers are taken back to those of the first one.
"""

import random

from scene import text_of

SHIFT = (524288.0, 4194304.0)  # about 5e5 and 4.2e6 m, exact in binary
ASKEW = (0.6, 0.8)  # cosine and sine of some angle


def mapped(scene, place, vector, tensor=None, turn=1):
    """All places and vectors changed."""
    scene = dict(scene)

    def all_places(points):
        return [place(p) for p in points]
    scene["gravity"] = vector(scene["gravity"])
    for name, key in (("domain", "polygon"), ("regions", "polygon"), ("blocks", "polygon"),
                      ("joints", "polyline")):
        if name in scene:
            scene[name] = [{**entry, key: all_places(entry[key])} for entry in scene[name]]
    if "blocks" in scene:
        scene["blocks"] = [{**b, "velocity": [*vector(b["velocity"][:2]), turn * b["velocity"][2]]}
                           for b in scene["blocks"]]
    scene["supports"] = [{**s, "box": all_places(s["box"])} if "box" in s else s for s in scene["supports"]]
    scene["loads"] = [{**load, "point": place(load["point"]), "force": vector(load["force"])}
                      for load in scene.get("loads", [])]
    if not scene["loads"]:
        del scene["loads"]
    scene["monitors"] = [{**m, "point": place(m["point"])} for m in scene["monitors"]]
    if "initial_stress" in scene and tensor:
        s = scene["initial_stress"]
        xx, yy, xy = tensor([s["xx"], s["yy"], s["xy"]])
        scene["initial_stress"] = {"kind": "uniform", "xx": xx, "yy": yy, "xy": xy + 0.0}
    return scene


def same(v):
    return list(v)


def shifted(scene):
    return mapped(scene, lambda p: [p[0] + SHIFT[0], p[1] + SHIFT[1]], same)


def vector_turned(v, c, s):
    return [c * v[0] - s * v[1], s * v[0] + c * v[1]]


def tensor_turned(t, c, s):
    xx, yy, xy = t
    return [c * c * xx + s * s * yy - 2 * s * c * xy, s * s * xx + c * c * yy + 2 * s * c * xy,
            s * c * (xx - yy) + (c * c - s * s) * xy]


def turned_by(scene, c, s):
    """By the angle of this cosine and sine."""
    return mapped(scene, lambda p: vector_turned(p, c, s), lambda v: vector_turned(v, c, s),
                  lambda t: tensor_turned(t, c, s))


def turned(scene):
    swap = {"x": "y", "y": "x", "xy": "xy"}
    scene = turned_by(scene, 0, 1)
    scene["supports"] = [{**s, "fix": swap[s["fix"]]} for s in scene["supports"]]
    return scene


def askew(scene):
    """Only where whole blocks are held in both directions, and no default goes by the scene's box."""
    return turned_by(scene, *ASKEW)


def turned_round(scene):
    return mapped(scene, lambda p: [-p[0], -p[1]], lambda v: [-v[0], -v[1]], lambda s: s)


def mirrored(scene):
    return mapped(scene, lambda p: [-p[0], p[1]], lambda v: [-v[0], v[1]],
                  lambda s: [s[0], s[1], -s[2]], turn=-1)


def upside_down(scene):
    return mapped(scene, lambda p: [p[0], -p[1]], lambda v: [v[0], -v[1]],
                  lambda s: [s[0], s[1], -s[2]], turn=-1)


def scaled(scene, s):
    """Lengths and times by s: stresses and velocities stay, forces of a slice grow by s."""
    scene = mapped(scene, lambda p: [s * p[0], s * p[1]], same)
    scene["gravity"] = [g / s for g in scene["gravity"]]
    if "loads" in scene:
        scene["loads"] = [{**load, "force": [s * f for f in load["force"]]} for load in scene["loads"]]
    if "blocks" in scene:
        scene["blocks"] = [{**b, "velocity": [*b["velocity"][:2], b["velocity"][2] / s]}
                           for b in scene["blocks"]]
    if "time" in scene:
        scene["time"] = {**scene["time"], "dt": s * scene["time"]["dt"], "end": s * scene["time"]["end"]}
    if "damping" in scene["analysis"]:
        scene["analysis"] = {**scene["analysis"], "damping": scene["analysis"]["damping"] / s}
    if "size" in scene["covers"]:
        scene["covers"] = {**scene["covers"], "size": s * scene["covers"]["size"]}
    return scene


# Of places, to see whether something is decided at a rounding: less than any answer may need, more
# than the rounding of the copies. Both ways: what stands on an edge may fall to either side.
NUDGES = (1e-11, 1e-9, -1e-11, -1e-9, 1e-12, -1e-12, 1e-10, -1e-10)


def nudged(scene, part):
    """Not quite the same scene: lengths, angles and areas differ a little, what touches still does."""
    return mapped(scene, lambda p: [p[0] + part * (0.4 * p[0] - 0.7 * p[1]),
                                    p[1] + part * (0.6 * p[0] + 0.3 * p[1])], same)


def in_other_passes(scene):
    """Solves that are as good, which lead the passes of a step another way."""
    other = "pcg" if scene["solver"].get("method") == "direct" else "direct"
    return {**scene, "solver": {**scene["solver"], "method": other}}


def in_shorter_steps(scene):
    """Steps of a third: of the time, or of the way that a search for equilibrium may go in one."""
    if "time" not in scene:
        return {**scene, "time": {"max_move": 0.01 / 3}}
    return {**scene, "time": {**scene["time"], "dt": scene["time"]["dt"] / 3}}


def renumbered(scene):
    """Everything listed in another order: blocks, joints, materials, monitors, corners of polygons,
    these also the other way round."""
    dice = random.Random(len(text_of(scene)))

    def corners(points):
        k = dice.randrange(len(points))
        points = points[k:] + points[:k]
        return points[::-1] if dice.random() < 0.5 else points
    scene = dict(scene)
    for name in ("domain", "regions", "blocks"):
        if name in scene:
            scene[name] = [{**entry, "polygon": corners(entry["polygon"])} for entry in scene[name]]
    for name in ("blocks", "joints", "monitors"):
        if name in scene:
            scene[name] = dice.sample(scene[name], len(scene[name]))
    if "joints" in scene:
        scene["joints"] = [{**joint, "polyline": joint["polyline"][::dice.choice([1, -1])]}
                           for joint in scene["joints"]]
    for name in ("materials", "interfaces"):
        if len(scene[name]) > 1 or name == "materials":
            scene[name] = dict(dice.sample(list(scene[name].items()), len(scene[name])))
    return scene


def size_of(name):
    """Factor of the lengths of a copy."""
    return float(name.split(",")[0].split()[1]) if name.startswith("scaled") else 1.0


def back(kind, values, name):
    """Numbers of the changed scene as they would be in the first."""
    if name == "turned round":
        rule = (lambda s: s) if kind == "stress" else (lambda v: [-v[0], -v[1]])
    elif name in ("turned", "askew"):
        c, s = ASKEW if name == "askew" else (0, 1)
        rule = lambda v: tensor_turned(v, c, -s) if kind == "stress" else vector_turned(v, c, -s)
    elif name == "mirrored":
        rule = (lambda s: [s[0], s[1], -s[2]]) if kind == "stress" else (lambda v: [-v[0], v[1]])
    elif name == "upside down":
        rule = (lambda s: [s[0], s[1], -s[2]]) if kind == "stress" else (lambda v: [v[0], -v[1]])
    elif name.startswith("scaled") and kind == "displacement":
        rule = lambda v: [x / size_of(name) for x in v]
    else:
        return values
    n = 3 if kind == "stress" else 2
    return [x for k in range(0, len(values), n) for x in rule(values[k:k + n])]


def variants(scene):
    """Name and scene of each way to say it. A lattice has directions of its own: half a turn and
    mirrors keep it, wherever it begins one of them at least."""
    yield "renumbered", renumbered(scene)
    yield "mirrored", mirrored(scene)
    if "mesh" in scene["covers"]:
        yield "turned", turned(scene)
        if "blocks" in scene and "time" in scene:
            yield "askew", askew(scene)
    else:
        yield "upside down", upside_down(scene)
        yield "turned round", turned_round(scene)
    yield "shifted", shifted(scene)
    yield "scaled 1024", scaled(scene, 1024.0)
    yield "scaled 1000", scaled(scene, 1000.0)
