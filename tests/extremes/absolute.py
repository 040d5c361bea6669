# SPDX-License-Identifier: MIT
"""What a random scene must answer whatever its blocks, joints, materials and settings are.

Copies of a scene that are all wrong alike are not told from each other; these two have an answer of
their own. falling: nothing holds and all moves alike; places go by v t + g t^2 / 2 and stress stays 0.
squeezed, the patch test: the border is held, and an initial pressure that is the same everywhere, in all
directions, goes across joints and borders of materials; nothing moves and stress stays what it was.
"""

import numpy

from scene import numbers_of

STEPS = 3  # of the scene's own length
VELOCITY, GRAVITY = (0.25, -0.5), (3.0, -8.0)
PRESSURE = 1e-3  # over the smallest modulus
FELL = 1e-6  # largest error of a displacement over the way of all
STRESS = 1e-9  # largest stress of what falls over the largest modulus
PATCH = 1e-6  # largest error of a stress over the pressure


def short(scene):
    time = scene.get("time", {"dt": 1e-3, "max_move": 0.05})
    return {"time": {**time, "end": STEPS * time["dt"]}}


def without(scene, *names):
    return {name: part for name, part in scene.items() if name not in names}


def falling(scene):
    analysis = {name: part for name, part in scene["analysis"].items() if name in ("scheme", "tolerance")}
    scene = {**without(scene, "supports", "loads", "initial_stress"), **short(scene),
             "gravity": list(GRAVITY), "analysis": analysis}
    if "blocks" in scene:
        scene["blocks"] = [{**b, "velocity": [*VELOCITY, 0]} for b in scene["blocks"]]
    return scene


def judge_fall(scene, result):
    """What is wrong with it, in words, or None."""
    t, v = result["time"], VELOCITY if "blocks" in scene else (0, 0)
    way = numpy.array([v[k] * t + 0.5 * GRAVITY[k] * t * t for k in (0, 1)])
    moved = numpy.array(numbers_of(result, "displacement")).reshape(-1, 2)
    error = numpy.abs(moved - way).max() / numpy.abs(way).max()
    stiffest = max(m["youngs_modulus"] for m in scene["materials"].values())
    stress = max(map(abs, numbers_of(result, "stress"))) / stiffest
    if error <= FELL and stress <= STRESS:
        return None
    return f"way wrong by {error:.1e}, stress {stress:.1e} of the modulus"


def squeezed(scene):
    pressure = PRESSURE * min(m["youngs_modulus"] for m in scene["materials"].values())
    corners = scene["domain"][0]["polygon"]
    sides = [{"segment": [a, b], "fix": "xy"} for a, b in zip(corners, corners[1:] + corners[:1])]
    return {**without(scene, "loads"), **short(scene), "gravity": [0, 0], "supports": sides,
            "initial_stress": {"kind": "uniform", "xx": -pressure, "yy": -pressure, "xy": 0}}


def judge_patch(scene, result):
    """All elements, by the run file, and the monitors, which see more digits."""
    stress = scene["initial_stress"]
    at_monitors = numpy.array(numbers_of(result, "stress")).reshape(-1, 3)
    there = numpy.concatenate([result.stress, at_monitors])
    error = numpy.abs(there - [stress["xx"], stress["yy"], 0]).max() / abs(stress["xx"])
    return None if error <= PATCH else f"stress wrong by {error:.1e} of the pressure"


def absolutes(scene):
    """Name, scene and judge of each."""
    yield "falling", falling(scene), judge_fall
    if "domain" in scene:
        yield "squeezed", squeezed(scene), judge_patch
