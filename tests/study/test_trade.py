#!/usr/bin/python3
# SPDX-License-Identifier: MIT
"""nmm trade from outside, on scenes of examples/verification with closed forms: errors that shrink,
the Pareto set, the setting named run again by nmm run, files, messages, exit status.

Usage: test_trade.py PROGRAM [unittest arguments]
"""

import csv
import io
import json
import math
import os
import re
import resource
import shlex
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import unittest
import xml.etree.ElementTree

PROGRAM = ""
SCENES = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "examples",
                      "verification")
INCLINE = os.path.join(SCENES, "incline.yaml")
COLUMN = os.path.join(SCENES, "column.yaml")
# g (sin 30 - cos 30 tan 20) t^2 / 2 at 2 s
GLIDE = 9.81 * (0.5 - math.sqrt(0.75) * math.tan(math.radians(20))) * 2
# density g H^2 / (2 E), which holds without Poisson's effect at the base.
SETTLEMENT = -2500 * 9.81 * 100 / 2e9
NO_POISSON = ("--set", "materials.rock.poissons_ratio=0")
# What Shi's scheme comes to in a single long step; newmark swings on.
AT_REST = ("--set", "analysis.kind=static")


def limit_files(most):
    """In the child: files of at most so many bytes, and an error instead of a signal beyond."""
    signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (most, most))


class Trade(unittest.TestCase):
    """Each test has a folder of its own."""

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = folder.name

    def at(self, *names):
        return os.path.join(self.folder, *names)

    def run_nmm(self, *words):
        return subprocess.run([PROGRAM, *words], cwd=self.folder, stdin=subprocess.DEVNULL,
                              capture_output=True, text=True, check=False)

    def trade(self, *words, end=0):
        done = self.run_nmm("trade", *words)
        self.assertEqual(done.returncode, end, done.stderr)
        return done

    def measure(self, *words, end=0):
        return json.loads(self.trade(*words, "--json", "--threads", "1", end=end).stdout)

    def check_pareto(self, rows):
        """For a closed form. An error a twentieth larger is no worse where it takes less time."""
        known = [r for r in rows if r["error"] is not None]
        for row in rows:
            dominated = any(o["seconds"] < row["seconds"] and o["error"] <= 1.05 * row["error"]
                            or o["seconds"] == row["seconds"] and o["error"] < row["error"]
                            for o in known) if row in known else True
            self.assertEqual(row["pareto"], "" if dominated else "yes", row)
        self.assertTrue(any(r["pareto"] for r in rows))

    def run_again(self, scene, report, *words):
        """The relative error of nmm run with the options that the trade named."""
        done = self.run_nmm("run", scene, *words, *shlex.split(report["options"]), "--json",
                            "--quiet", "--threads", "1")
        self.assertEqual(done.returncode, 0, done.stderr)
        _, name, field = report["quantity"].split(".")
        field, component = re.fullmatch(r"(\w+)\[(\d)\]", field).groups()
        value = json.loads(done.stdout)["monitors"][name][field][int(component)]
        return abs(value / report["reference"][0] - 1)

    def test_incline(self):
        report = self.measure(INCLINE, "--quick", "--want", "1%", "--set",
                              "analysis.tolerance=1e-7", "--knobs",
                              "size,dt,mesh,scheme,tolerance,solver,precision,penalty", "--expect",
                              f"monitors.slider.displacement[0]={GLIDE!r}")
        rows = report["rows"]
        self.assertEqual(report["source"], "closed form")
        self.assertEqual([r["end"] for r in rows], ["completed"] * len(rows))
        self.check_pareto(rows)
        # Forces that balance move the block as exactly as they balance, at least.
        ladder = {r["setting"]: r["error"] for r in rows}
        self.assertLess(ladder["analysis.tolerance=0.001"], 1e-3)
        self.assertLess(ladder["analysis.tolerance=1e-05"], 1e-4)
        self.assertLess(ladder["as it stands"], 1e-5)
        self.assertGreater(ladder["contact.penalty=2"], ladder["contact.penalty=200"])
        self.assertLess(self.run_again(INCLINE, report, "--set", "analysis.tolerance=1e-7"), 0.01)

    def whole(self, path):
        """Is the file as it should be to its last byte?"""
        with open(path, "rb") as file:
            data = file.read()
        if path.endswith(".png"):
            return data.endswith(b"IEND\xaeB`\x82")
        if path.endswith(".svg"):
            return data.rstrip().endswith(b"</svg>")
        rows = list(csv.DictReader(io.StringIO(data.decode())))
        return data.endswith(b"\n") and len(rows) == 3 and all(r["end"] for r in rows)

    def test_full_disk(self):
        """Files may not grow beyond a limit: status 4, the file is named, no half of one is left."""
        words = ("trade", COLUMN, "--quick", "--knobs", "solver", "--threads", "1", "-o", "out")
        told = set()
        for limit in (0, 100, 1000, 4000, 10000, 30000, 10**6):
            done = subprocess.run([PROGRAM, *words], cwd=self.folder, stdin=subprocess.DEVNULL,
                                  capture_output=True, text=True, check=False,
                                  preexec_fn=lambda most=limit: limit_files(most))
            self.assertEqual(done.returncode, 0 if limit == 10**6 else 4, done.stderr)
            if limit < 10**6:
                self.assertRegex(done.stderr, r"cannot write out/column\.\w+: File too large")
                told.add(re.search(r"out/column\.(\w+)", done.stderr)[1])
            # An empty folder goes, too.
            for name in os.listdir(self.at("out")) if os.path.exists(self.at("out")) else ():
                self.assertTrue(self.whole(self.at("out", name)), f"{limit}: {name}")
                os.remove(self.at("out", name))
        self.assertEqual(told, {"csv", "svg"})

    def test_orders(self):
        """Quadratic displacements are those of the column's own weight: order 1 is exact."""
        report = self.measure(COLUMN, *NO_POISSON, "--knobs", "order", "--expect",
                              f"monitors.top.displacement[1]={SETTLEMENT!r}")
        ladder = {r["setting"]: r["error"] for r in report["rows"]}
        self.assertEqual(list(ladder), ["as it stands"]
                         + [f"covers.order={k}{size}" for k in (1, 2)
                            for size in (" covers.size=4", " covers.size=2", "")])
        for setting, error in ladder.items():
            if setting == "as it stands":
                self.assertGreater(error, 1e-3)
            else:
                self.assertLess(error, 1e-5)

    def test_column(self):
        words = (*NO_POISSON, "--set", "covers.size=0.85", "--knobs", "size,dt,solver", "--expect",
                 f"monitors.top.displacement[1]={SETTLEMENT!r}")
        report = self.measure(COLUMN, *words, "--want", "0.01%")
        rows = report["rows"]
        self.check_pareto(rows)
        ladder = {r["setting"]: r["error"] for r in rows}
        errors = [ladder["covers.size=3.4"], ladder["covers.size=1.7"], ladder["as it stands"],
                  ladder["covers.size=0.425"], ladder["covers.size=0.2125"]]
        for coarse, fine in zip(errors, errors[1:]):
            self.assertGreater(coarse, 1.5 * fine)
        self.assertLess(rows[report["cheapest"]]["error"], 0.01)
        own = (*NO_POISSON, "--set", "covers.size=0.85")
        self.assertLess(self.run_again(COLUMN, report, *own), 1e-4)
        # No setting comes so near.
        report = self.measure(COLUMN, *words, "--quick", "--want", "1e-12", end=1)
        self.assertEqual(report["cheapest"], -1)
        self.assertIn("no setting comes within", report["why"])

    def test_text_and_files(self):
        done = self.trade(COLUMN, "--quick", "--knobs", "size", "--want", "5%", "-o", "a/b", *AT_REST)
        self.assertRegex(done.stdout, r"\n  nmm run \S+column.yaml --set analysis.kind=static"
                                      r"( --set covers.size=\S+)?\n")
        self.assertRegex(done.stdout, r"Cheapest .* % of a reference that is known to \S+ %\.\n")
        self.assertIn("Pareto set", done.stdout)
        self.assertIn("monitors.top.displacement at the end", done.stdout)
        with open(self.at("a", "b", "column.csv"), newline="", encoding="utf-8") as file:
            rows = list(csv.DictReader(file))
        self.assertEqual([r["knob"] for r in rows], ["scene", "size", "size"])
        for row in rows:
            self.assertTrue(math.isfinite(float(row["seconds"])))
        root = xml.etree.ElementTree.parse(self.at("a", "b", "column.svg")).getroot()
        self.assertGreater(len(list(root.iter())), 50)
        with open(self.at("a", "b", "column.png"), "rb") as file:
            self.assertEqual(file.read(8), b"\x89PNG\r\n\x1a\n")

    def test_scenes_go_by_their_folder(self):
        os.mkdir(self.at("arch.v2"))
        with open(COLUMN, encoding="utf-8") as file:
            text = file.read()
        for name, written in (("arch.v2/scene.yaml", "arch.v2"), ("scene.yaml", "scene"),
                              ("./scene.yaml", "scene")):
            with open(self.at(name), "w", encoding="utf-8") as file:
                file.write(text)
            self.trade(name, "--quick", "--quiet", "--knobs", "precision", "-o", "out")
            self.assertEqual(sorted(os.listdir(self.at("out"))),
                             [f"{written}.{ending}" for ending in ("csv", "png", "svg")])
            shutil.rmtree(self.at("out"))

    def test_values_of_the_command_line_are_quoted(self):
        done = self.trade(COLUMN, "--quick", "--quiet", "--knobs", "size", "--want", "5%", *AT_REST,
                          "--set", "gravity=[0, -5]")
        self.assertIn("--set 'gravity=[0, -5]'", done.stdout)
        line = next(l for l in done.stdout.splitlines() if "nmm run" in l)
        words = shlex.split(line)
        self.assertEqual(self.run_nmm(*words[1:], "--quiet").returncode, 0)

    def test_what_cannot_be_told(self):
        done = self.trade(COLUMN, "--quick", "--knobs", "size", "--want", "1e-9", end=1)
        self.assertIn("no run that completed says what is due to dt, scheme", done.stderr)
        # All has been damped away long before the end; what is left is known to many digits, but
        # the other scheme still swings.
        done = self.trade(os.path.join(SCENES, "oscillator.yaml"), "--quick", "--knobs",
                          "size,dt,scheme,tolerance", "--want", "0.1%", "--set", "time.end=0.3", end=1)
        self.assertRegex(done.stderr, r"cannot be told: the reference is known to \d\d")

    def test_wrong_words(self):
        for words, said in ((("--knobs", "siz"), "there are size, dt"),
                            (("--knobs", "penalty"), "nothing to be traded"),
                            (("--want", "0"), "above 0 and below 100%"),
                            (("--want", "100%"), "above 0 and below 100%"),
                            (("--want", "%"), "above 0 and below 100%"),
                            (("--want", "one"), "above 0 and below 100%"),
                            (("--longest", "-1"), "above 0"),
                            (("--quantity", "top"), "must be monitors.NAME"),
                            (("--expect", "1.5"), "as monitors.NAME"),
                            (("--expect", "monitors.top.velocity=1"), "two numbers"),
                            (("--quantity", "monitors.foot.stress"), "there are: top, middle"),
                            (("--scenes", "x"), "unknown option --scenes")):
            done = self.trade(COLUMN, *words, end=2)
            self.assertIn(said, done.stderr)
            self.assertEqual(done.stdout, "")
        self.assertIn("must be a file", self.trade("-", end=2).stderr)
        self.assertFalse(os.path.exists(self.at("trade")))

    def test_wrong_scenes(self):
        self.assertIn("nowhere.yaml", self.trade("nowhere.yaml", end=4).stderr)
        done = self.trade(COLUMN, "--set", "covers.sise=1", end=3)
        self.assertIn("did you mean", done.stderr)
        done = self.trade(COLUMN, "-o", "/proc/nothing", end=4)
        self.assertIn("/proc/nothing", done.stderr)

    def test_interrupted(self):
        program = subprocess.Popen([PROGRAM, "trade", INCLINE, "--set", "time.dt=1e-5", "--knobs",
                                    "dt"], cwd=self.folder, stdout=subprocess.PIPE,
                                   stderr=subprocess.PIPE, text=True)
        time.sleep(2)
        program.send_signal(signal.SIGINT)
        _, messages = program.communicate(timeout=200)
        self.assertEqual(program.returncode, 1, messages)
        self.assertIn("ended early", messages)
        # The first run of so small steps has not ended: nothing is written, and nothing is left.
        self.assertFalse(os.path.exists(os.path.join(self.folder, "trade")))

    def test_help(self):
        done = self.trade("--help")
        for word in ("--want", "--expect", "--quantity", "--knobs", "--longest", "--quick"):
            self.assertIn(word, done.stdout)


def main():
    global PROGRAM
    PROGRAM = os.path.abspath(sys.argv[1])
    unittest.main(argv=[sys.argv[0]] + sys.argv[2:])


if __name__ == "__main__":
    main()
