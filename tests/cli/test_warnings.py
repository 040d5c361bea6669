#!/usr/bin/python3
# SPDX-License-Identifier: MIT
"""What is allowed but hardly meant is told, with its place; wrong words get a hint that helps.

    test_warnings.py PROGRAM
"""

import json
import os
import re
import subprocess
import sys
import tempfile
import unittest

PROGRAM = None

HEAD = """nmm: 1
materials:
  rock: {density: 2500, youngs_modulus: 5e9, poissons_ratio: 0.25}
  clay: {density: 1900, youngs_modulus: 5e7, poissons_ratio: 0.3}
time: {dt: 1e-3, end: 3e-3}
"""
SQUARE = "domain:\n  - {polygon: [[0, 0], [1, 0], [1, 1], [0, 1]], material: rock}\n"
OVERLAP = """blocks:
  - {name: low, polygon: [[0, 0], [1, 0], [1, 1], [0, 1]], material: rock}
  - {name: high, polygon: [[0, 0.999], [1, 0.999], [1, 2], [0, 2]], material: rock}
supports:
  - {block: low, fix: xy}
"""
TWO_MATERIALS = SQUARE + "  - {polygon: [[0, 0.5], [1, 0.5], [1, 2], [0, 2]], material: clay}\n"
TWO_MOTIONS = SQUARE + """supports:
  - {segment: [[0, 0], [1, 0]], fix: xy}
  - {segment: [[1, 0], [0, 0]], fix: x, motion: [[0, 0, 0], [1, 0.1, 0]]}
"""
ONE_MOTION = TWO_MOTIONS.replace("fix: xy", "fix: y")
SHAKEN = SQUARE + "base_motion: {acceleration: [[0, 0, 0], [1, 1, 0]]}\n"
SOFT = SQUARE + """supports:
  - {segment: [[0, 0], [1, 0]], fix: xy}
"""
RESTING = SOFT + "analysis: {kind: static, damping: 3}\n"
THROWN = """blocks:
  - {name: low, polygon: [[0, 0], [1, 0], [1, 1], [0, 1]], material: rock, velocity: [1, 0, 0]}
supports:
  - {block: low, fix: xy}
analysis: {kind: static}
"""
SLIDING = """gravity: [5, -9]
blocks:
  - {name: base, polygon: [[-2, -1], [4, -1], [4, 0], [-2, 0]], material: rock}
  - {name: top, polygon: [[0, 0], [1.1, 0], [1.1, 0.9], [0, 0.9]], material: rock}
supports:
  - {block: base, fix: xy}
"""
SLIVER = """domain:
  - {polygon: [[0, 0], [2.00000001, 0], [2.00000001, 4.330127118922193], [0, 4.330127118922193]],
     material: rock}
supports:
  - {segment: [[0, 0], [2.00000001, 0]], fix: y}
  - {segment: [[0, 0], [0, 4.330127118922193]], fix: x}
  - {segment: [[2.00000001, 0], [2.00000001, 4.330127118922193]], fix: x}
covers: {size: 1}
analysis: {kind: static, tolerance: 1e-9}
"""


class Case(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = folder.name

    def nmm(self, *words, scene=None, **more):
        if scene is not None:
            with open(os.path.join(self.folder, "scene.yaml"), "w", encoding="utf-8") as file:
                file.write(HEAD + scene)
        return subprocess.run([PROGRAM, *words], cwd=self.folder, text=True, capture_output=True,
                              check=False, **more)


class Warnings(Case):
    def check(self, scene, line, *words):
        """One warning at this line with these words, of check, its JSON and run."""
        place = f"scene.yaml:{line}:"
        for command in ["check"], ["run"]:
            done = self.nmm(*command, "scene.yaml", scene=scene)
            self.assertEqual(done.returncode, 0, done.stderr)
            told = [row for row in done.stderr.splitlines() if row.startswith(place)]
            self.assertEqual(len(told), 1, done.stderr)
            self.assertIn(": warning: ", told[0])
            for word in words:
                self.assertIn(word, told[0])
        told = json.loads(self.nmm("check", "--json", "scene.yaml").stdout)["warnings"]
        self.assertEqual(len([row for row in told if row.startswith(place)]), 1)

    def silent(self, scene):
        done = self.nmm("check", "-q", "scene.yaml", scene=scene)
        self.assertEqual((done.returncode, done.stderr), (0, ""))

    def test_overlap_of_a_rounded_drawing(self):
        self.check(OVERLAP, 8, "block 'high' overlaps block 'low' by 0.001 m")
        self.silent(OVERLAP.replace("0.999", "1"))

    def test_domain_of_two_materials(self):
        self.check(TWO_MATERIALS, 8, "line 7", "0.5 m2", "of 'clay', not 'rock'")
        held = "supports:\n  - {segment: [[0, 0], [1, 0]], fix: xy}\n"
        self.silent(TWO_MATERIALS.replace("clay", "rock") + held)
        self.silent(TWO_MATERIALS.replace("0.5]", "1]") + held)

    def test_region_in_a_hole(self):
        circle = "{circle: {center: [0.5, 0.5], radius: %s}%s}\n"
        scene = SQUARE + "holes:\n  - " + circle % (0.3, "") + "regions:\n  - "
        self.check(scene + circle % (0.2, ", material: clay"), 11,
                   "no material lies inside this region: it changes nothing")
        told = self.nmm("check", "-q", "scene.yaml", scene=scene + circle % (0.35, ", material: clay"))
        self.assertNotIn("region", told.stderr)

    def test_supports_that_disagree(self):
        self.check(TWO_MOTIONS, 10, "line 9", "along x")
        self.silent(ONE_MOTION)
        self.silent(TWO_MOTIONS.replace("0.1, 0]", "0, 0]"))

    def test_earthquake_without_supports(self):
        self.check(SHAKEN, 8, "base_motion without supports")
        self.silent(SHAKEN + SOFT[len(SQUARE):])

    def test_nothing_held(self):
        self.check(SQUARE, 1, "no supports", "gravity moves all")
        self.silent(SOFT)
        self.silent(SQUARE + "gravity: [0, 0]\n")
        stone = "blocks:\n  - {polygon: [[0, 0], [1, 0], [1, 1], [0, 1]], material: rock}\n"
        self.silent(stone)
        self.check(stone + stone[len("blocks:\n"):].replace("[0, ", "[2, ").replace("[1, ", "[3, "), 1,
                   "no supports")

    def test_locking(self):
        self.silent(SOFT)
        for ratio, more, n in (("0.48", [], 0), ("0.49", [], 1), ("0.49", ["covers.order=1"], 0),
                               ("0.49", ["covers.mesh=block"], 0),
                               ("0.49", ["materials.rock.plane=stress"], 0)):
            words = [f"materials.rock.poissons_ratio={ratio}", *more]
            done = self.nmm("check", "-q", "scene.yaml", scene=SOFT,
                            *[word for one in words for word in ("--set", one)])
            self.assertEqual(done.stderr.count("locking"), n, (ratio, more, done.stderr))

    # 26 kN/m3, 2.6 t/m3 and 5 GPa without their units.
    def test_numbers_without_their_units(self):
        for wrong in "26", "2.6":
            done = self.nmm("check", "-q", "scene.yaml",
                            "--set", f"materials.rock.density={wrong}", scene=SOFT)
            self.assertIn(f"warning: density of {wrong} kg/m3", done.stderr)
            self.assertEqual(done.returncode, 0)
        for wrong, told in ("5", True), ("2.4e5", True), ("2.5e5", False):
            done = self.nmm("check", "-q", "scene.yaml",
                            "--set", f"materials.rock.youngs_modulus={wrong}")
            self.assertEqual("warning: youngs_modulus of " in done.stderr, told, done.stderr)

    # Lattices cut thin elements off nearly everywhere: only what a step calls a sliver is told.
    def test_slivers(self):
        done = self.nmm("check", "-q", "scene.yaml", scene=SLIVER)
        self.assertRegex(done.stderr, "^warning: smallest element .* is a sliver")
        self.silent(SLIVER.replace("2.00000001", "2.01"))

    def test_motion_in_statics(self):
        self.check(RESTING, 10, "damping has no effect with kind: static")
        self.check(THROWN, 7, "velocity has no effect with kind: static")
        self.silent(RESTING.replace("damping: 3", "damping: 0"))
        self.silent(RESTING.replace("static", "dynamic"))

    def test_support_that_gives_way(self):
        soft = ["--set", "materials.rock.youngs_modulus=1", "--set", "materials.rock.density=1e5",
                "--set", "time.end=0.5", "--set", "time.dt=0.01"]
        done = self.nmm("run", "scene.yaml", "--json", *soft, scene=SOFT)
        self.assertRegex(done.stderr, "warning: scene.yaml: a support gave way by ")
        result = json.loads(done.stdout)
        self.assertGreater(result["max_support_give"], 0.01 * result["cover_size"])
        info = self.nmm("info", "scene.vtkhdf", "--json")
        self.assertEqual(json.loads(info.stdout)["max_support_give"], result["max_support_give"])
        done = self.nmm("run", "scene.yaml", "--json")
        self.assertEqual(done.stderr, "")
        result = json.loads(done.stdout)
        self.assertLess(result["max_support_give"], 1e-4 * result["cover_size"])

    def test_augmented_in_short_steps(self):
        scene = SLIDING + "contact: {method: augmented}\n"
        done = self.nmm("check", "scene.yaml", scene=scene)
        self.assertRegex(done.stdout, r"steps below [0-9.e-]+ s do not settle so")
        short = ["--set", "time.dt=1e-6", "--set", "time.end=1e-5"]
        self.assertNotIn("augmented contact carried", self.nmm("run", "scene.yaml", *short).stdout)
        told = json.loads(self.nmm("info", "scene.vtkhdf", "--json").stdout)
        self.assertEqual(told["not_raised"], 0)
        self.assertGreater(told["pressed"], 0)

    def test_ledger_that_does_not_close(self):
        longer, loose = ["--set", "time.end=0.05"], ["--set", "analysis.tolerance=0.1"]
        done = self.nmm("run", "scene.yaml", "--json", *longer, *loose, scene=SLIDING)
        words = "the energy ledger does not close, by .* J or .* since step .* may help"
        self.assertRegex(done.stderr, f"warning: scene.yaml: {words}")
        self.assertEqual(len(done.stderr.splitlines()), 1)
        ledger = json.loads(done.stdout)["ledger"]
        self.assertRegex(ledger["warning"], words)
        self.assertGreater(ledger["residual_step"], 0)
        self.assertGreater(ledger["largest_residual"], 1e-5 * ledger["largest_energy"])
        info = self.nmm("info", "scene.vtkhdf", "--json")
        self.assertEqual(json.loads(info.stdout)["ledger"], ledger)
        self.assertRegex(self.nmm("info", "scene.vtkhdf").stdout, f"warning: {words}")
        done = self.nmm("run", "scene.yaml", "--json", *longer)
        ledger = json.loads(done.stdout)["ledger"]
        self.assertEqual((done.stderr, ledger["warning"], ledger["residual_step"]), ("", "", 0))
        self.assertNotIn("warning", self.nmm("info", "scene.vtkhdf").stdout)

    def test_elements_inside_out(self):
        done = self.nmm("run", "scene.yaml", "-q", "--set", "materials.rock.youngs_modulus=1",
                        "--set", "materials.rock.density=1e5", "--set", "time.end=1",
                        "--set", "time.dt=0.01", scene=SOFT)
        self.assertEqual(done.returncode, 1)
        self.assertRegex(done.stderr, r"an element of block 0 near \(.*\) turned inside out")

    def test_sliver_inside_out(self):
        run = ["run", "scene.yaml", "-q", "--set", "time={}",
               "--set", "materials.rock={density: 2500, youngs_modulus: 1e9, poissons_ratio: 0.3}"]
        done = self.nmm(*run, scene=SLIVER)
        self.assertEqual(done.returncode, 1)
        self.assertRegex(done.stderr, r"a sliver of .* turned inside out; another covers.size")
        self.assertEqual(self.nmm(*run, "--set", "covers.order=1").returncode, 0)


class Hints(Case):
    def refused(self, *words, **more):
        done = self.nmm(*words, **more)
        self.assertEqual(done.returncode, 2, done.stderr)
        self.assertEqual(len(done.stderr.splitlines()), 1)
        return done.stderr

    def test_threads(self):
        self.assertIn("1 to 4096", self.refused("run", "scene.yaml", "--threads", "100000"))

    def test_output_of_another_kind(self):
        for ending in "png", "SVG", "pdf", "vtu", "yaml", "yml":
            told = self.refused("run", "scene.yaml", "-o", f"i.{ending}", scene=SQUARE)
            self.assertIn("run files end in .vtkhdf", told)
            self.assertFalse(os.path.exists(os.path.join(self.folder, f"i.{ending}")))
        self.assertIn("nmm plot", self.refused("run", "scene.yaml", "-o", "i.png"))
        self.assertIn("nmm export", self.refused("run", "scene.yaml", "-o", "i.vtu"))

    def test_frame_and_field(self):
        self.nmm("run", "scene.yaml", "-q", scene=SQUARE)
        told = self.refused("plot", "scene.vtkhdf", "-o", "i.png", "--frame", "99999")
        self.assertRegex(told, r"^error: scene.vtkhdf: frame 99999 is not there")
        told = self.refused("plot", "scene.vtkhdf", "-o", "i.png", "--field", "colour")
        self.assertRegex(told, r"^error: scene.vtkhdf: unknown field 'colour'")
        told = self.refused("plot", "scene.vtkhdf", "-o", "i.bmp")
        self.assertRegex(told, r"^error: i.bmp: a picture's name ends in")

    def test_standard_input(self):
        by_name = self.nmm("run", "scene.yaml", "--json", scene=SQUARE)
        done = self.nmm("run", "-", "--json", "-o", "in.vtkhdf", input=HEAD + SQUARE)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(json.loads(done.stdout)["state_hash"],
                         json.loads(by_name.stdout)["state_hash"])
        self.assertIn("--output", self.refused("run", "-", input=HEAD + SQUARE))
        done = self.nmm("check", "-", input=HEAD + SQUARE.replace("polygon", "poligon"))
        self.assertEqual(done.returncode, 3)
        self.assertTrue(re.match(r"<stdin>:7:\d+: error: ", done.stderr), done.stderr)
        self.assertEqual(self.nmm("check", "-", input="").returncode, 3)
        self.assertRegex(self.nmm("check", "-", input=HEAD + SQUARE).stdout, "^<stdin>: no title")
        self.assertIn("file", self.refused("compare", "-", input=HEAD + SQUARE))


if __name__ == "__main__":
    PROGRAM = os.path.abspath(sys.argv.pop(1))
    unittest.main()
