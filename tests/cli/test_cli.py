#!/usr/bin/python3
# SPDX-License-Identifier: MIT
"""The command line from outside: exit status, messages, JSON, interruption, full disks.

Usage: test_cli.py PROGRAM [unittest arguments]
"""

import importlib.util
import json
import math
import os
import pty
import re
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import unittest

PROGRAM = ""
ROOT = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..")
STATIC = os.path.join(ROOT, "tests", "scene", "good", "static.yaml")

FALL = """nmm: 1
title: Falling "block" \u00e9
gravity: [0, -10]
blocks:
  - {name: stone, polygon: [[0, 0], [1, 0], [1, 1], [0, 1]], material: rock}
materials:
  rock: {density: 2000, youngs_modulus: 1e9, poissons_ratio: 0.25}
covers: {size: 1}
time: {dt: 1e-3, end: 0.01}
monitors:
  - {name: middle, point: [0.5, 0.5], record: [displacement, velocity, stress]}
output: {every: 2e-3}
"""

RUN_FIELDS = """scene blocks elements covers unknowns contacts steps time end wall_seconds phase_seconds
solver dt_cuts open_close_iterations energy ledger max_penetration monitors state_hash""".split()
PHASE_FIELDS = "contact assemble solve advance output".split()
SOLVER_FIELDS = "method device on_device precision solves iterations failed".split()
ENERGY_FIELDS = "kinetic strain contact friction fracture external numerical residual".split()


def strict_json(text):
    """Parse one JSON object; NaN and infinity, which JSON does not know, are refused."""
    def refuse(word):
        raise ValueError(f"{word} is not JSON")
    return json.loads(text, parse_constant=refuse)


class Case(unittest.TestCase):
    """Each test has a folder of its own with fall.yaml in it."""

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = folder.name
        self.write("fall.yaml", FALL)

    def at(self, name):
        return os.path.join(self.folder, name)

    def write(self, name, text):
        with open(self.at(name), "w", encoding="utf-8") as file:
            file.write(text)

    def start(self, *words, **options):
        return subprocess.Popen([PROGRAM, *words], cwd=self.folder, stdin=subprocess.DEVNULL,
                                stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, **options)

    def nmm(self, *words, **options):
        process = self.start(*words, **options)
        out, err = process.communicate(timeout=100)
        return process.returncode, out, err

    def expect(self, status, *words, err=None, out=None, **options):
        got, stdout, stderr = self.nmm(*words, **options)
        self.assertEqual(got, status, f"{words}: exit status {got}\n{stdout}\n{stderr}")
        if err is not None:
            self.assertRegex(stderr, err)
        if out is not None:
            self.assertRegex(stdout, out)
        return stdout, stderr


class Words(Case):
    """Wrong and right command lines."""

    def wrong(self, message, *words):
        out, err = self.expect(2, *words, err=message)
        self.assertEqual(out, "")
        self.assertEqual(err.count("\n"), 1, err)

    def test_wrong_command_lines(self):
        self.wrong("which command")
        self.wrong("unknown command rnu; did you mean nmm run", "rnu", "fall.yaml")
        self.wrong("unknown command zzzzzz; nmm --help lists", "zzzzzz")
        self.wrong("which SCENE", "run")
        self.wrong("which RUN", "info", "--json")
        self.wrong('one SCENE expected, found "b.yaml"', "run", "fall.yaml", "b.yaml")
        self.wrong("unknown option --sett; did you mean --set", "run", "fall.yaml", "--sett", "a=1")
        self.wrong("unknown option -x", "run", "-x", "fall.yaml")
        self.wrong("unknown option --frame", "run", "--frame", "1", "fall.yaml")
        self.wrong("--json takes no value", "run", "--json=1", "fall.yaml")
        self.wrong("--set needs a value: KEY=VALUE", "run", "fall.yaml", "--set")
        self.wrong("must be key.path=value", "run", "fall.yaml", "--set", "time.end")
        self.wrong("must be key.path=value", "run", "fall.yaml", "--set", "=3")
        self.wrong("must be host, target or auto", "run", "fall.yaml", "--device", "gpu")
        for threads in "0", "-1", "two", "1.5", "99999999999999999999", "":
            self.wrong("whole number from 1", "run", "fall.yaml", "--threads", threads)
        for scale in "0", "nan", "inf", "-1", "x":
            self.wrong("a number above 0", "plot", "a.vtkhdf", "--scale", scale)
        for frame in "-1", "first", "99999999999":
            self.wrong("whole number from 0, or last", "plot", "a.vtkhdf", "--frame", frame)
        self.wrong("names the scene itself", "run", "fall.yaml", "-o", "./fall.yaml")
        self.wrong("to what", "export", "a.vtkhdf")

    def test_wrong_command_lines_of_systems(self):
        self.wrong("which SYSTEM", "solve")
        self.wrong("unknown option --metod; did you mean --method", "solve", "a.mtx", "--metod", "x")
        self.wrong("unknown option --dump-sytem; did you mean --dump-system", "run", "--dump-sytem")
        self.wrong("unknown option --rhs", "run", "fall.yaml", "--rhs", "a")
        self.wrong("must be auto, jacobi, .* or direct", "solve", "a.mtx", "--method", "or")
        self.wrong("must be auto, jacobi, .* or direct", "solve", "a.mtx", "--method", "gauss_seidel")
        self.wrong("must be auto, cover, cluster or body", "solve", "a.mtx", "--blocks", "")
        self.wrong("must be auto, double or mixed", "solve", "a.mtx", "--precision", "half")
        self.wrong("must be residual or average_change", "solve", "a.mtx", "--stop", "never")
        for option, values in {"tolerance": "0 1 nan x -1", "absolute": "0 inf", "damping": "2 0",
                               "factor": "2 0", "max-iterations": "0 1.5", "repeat": "0 x"}.items():
            for value in values.split():
                self.wrong("must be a", "solve", "a.mtx", "--" + option, value)
        for place in "1", "1:", ":1", "0:1", "1:0", "1:1:1", "a:b", "1:-1", "99999999999999999999:1":
            self.wrong("must be STEP:ITERATION", "run", "fall.yaml", "--dump-system", place, "a")
        for prefix in [], [""], ["--json"]:
            self.wrong("needs a prefix", "run", "fall.yaml", "--dump-system", "1:1", *prefix)
        for option, value in ("steps", "0"), ("allow", "1"), ("allow", "0"):
            self.wrong("must be a", "compare", "fall.yaml", "--" + option, value)

    def test_commands_to_come_are_not_known(self):
        listed, _ = self.expect(0, "--help")
        for name in "view resume sweep".split():
            self.wrong("unknown command " + name, name, "fall.yaml")
            self.assertNotRegex(listed, rf"\n  {name}\b")

    def test_help_and_version_everywhere(self):
        listed, _ = self.expect(0, "--help", out="Examples:")
        commands = re.findall(r"^  ([a-z]+) ", listed.split("Commands:")[1].split("\n\n")[0], re.M)
        self.assertEqual(commands, ["run", "check", "info", "plot", "export", "compare", "solve",
                                    "bench", "trade"])
        self.assertEqual(self.expect(0, "-h")[0], listed)
        for name in commands:
            text, err = self.expect(0, name, "--help", out="Usage: nmm " + name)
            self.assertRegex(text, r"Examples:\n  nmm " + name)
            self.assertEqual(err, "")
            self.assertEqual(self.expect(0, name, "-h")[0], text)
            self.assertEqual(self.expect(0, "help", name)[0], text)
            self.expect(0, name, "--version", out=r"^nmm \d+\.\d+\.\d+ \(.*\)\n$")
        self.expect(0, "--version", out=r"^nmm \d+\.\d+\.\d+ \(.*\)\n$")

    def test_examples_of_the_help_parse(self):
        for name in "run check info plot export compare solve trade".split():
            text, _ = self.expect(0, name, "--help")
            for line in text.split("Examples:\n")[1].strip().split("\n"):
                words = line.split(">")[0].split()[1:]
                status, _, err = self.nmm(*words)
                self.assertEqual(status, 4, f"{line}: {err}")  # the file is missing, no more

    def test_forms_of_options(self):
        for words in (["-o", "a.vtkhdf"], ["-oa.vtkhdf"], ["--output", "a.vtkhdf"],
                      ["--output=a.vtkhdf"]):
            self.expect(0, "run", *words, "fall.yaml")
            self.assertTrue(os.path.exists(self.at("a.vtkhdf")))
            os.unlink(self.at("a.vtkhdf"))
        os.rename(self.at("fall.yaml"), self.at("-fall.yaml"))
        self.expect(0, "check", "--", "-fall.yaml")


class Scenes(Case):
    """Wrong scenes and files."""

    def test_missing_scene(self):
        out, _ = self.expect(4, "run", "none.yaml", err="none.yaml")
        self.assertEqual(out, "")
        self.assertEqual(os.listdir(self.folder), ["fall.yaml"])

    def test_wrong_scene_names_line_and_column(self):
        self.write("bad.yaml", FALL.replace("youngs_modulus", "youngs_module"))
        out, _ = self.expect(3, "run", "bad.yaml", "--json", err=r"bad\.yaml:7:\d+: error: ")
        self.assertEqual(out, "")
        self.assertFalse(os.path.exists(self.at("bad.vtkhdf")))
        self.expect(3, "check", "bad.yaml", err="youngs_modulus")

    def test_several_mistakes_in_one_go(self):
        self.write("bad.yaml", FALL.replace("dt: 1e-3", "dt: -1").replace("size: 1", "size: x"))
        _, err = self.expect(3, "check", "bad.yaml")
        self.assertEqual(len(re.findall(r"bad\.yaml:\d+:\d+: error: ", err)), 2, err)

    def test_folder_and_rubbish(self):
        self.expect(4, "run", ".")
        self.write("rubbish.yaml", "\0\1\2{{{")
        self.expect(3, "run", "rubbish.yaml")
        self.write("empty.yaml", "")
        self.expect(3, "run", "empty.yaml")
        self.expect(4, "info", "none.vtkhdf", err="none.vtkhdf")
        self.write("rubbish.vtkhdf", "rubbish")
        for command in ["info"], ["plot"], ["export", "--vtu", "out"]:
            self.expect(3, *command, "rubbish.vtkhdf", err="rubbish.vtkhdf")

    def test_unwritable_output(self):
        self.expect(4, "run", "fall.yaml", "-o", "none/a.vtkhdf", err="none/a.vtkhdf")
        if os.getuid() != 0:
            os.chmod(self.folder, 0o500)
            self.expect(4, "run", "fall.yaml", err="fall.vtkhdf")
            os.chmod(self.folder, 0o700)

    def test_settings(self):
        out, _ = self.expect(0, "run", "fall.yaml", "--json", "--set", "time.end=0.004",
                             "--set", "gravity=[0,-20]")
        result = strict_json(out)
        self.assertAlmostEqual(result["time"], 0.004, delta=1e-9)
        self.assertAlmostEqual(result["monitors"]["middle"]["velocity"][1], -0.08, delta=1e-6)
        self.expect(3, "run", "fall.yaml", "--set", "time.ende=1", err="ende")
        self.expect(3, "run", "fall.yaml", "--set", "time.end=soon", err="soon")

    def test_target_that_is_not_there(self):
        status, out, err = self.nmm("run", "fall.yaml", "--device", "target", "--json",
                                    env={**os.environ, "OMP_TARGET_OFFLOAD": "DISABLED"})
        self.assertEqual((status, out), (5, ""), err)
        self.assertFalse(os.path.exists(self.at("fall.vtkhdf")))
        self.expect(0, "run", "fall.yaml", "--device", "auto")


class Results(Case):
    """What run, check and info print."""

    def test_run_as_json(self):
        out, err = self.expect(0, "run", "fall.yaml", "--json")
        result = strict_json(out)
        for fields, part in ((RUN_FIELDS, result), (PHASE_FIELDS, result["phase_seconds"]),
                             (SOLVER_FIELDS, result["solver"]), (ENERGY_FIELDS, result["energy"])):
            self.assertEqual([f for f in fields if f not in part], [])
        self.assertEqual(err, "")
        self.assertGreater(result["phase_seconds"]["output"], 0)
        self.assertEqual((result["scene"], result["end"], result["blocks"]),
                         ("fall.yaml", "completed", 1))
        self.assertRegex(result["state_hash"], "^[0-9a-f]{16}$")
        self.assertEqual(result["unknowns"], 2 * result["covers"])

    def test_run_is_right(self):
        result = strict_json(self.expect(0, "run", "fall.yaml", "--json")[0])
        seen = result["monitors"]["middle"]
        self.assertAlmostEqual(result["time"], 0.01, delta=1e-12)
        self.assertAlmostEqual(seen["velocity"][1], -0.1, delta=1e-6)
        self.assertAlmostEqual(seen["displacement"][1], -5e-4, delta=1e-6)
        self.assertEqual(len(seen["stress"]), 3)
        self.assertAlmostEqual(result["energy"]["kinetic"], 0.5 * 2000 * 0.01, delta=1e-3)

    def test_info_agrees_with_run(self):
        ran = strict_json(self.expect(0, "run", "fall.yaml", "--json")[0])
        told = strict_json(self.expect(0, "info", "fall.vtkhdf", "--json")[0])
        for name in "scene blocks elements covers unknowns steps time end energy ledger state_hash".split():
            self.assertEqual(told[name], ran[name], name)
        self.assertEqual(told["monitors"], ran["monitors"])

    def test_what_solved_is_told(self):
        ran = strict_json(self.expect(0, "run", "fall.yaml", "--json")[0])["solver"]
        self.assertEqual(sum(ran["blocks"].values()), ran["solves"])
        self.assertIn("least work", ran["why"])
        self.assertIn(ran["why_solves"], range(1, ran["solves"] + 1))
        self.assertGreaterEqual(ran["threads"], 1)
        self.assertEqual(ran, strict_json(self.expect(0, "info", "fall.vtkhdf", "--json")[0])["solver"])
        self.expect(0, "info", "fall.vtkhdf", out=ran["why"])
        self.expect(0, "check", "fall.yaml", out="what promises the least work")

    def test_what_was_asked_for_in_vain_is_told(self):
        asked = ("fall.yaml", "--set", "solver.method=direct", "--set", "solver.precision=mixed",
                 "--set", "solver.stop=average_change", "--set", "solver.blocks=cover")
        for command in "check", "run":
            out, err = self.expect(0, command, *asked)
            self.assertIn("direct has no single precision form", err)
            self.assertIn("direct tests the residual", err)
            self.assertIn("blocks has no effect", err)
        self.assertIn("mixed precision was asked for and not used", out)
        ran = strict_json(self.expect(0, "run", *asked, "--json")[0])["solver"]
        self.assertEqual((ran["precision"], ran["precision_asked"], ran["mixed"]), ("double", "mixed", 0))
        self.assertEqual(ran["blocks"]["direct"], ran["solves"])
        ran = strict_json(self.expect(0, "run", "fall.yaml", "--set", "solver.method=pcg", "--set",
                                      "solver.precision=mixed", "--json")[0])["solver"]
        self.assertEqual(ran["precision"], "mixed" if ran["mixed"] > 0 else "double")
        self.assertGreaterEqual(ran["mixed"] + ran["fell_back"], 1)
        self.assertEqual(ran["fall_back"] != "", ran["fell_back"] > 0)

    def test_average_change_is_told(self):
        asked = ("--set", "solver.method=jacobi", "--set", "solver.stop=average_change", "--set",
                 "solver.tolerance=1e-3", "--set", "materials.rock.youngs_modulus=1e11")
        out, err = self.expect(0, "run", "fall.yaml", *asked, out="by the average change")
        self.assertEqual(err, "")
        ran = strict_json(self.expect(0, "info", "fall.vtkhdf", "--json")[0])["solver"]
        self.assertGreater(ran["by_average_change"], 0)

    def test_human_report(self):
        out, err = self.expect(0, "run", "fall.yaml")
        for word in "completed steps contact solve kinetic residual penetration middle".split():
            self.assertIn(word, out)
        self.assertIn("fall.vtkhdf", out)
        self.assertNotIn("\x1b", out + err)
        self.assertNotIn("\r", out + err)
        self.assertEqual(err, "")
        self.expect(0, "info", "fall.vtkhdf", out="completed")

    def test_statics_tell_no_time(self):
        out = self.expect(0, "run", STATIC, out="steps to equilibrium in ")[0]
        self.assertNotRegex(out, r"steps to [\d.]")
        told = self.expect(0, "info", "static.vtkhdf", out="steps to equilibrium in ")[0]
        self.assertNotRegex(told, r"steps to [\d.]")
        for out, kind in ((self.expect(0, "run", STATIC, "--json")[0], "static"),
                          (self.expect(0, "info", "static.vtkhdf", "--json")[0], "static"),
                          (self.expect(0, "run", "fall.yaml", "--json")[0], "dynamic"),
                          (self.expect(0, "info", "fall.vtkhdf", "--json")[0], "dynamic")):
            self.assertEqual(strict_json(out)["kind"], kind)
        self.expect(0, "run", "fall.yaml", out="steps to 0.01 s in ")
        # Where there is none, it is not said either.
        out, _ = self.expect(1, "run", "fall.yaml", "--set", "analysis.kind=static",
                             err="no_equilibrium")
        self.assertNotIn("to equilibrium", out)
        self.assertRegex(out, r"\d+ steps in ")

    def test_quiet_says_nothing(self):
        self.assertEqual(self.expect(0, "run", "fall.yaml", "--quiet"), ("", ""))
        self.assertTrue(os.path.exists(self.at("fall.vtkhdf")))

    def test_default_output_is_here(self):
        os.mkdir(self.at("scenes"))
        os.rename(self.at("fall.yaml"), self.at("scenes/fall.slow.yaml"))
        self.expect(0, "run", "scenes/fall.slow.yaml", "-q")
        self.assertEqual(sorted(os.listdir(self.folder)), ["fall.slow.vtkhdf", "scenes"])

    def test_check(self):
        out, err = self.expect(0, "check", "fall.yaml", out="1 blocks")
        self.assertIn("memory", out)
        result = strict_json(self.expect(0, "check", "fall.yaml", "--json")[0])
        self.assertEqual((result["blocks"], result["contacts"], result["warnings"]), (1, 0, []))
        self.assertEqual(result["title"], 'Falling "block" \u00e9')
        self.assertAlmostEqual(result["area"], 1, delta=1e-12)
        self.assertGreater(result["memory_bytes"], 1000)
        self.assertTrue(result["choices"])
        self.assertEqual(err, "")
        self.assertEqual(os.listdir(self.folder), ["fall.yaml"])

    def test_check_warns(self):
        start = FALL.index("blocks:"), FALL.index("materials:")
        self.write("fall.yaml", FALL[:start[0]] + """domain:
  - {polygon: [[0, 0], [1, 0], [1, 1], [0, 1]], material: rock}
joints:
  - {polyline: [[-1, 0.3], [0.6, 0.37]]}
supports:
  - {segment: [[0, 0], [1, 0]], fix: xy}
""" + FALL[start[1]:])
        size = ["--set", "covers.size=0.25"]
        _, err = self.expect(0, "check", "fall.yaml", *size)
        self.assertRegex(err, "warning: 1 joint end was cut back")
        result = strict_json(self.expect(0, "check", "fall.yaml", "--json", *size)[0])
        self.assertEqual(result["trimmed_joint_ends"], 1)
        self.assertEqual(len(result["warnings"]), 1)
        self.expect(0, "run", "fall.yaml", *size, err="warning: 1 joint end was")

    # An L: joints in its box that miss it are named with their line, sets where all traces miss it.
    def test_joints_outside(self):
        start = FALL.index("blocks:"), FALL.index("materials:")
        text = FALL[:start[0]] + """domain:
  - {polygon: [[0, 0], [2, 0], [2, 1], [1, 1], [1, 2], [0, 2]], material: rock}
joints:
  - {name: seam, polyline: [[1.2, 1.4], [1.8, 1.9]]}
  - {name: bed, polyline: [[-1, 0.5], [3, 0.5]]}
  - {polyline: [[1.2, 1.5], [1.8, 1.95]]}
joint_sets:
  - {name: bedding, dip: 135, spacing: 1.25, origin: [1.9, 1.9]}
  - {name: cross, dip: 135, spacing: 1.25, origin: [1.9, 1.9], inside: [[1.2, 1.2], [2, 1.2], [2, 2]]}
""" + FALL[start[1]:]
        self.write("fall.yaml", text)
        line = text[:text.index("{name: seam")].count("\n") + 1
        told = ["fall.yaml:%d:5: warning: 'seam': this joint lies outside the domain and cuts nothing" % line,
                "fall.yaml:%d:5: warning: 'joint 3': this joint lies outside the domain and cuts nothing"
                % (line + 2),
                "fall.yaml:%d:5: warning: 'cross': all traces of this joint set, 1, lie outside the "
                "domain and cut nothing" % (line + 5)]
        _, err = self.expect(0, "check", "fall.yaml", "--set", "covers.size=0.5")
        self.assertEqual([found for found in err.splitlines() if "outside" in found], told)
        result = strict_json(self.expect(0, "check", "fall.yaml", "--json")[0])
        self.assertEqual(result["joints_outside"], 4)

    def test_check_explains_lengths(self):
        self.write("fall.yaml", FALL.replace("{size: 1}", "{mesh: block}"))
        out, _ = self.expect(0, "check", "fall.yaml")
        self.assertRegex(out, "chosen: one cover for each block; lengths are measured by 1 m, the "
                              "side of a square as large as the median block")
        self.assertRegex(out, r"\n  one cover for each block; elements of 1 m2")

    def test_threads_do_not_change_a_bit(self):
        hashes = {strict_json(self.expect(0, "run", "fall.yaml", "--json", "-t", n)[0])["state_hash"]
                  for n in ("1", "2", "3", "8")}
        self.assertEqual(len(hashes), 1)

    def test_plot_and_export(self):
        self.expect(0, "run", "fall.yaml", "-q")
        self.expect(0, "plot", "fall.vtkhdf", out="fall.png")
        with open(self.at("fall.png"), "rb") as file:
            self.assertEqual(file.read(8), b"\x89PNG\r\n\x1a\n")
        self.expect(0, "plot", "fall.vtkhdf", "-o", "a.svg", "--frame", "1", "--field",
                    "displacement", "--scale", "100", "--width", "400")
        self.expect(0, "plot", "fall.vtkhdf", "-o", "a.pdf", "--frame", "last")
        # A picture of statics tells no time: with another end of it the picture is the same.
        for end in "1", "2":
            run = f"{end}.vtkhdf"
            self.expect(0, "run", STATIC, "-q", "--set", f"time.end={end}", "-o", run)
            self.expect(0, "plot", run, "-o", f"{end}.svg", "--field", "displacement")
        with open(self.at("1.svg"), "rb") as one, open(self.at("2.svg"), "rb") as two:
            self.assertEqual(one.read(), two.read())
        self.expect(2, "plot", "fall.vtkhdf", "--frame", "999", err="999")
        self.expect(2, "plot", "fall.vtkhdf", "--field", "colour", err="colour")
        self.expect(2, "plot", "fall.vtkhdf", "-o", "a.bmp", err="a.bmp")
        self.expect(4, "plot", "fall.vtkhdf", "-o", "none/a.png", err="none/a.png")
        self.expect(0, "export", "fall.vtkhdf", "--vtu", "out", out="6 frames")
        self.assertEqual(len([n for n in os.listdir(self.at("out")) if n.endswith(".vtu")]), 6)


SYSTEM = """%%MatrixMarket matrix coordinate real symmetric
3 3 5
1 1 4
2 1 1
2 2 3
3 2 -1
3 3 2
"""

SOLVE_FIELDS = """matrix rhs output order padded entries method blocks precision why device on_device
threads converged end reason row setups iterations residual lambda_min lambda_max solution_norm
seconds least_seconds read_seconds repeat""".split()


class Systems(Case):
    """nmm run --dump-system, nmm solve, nmm compare."""

    def solve(self, *words, status=0):
        out, err = self.expect(status, "solve", *words, "--json")
        result = strict_json(out)
        self.assertEqual([f for f in SOLVE_FIELDS if f not in result], [])
        return result, err

    def test_a_dumped_system(self):
        result = strict_json(self.expect(0, "run", "fall.yaml", "--json", "--dump-system", "2:1",
                                         "second")[0])
        self.assertEqual(sorted(n for n in os.listdir(self.folder) if n.startswith("second")),
                         ["second.mtx", "second_guess.mtx", "second_places.mtx", "second_rhs.mtx"])
        with open(self.at("second.mtx"), encoding="ascii") as file:
            text = file.read()
        self.assertRegex(text, "^%%MatrixMarket matrix coordinate real (general|symmetric)\n"
                               "% step 2, open-close iteration 1, try 1 of the step, from time 0.001")
        files = ["second.mtx", "--rhs", "second_rhs.mtx", "--guess", "second_guess.mtx",
                 "--places", "second_places.mtx"]
        norms = []
        for method in "pcg", "jacobi", "sor":
            solved, err = self.solve(*files, "--method", method, "--tolerance", "1e-12",
                                     "-o", "u.mtx", "--repeat", "3")
            self.assertEqual((solved["end"], solved["method"], err), ("converged", method, ""))
            self.assertEqual(solved["order"], result["unknowns"])
            self.assertLessEqual(solved["residual"], 1e-12)
            with open(self.at("u.mtx"), encoding="ascii") as file:
                lines = file.read().split("\n")
            self.assertEqual(lines[0], "%%MatrixMarket matrix array real general")
            number = [float(line) for line in lines[2:-1]]
            self.assertEqual(len(number), solved["order"])
            self.assertAlmostEqual(math.hypot(*number) / solved["solution_norm"], 1, delta=1e-14)
            norms.append(solved["solution_norm"])
        # A fall: every cover moves by v h + g h^2 / 2 in the second step.
        wanted = (10 * 1e-3 * 1e-3 + 10 * 1e-3 ** 2 / 2) * math.sqrt(result["covers"])
        for norm in norms:
            self.assertAlmostEqual(norm / wanted, 1, delta=1e-4)

    def test_a_system_that_never_comes(self):
        _, err = self.expect(1, "run", "fall.yaml", "-q", "--dump-system", "99:1", "a")
        self.assertIn("no such step or iteration", err)
        self.assertEqual([n for n in os.listdir(self.folder) if n.endswith(".mtx")], [])
        self.expect(4, "run", "fall.yaml", "-q", "--dump-system", "1:1", "none/a", err="none/a")

    def test_ones(self):
        self.write("a.mtx", SYSTEM)
        out, err = self.expect(0, "solve", "a.mtx", out="one decoupled unknown more")
        self.assertRegex(out, "order 3, 7 entries")
        self.assertRegex(out, "matrix times ones, largest error")
        self.assertEqual(err, "")
        solved, _ = self.solve("a.mtx", "--tolerance", "1e-13")
        self.assertLess(solved["error"], 1e-12)
        self.assertEqual((solved["padded"], solved["rhs"]), (1, None))
        self.assertEqual(self.expect(0, "solve", "a.mtx", "-q")[0], "")

    def test_solves_that_fail(self):
        self.write("a.mtx", SYSTEM.replace("3 3 2", "3 3 -2"))
        solved, err = self.solve("a.mtx", "-o", "u.mtx", "--method", "pcg", status=1)
        self.assertEqual((solved["converged"], solved["end"]), (False, "indefinite"))
        self.assertEqual((solved["row"], solved["output"]), (3, None))
        self.assertRegex(err, "error: a.mtx: not solved: matrix not positive definite .* rows 3 and 4")
        self.assertFalse(os.path.exists(self.at("u.mtx")))

    def test_solutions_of_any_size(self):
        for exponent, end, norm in (-200, "converged", 5e208), (200, "converged", 5e-192), (
                -300, "out_of_range", 0):
            self.write("a.mtx", "%%MatrixMarket matrix coordinate real symmetric\n2 2 2\n"
                                f"1 1 1e{exponent}\n2 2 1e{exponent}\n")
            self.write("f.mtx", "%%MatrixMarket matrix array real general\n2 1\n3e8\n4e8\n")
            solved, err = self.solve("a.mtx", "--rhs", "f.mtx", status=int(end != "converged"))
            self.assertEqual(solved["end"], end)
            self.assertAlmostEqual(solved["solution_norm"], norm, delta=1e-12 * norm)
        self.assertRegex(err, "error: a.mtx: not solved: the solution is beyond the range of numbers")
        # Numbers that fit, and a norm that does not.
        self.write("f.mtx", "%%MatrixMarket matrix array real general\n2 1\n1.5e8\n1.5e8\n")
        solved = self.solve("a.mtx", "--rhs", "f.mtx")[0]
        self.assertEqual((solved["end"], solved["solution_norm"]), ("converged", None))
        self.expect(0, "solve", "a.mtx", "--rhs", "f.mtx", out=r"\|u\| is beyond 1.8e308")

    def test_options_that_a_method_has_no_use_for(self):
        self.write("a.mtx", SYSTEM)
        for method in "auto", "pcg", "direct":
            out, err = self.nmm("solve", "a.mtx", "--method", method, "--stop", "average_change")[1:]
            self.assertEqual(out, "")
            self.assertIn(f"method {method} tests the residual", err)
        solved = self.solve("a.mtx", "--method", "direct", "--precision", "mixed", "--blocks", "body")[0]
        self.assertEqual((solved["precision"], solved["converged"]), ("double", True))
        self.assertIn("direct has no single precision form", solved["why"])
        self.assertIn("body blocks were not used", solved["why"])
        solved = self.solve("a.mtx", "--method", "jacobi", "--stop", "average_change", "--tolerance",
                            "0.1")[0]
        self.assertTrue(solved["by_average_change"] or solved["residual"] <= 0.1)

    def test_wrong_systems(self):
        for change, place, words in (
                (("coordinate", "coordinates"), "1:23", "found 'coordinates'"),
                (("3 3 5", "3 4 5"), "2:1", "must be square"),
                (("2 1 1", "2 1 one"), "4:5", "found 'one'"),
                (("3 2 -1", "3 4 -1"), "6:3", "the column"),
                (("3 3 2", "2 2 2"), "7:1", "row 2, column 2 is given a second time"),
                (("3 3 2\n", ""), "7:1", "ends after 4 of 5")):
            self.write("a.mtx", SYSTEM.replace(*change))
            out, err = self.expect(3, "solve", "a.mtx", "--json")
            self.assertEqual(out, "")
            self.assertRegex(err, rf"^a\.mtx:{place}: error: .*{words}")
        self.write("a.mtx", SYSTEM.replace("symmetric", "general"))
        self.expect(3, "solve", "a.mtx", err="must be symmetric: row 1, column 2 is 0, but row 2")
        self.write("a.mtx", SYSTEM)
        self.expect(3, "solve", "a.mtx", "--rhs", "a.mtx", err=r"a\.mtx:1:23: error: must be array")
        self.expect(3, "solve", "fall.yaml", err=r"fall\.yaml:1:1: error: must be %%MatrixMarket")
        self.expect(4, "solve", "none.mtx", err="none.mtx")
        self.expect(4, "solve", "a.mtx", "--rhs", "none.mtx", err="none.mtx")
        self.expect(4, "solve", "a.mtx", "-o", "none/u.mtx", err="none/u.mtx")
        no_device = {**os.environ, "OMP_TARGET_OFFLOAD": "DISABLED"}
        self.expect(5, "solve", "a.mtx", "--device", "target", err="no target", env=no_device)

    def test_compare_without_a_target(self):
        out, _ = self.expect(5, "compare", "fall.yaml", "--json", err="fake-device",
                             env={**os.environ, "OMP_TARGET_OFFLOAD": "DISABLED"})
        self.assertEqual(out, "")
        self.expect(4, "compare", "none.yaml")
        self.expect(3, "compare", "fall.yaml", "--set", "time.ende=1", err="ende")

    @unittest.skipUnless("NMM_EXPECT_DEVICE" in os.environ, "needs the preset fake-device")
    def test_compare(self):
        out, err = self.expect(0, "compare", "fall.yaml", "--json")
        result = strict_json(out)
        self.assertEqual((result["equal_bits"], result["agree"], result["difference"], err),
                         (True, True, 0, ""))
        self.assertEqual(result["steps"], 10)
        for side in "host", "target":
            self.assertEqual(result[side]["solver"]["on_device"], side == "target")
            self.assertGreater(result[side]["seconds_per_iteration"], 0)
            self.assertEqual(sorted(result[side]["phase_seconds"]), sorted(PHASE_FIELDS))
            for part in "solve", "step":
                amount = result[side]["transfers_per_" + part]
                for name in "transfers", "bytes", "seconds":
                    self.assertEqual(amount[name] > 0, side == "target", name)
        self.assertEqual(result["host"]["state_hash"], result["target"]["state_hash"])
        self.assertGreater(len(result["break_even"]["measured"]), 1)
        self.assertIn("unknowns", result["break_even"]["against_auto"])
        for rung in result["break_even"]["measured"]:
            self.assertGreater(rung["host_auto_seconds"], 0)
            self.assertRegex(rung["host_auto"], "^(direct|pcg, (cover|cluster|body))$")
        self.assertEqual((result["break_even"]["failed"], result["host"]["reason"]), (None, ""))
        self.expect(0, "compare", "fall.yaml", "--steps", "3", out="equal in every bit")
        self.expect(1, "compare", "fall.yaml", "--set", "solver.method=pcg", "--set",
                    "solver.max_iterations=1", "--set", "time.dt_min=9e-4", out="target: ended early",
                    err="host and target agree and ended early, solver_failed: dt would fall")


class Readme(Case):
    """What the README shows: its scene, its commands, its lines of C."""

    def setUp(self):
        super().setUp()
        with open(os.path.join(ROOT, "README.md"), encoding="utf-8") as file:
            self.readme = file.read()

    def shown(self, begin):
        """The block of the README that begins so."""
        return self.readme.split(begin)[1].split("```")[0]

    def test_scene(self):
        self.write("block.yaml", self.shown("```yaml\n"))
        result = strict_json(self.expect(0, "run", "block.yaml", "--json", "--set",
                                         "time.end=0.2")[0])
        # Sliding down 30 degrees with 20 degrees of friction.
        speed = -result["monitors"]["middle"]["velocity"][1] / math.sin(math.radians(30))
        slope, friction = math.radians(30), math.tan(math.radians(20))
        wanted = 9.81 * (math.sin(slope) - math.cos(slope) * friction) * 0.2
        self.assertAlmostEqual(speed, wanted, delta=0.02 * wanted)

    def test_commands(self):
        scene = self.shown("```yaml\n").replace("end: 1.0", "end: 0.02")
        self.write("block.yaml", scene)
        lines = ("nmm check" + self.shown("```\nnmm check")).splitlines()
        self.assertEqual(len(lines), 3)
        for line in lines:
            words, said = line.split("#")
            self.expect(0, *words.split()[1:])
            for name in re.findall(r"block\.[.\w]+\w", said):
                self.assertTrue(os.path.exists(self.at(name)), name)

    def test_table_of_commands(self):
        """Each command with its help and examples, and no command is forgotten."""
        named = set(re.findall(r"(?m)^\| `nmm (\w+) ", self.readme))
        listed = re.findall(r"(?m)^  (\w+)  ", self.expect(0, "--help")[0].split("Options:")[0])
        self.assertEqual(named, set(listed))
        for name in named:
            self.expect(0, name, "--help", out="Examples:\n  nmm " + name)
        benches = re.findall(r"`(\w+)`", self.shown("| `nmm bench NAME` |").split("\n")[0])
        told = self.expect(0, "bench", "--help")[0].split("Each prints")[0]
        self.assertEqual(set(benches), set(re.findall(r"(?m)^  (\w+) ", told)))

    @unittest.skipUnless(importlib.util.find_spec("h5py"), "needs h5py")
    def test_lines_of_python(self):
        """Those of docs/output.md, on a run with contacts."""
        with open(os.path.join(ROOT, "docs", "output.md"), encoding="utf-8") as file:
            lines = file.read().split("```python\n")[1].split("```")[0]
        self.write("block.yaml", self.shown("```yaml\n").replace("end: 1.0", "end: 0.04"))
        self.expect(0, "run", "block.yaml", "-o", "slope.vtkhdf")
        self.write("lines.py", lines + "\n".join((
            "", "assert len(times) == 3 and abs(times[-1] - 0.04) < 1e-9",
            "assert u.shape == (n, 3) and stress.shape == (m, 6)",
            "assert abs(u).max() > 1e-3 and abs(stress).max() > 1",
            "assert len(force) == len(closed) and closed.any()",
            "assert len(names) == 20 and names[0] == 'step'")))
        done = subprocess.run([sys.executable, "lines.py"], cwd=self.folder, capture_output=True,
                              text=True, check=False)
        self.assertEqual(done.returncode, 0, done.stderr)

    @unittest.skipUnless(shutil.which("cc"), "needs a C compiler")
    def test_lines_of_c(self):
        head, body = self.shown("```c\n").split("\n\n")
        self.write("lines.c", f"{head}\nint main(void) {{\n{body}return status;\n}}\n")
        done = subprocess.run(["cc", "-fsyntax-only", "-Wall", "-Werror", "-I",
                               os.path.join(ROOT, "include"), self.at("lines.c")],
                              capture_output=True, text=True, check=False)
        self.assertEqual(done.returncode, 0, done.stderr)


class Endings(Case):
    """Runs that do not reach their end; whatever happens, the file is whole."""

    def info(self, path="fall.vtkhdf"):
        return strict_json(self.expect(0, "info", path, "--json")[0])

    def start_long(self, *words):
        process = self.start("run", "fall.yaml", "--set", "time.end=1e4", *words)
        for _ in range(600):
            if os.path.exists(self.at("fall.vtkhdf")) or process.poll() is not None:
                break
            time.sleep(0.05)
        time.sleep(0.3)
        return process

    def test_one_interrupt_finishes_the_step(self):
        for number in signal.SIGINT, signal.SIGTERM:
            process = self.start_long("--json")
            process.send_signal(number)
            out, err = process.communicate(timeout=60)
            self.assertEqual(process.returncode, 1, err)
            self.assertRegex(err, "ending after this step")
            result = strict_json(out)
            self.assertEqual(result["end"], "interrupted")
            told = self.info()
            self.assertEqual((told["end"], told["steps"], told["state_hash"]),
                             ("interrupted", result["steps"], result["state_hash"]))
            os.unlink(self.at("fall.vtkhdf"))

    def test_two_interrupts_end_at_once(self):
        # Seconds for a step, so that the second one comes while the first one waits.
        process = self.start_long("--set", "covers.size=0.01", "--set", "solver.tolerance=1e-15")
        process.send_signal(signal.SIGINT)
        time.sleep(0.3)
        process.send_signal(signal.SIGINT)
        _, err = process.communicate(timeout=60)
        self.assertEqual(process.returncode, 1)
        if "ended at once" in err:
            self.assertRegex(err, "ended at once; fall.vtkhdf holds the run")
        self.assertEqual(self.info()["end"], "interrupted")

    def test_interrupts_before_the_first_frame(self):
        process = self.start("run", "fall.yaml", "--set", "covers.size=0.004")
        time.sleep(0.3)
        process.send_signal(signal.SIGINT)
        time.sleep(0.3)
        process.send_signal(signal.SIGINT)
        _, err = process.communicate(timeout=60)
        self.assertEqual(process.returncode, 1, err)
        if "nothing was saved" in err:
            self.assertFalse(os.path.exists(self.at("fall.vtkhdf")))
        else:
            self.info()

    def test_signals_at_once_count_as_one(self):
        process = self.start_long("--json")
        process.send_signal(signal.SIGINT)
        process.send_signal(signal.SIGTERM)
        out, err = process.communicate(timeout=60)
        self.assertEqual(process.returncode, 1, err)
        self.assertNotIn("at once;", err)
        self.assertEqual(strict_json(out)["end"], "interrupted")

    def test_interrupts_that_are_ignored_stay_ignored(self):
        process = self.start("run", "fall.yaml", preexec_fn=lambda: signal.signal(
            signal.SIGINT, signal.SIG_IGN))
        process.send_signal(signal.SIGINT)
        process.communicate(timeout=60)
        self.assertEqual(process.returncode, 0)

    def test_kill_leaves_a_readable_file(self):
        process = self.start_long()
        process.kill()
        process.communicate()
        told = self.info()
        self.assertEqual(told["end"], "interrupted")

    def test_step_too_small(self):
        self.write("fall.yaml", FALL.replace("end: 0.01", "end: 10, max_move: 1e-9, dt_min: 1e-4"))
        out, err = self.expect(1, "run", "fall.yaml", "--json", err="ended early, step_too_small")
        self.assertEqual(strict_json(out)["end"], "step_too_small")
        self.assertEqual(self.info()["end"], "step_too_small")

    def run_with_room(self, size):
        """A long run that may write files of `size` bytes at most."""
        def small_files():
            resource.setrlimit(resource.RLIMIT_FSIZE, (size, size))
        _, err = self.expect(4, "run", "fall.yaml", "--set", "time.end=100", "--set",
                             "output.every=1e-3", preexec_fn=small_files)
        self.assertRegex(err, "error: .*fall.vtkhdf: File too large")
        self.assertNotIn("HDF5-DIAG", err)

    @unittest.skipIf("TSAN_OPTIONS" in os.environ, "libomp and TSan die of a quota")
    def test_full_disk(self):
        self.run_with_room(60000)  # not even the first frame
        self.assertEqual([n for n in os.listdir(self.folder) if "vtkhdf" in n], [])
        self.run_with_room(400000)
        self.assertEqual(self.info()["end"], "interrupted")

    def test_results_that_cannot_be_printed(self):
        self.expect(0, "run", "fall.yaml", "-q")
        with open("/dev/full", "w", encoding="utf-8") as full:
            process = subprocess.run([PROGRAM, "info", "fall.vtkhdf"], cwd=self.folder, stdout=full,
                                     stderr=subprocess.PIPE, text=True, check=False)
        self.assertEqual(process.returncode, 4)
        self.assertIn("standard output", process.stderr)


class Terminal(Case):
    """Progress and colour, on a terminal only."""

    def setUp(self):
        super().setUp()
        try:
            for end in pty.openpty():
                os.close(end)
        except OSError as error:
            self.skipTest(f"no pseudo-terminals here: {error}")

    def on_terminal(self, *words, **environment):
        """Standard error on a pseudo-terminal; returns what came out there."""
        leader, follower = pty.openpty()
        env = {k: v for k, v in os.environ.items() if k != "NO_COLOR"}
        env.update({"TERM": "xterm", **environment})
        process = subprocess.Popen([PROGRAM, *words], cwd=self.folder, stdout=subprocess.PIPE,
                                   stderr=follower, env=env)
        os.close(follower)
        text = b""
        try:
            while chunk := os.read(leader, 4096):
                text += chunk
        except OSError:  # how a closed terminal shows
            pass
        os.close(leader)
        process.communicate(timeout=60)
        return text.decode()

    def test_progress(self):
        text = self.on_terminal("run", "fall.yaml")
        self.assertRegex(text, r"\r *\d+ %  [\d.e-]+ of 0\.01 s  .* left  step \d+ ")
        self.assertTrue(text.endswith("\r\x1b[K"), repr(text[-40:]))
        self.assertRegex(self.on_terminal("run", STATIC), r"\rstep \d+  open-close \d+  solver")
        for words, environment in ((["--quiet"], {}), ([], {"TERM": "dumb"})):
            self.assertEqual(self.on_terminal("run", "fall.yaml", *words, **environment), "")

    def test_colour(self):
        self.assertIn("\x1b[1;31merror:", self.on_terminal("run"))
        self.assertNotIn("\x1b", self.on_terminal("run", NO_COLOR="1"))


if __name__ == "__main__":
    PROGRAM = os.path.abspath(sys.argv.pop(1))
    unittest.main()
