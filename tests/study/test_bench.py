#!/usr/bin/python3
# SPDX-License-Identifier: MIT
"""nmm bench from outside: tables, CSV, pictures that parse, exit status, messages.

Usage: test_bench.py PROGRAM [unittest arguments]
"""

import csv
import json
import math
import os
import re
import signal
import subprocess
import sys
import tempfile
import time
import unittest
import xml.etree.ElementTree

PROGRAM = ""
PAPER = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "examples", "paper")

# Columns that every table of this name has, whatever else.
COLUMNS = {
    "table1": "scene unknowns sor_solver_share solver_share sor_step_ms step_ms speedup device",
    "fig6": "iteration sor gauss_seidel jacobi damped_jacobi chebyshev pcg",
    "fig7": "scene order device threads sor_ms ms speedup_over_sor speedup_over_serial end",
    "contact": "blocks edges contacts threads step_ms step_us_per_block device",
    "wall": "blocks unknowns threads step_ms public_dda_ms device",
    "only": "feature scene unknowns without_ms with_ms time_saved without_mb with_mb memory_saved",
    "growth": "scene unknowns contact_ms assembly_ms solver_ms step_ms megabytes device",
}
OF_SCENES = ("table1", "fig6", "fig7")  # the others have scenes of their own
# Columns with words, and those where nothing may stand.
WORDS = {"feature", "scene", "device", "method", "end"}
MAY_BE_EMPTY = {"public_dda_ms", "part_of_public_dda", "direct_share", "file_without_mb",
                "file_with_mb"}


class Bench(unittest.TestCase):
    """Each test has a folder of its own, with two of the paper's scenes in it."""

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = folder.name
        for name in ("strut_whole", "strut_joint"):
            os.makedirs(self.at("scenes", name))
            os.symlink(os.path.join(PAPER, name, "scene.yaml"),
                       self.at("scenes", name, "scene.yaml"))

    def at(self, *names):
        return os.path.join(self.folder, *names)

    def run_bench(self, *words, folder=None):
        return subprocess.run([PROGRAM, "bench", *words], cwd=folder or self.folder,
                              stdin=subprocess.DEVNULL, capture_output=True, text=True, check=False)

    def check_csv(self, name, path):
        with open(path, newline="", encoding="utf-8") as file:
            rows = list(csv.DictReader(file))
        self.assertGreater(len(rows), 1)
        self.assertLessEqual(set(COLUMNS[name].split()), set(rows[0]))
        for row in rows:
            unmeasured = row.get("device") == "not run on a GPU"
            for column, value in row.items():
                if column in WORDS:
                    self.assertTrue(value or unmeasured, column)
                elif value:
                    self.assertTrue(math.isfinite(float(value)), f"{column} {value}")
                elif name != "fig6" and not unmeasured:
                    self.assertIn(column, MAY_BE_EMPTY)
        return rows

    def check_pictures(self, name, folder):
        root = xml.etree.ElementTree.parse(os.path.join(folder, name + ".svg")).getroot()
        self.assertTrue(root.tag.endswith("svg"))
        self.assertGreater(len(list(root.iter())), 50)
        with open(os.path.join(folder, name + ".png"), "rb") as file:
            self.assertEqual(file.read(8), b"\x89PNG\r\n\x1a\n")

    def measure(self, name, *words):
        scenes = ("--scenes", "scenes") if name in OF_SCENES else ()
        done = self.run_bench(name, "--quick", *scenes, *words)
        self.assertEqual(done.returncode, 0, done.stderr)
        rows = self.check_csv(name, self.at("bench", name + ".csv"))
        self.check_pictures(name, self.at("bench"))
        return done, rows

    def test_table1(self):
        done, rows = self.measure("table1")
        self.assertEqual([r["scene"] for r in rows], ["strut_whole", "strut_joint"])
        self.assertIn("the paper: 56 to 97 %", done.stdout)
        self.assertIn("bench/table1.csv", done.stdout)

    def test_fig6(self):
        done, rows = self.measure("fig6")
        # What is said of each method is what its column comes to: 1e-3 and 1e-6, and stays below.
        titles = {"sor": "SOR(1.9)", "gauss_seidel": "Gauss-Seidel", "chebyshev": "Chebyshev",
                  "pcg": "PCG, 2x2"}
        for column, title in titles.items():
            last = float([r[column] for r in rows if r[column]][-1])
            said = re.search(rf"(?m)^{re.escape(title)}: (.*)$", done.stdout)[1]
            self.assertEqual("1e-3 at" in said, last <= 1e-3, said)
            self.assertEqual("not reached" not in said, last <= 1e-6, said)

    def test_fig6_of_a_static_scene(self):
        # Systems of statics are ill-conditioned: a small residual is no exact solution there.
        for name in ("strut_whole", "strut_joint"):
            with open(self.at("scenes", name, "scene.yaml"), encoding="utf-8") as file:
                scene = file.read()
            os.remove(self.at("scenes", name, "scene.yaml"))
            with open(self.at("scenes", name, "scene.yaml"), "w", encoding="utf-8") as file:
                file.write(scene + "analysis: {kind: static}\n")
        self.measure("fig6")

    def test_fig7(self):
        _, rows = self.measure("fig7", "--device", "host", "--threads", "1,2")
        self.assertEqual([r["threads"] for r in rows], ["1", "2"] * 4)
        self.assertEqual(len({r["device"] for r in rows}), 1)

    def test_one_scene_is_no_range(self):
        os.remove(self.at("scenes", "strut_joint", "scene.yaml"))
        os.rmdir(self.at("scenes", "strut_joint"))
        for name, said in (("table1", r"Orders: 194 unknowns \(the paper"),
                           ("table1", r"with ours: [\d.e+-]+ %\.\n"),
                           ("table1", r"one thread: [\d.e+-]+ times as fast; slower in \d of 1 scene\."),
                           ("fig7", r"as they are: [\d.e+-]+ times as fast\.\n"),
                           ("fig7", r"are [\d.e+-]+ times as many\.\n")):
            done = self.run_bench(name, "--quick", "--scenes", "scenes", "--threads", "1")
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertRegex(done.stdout, said)

    def test_contact(self):
        self.measure("contact", "--threads", "1")

    def test_wall(self):
        done, rows = self.measure("wall")
        self.assertEqual([r["blocks"] for r in rows[::2]], ["19", "69", "265"])
        # Three walls say nothing of growth; where there is no note, there is no room for one.
        self.assertNotRegex(done.stdout, r"\n\n\n")

    def test_growth(self):
        self.measure("growth", "--threads", "1")

    def test_only(self):
        _, rows = self.measure("only")
        self.assertEqual(len({r["feature"] for r in rows}), len(rows))
        by_name = {r["feature"]: r for r in rows}
        lattice, fields = by_name["a lattice in each block"], by_name["velocity and stress in it"]
        self.assertGreater(float(lattice["memory_saved"]), 10)
        self.assertGreater(float(fields["file_with_mb"]), 1.1 * float(fields["file_without_mb"]))

    def test_what_was_not_run_on_a_gpu_says_so(self):
        done = self.run_bench("fig7", "--quick", "--scenes", "scenes", "--threads", "1")
        self.assertEqual(done.returncode, 0, done.stderr)
        with open(self.at("bench", "fig7.csv"), newline="", encoding="utf-8") as file:
            rows = list(csv.DictReader(file))
        self.assertEqual(len(rows), 8)
        unmeasured = [r for r in rows if r["device"] == "not run on a GPU"]
        for row in unmeasured:
            self.assertEqual(row["speedup_over_sor"], "")
        # A build with a target has measured there, all others say that they have not.
        self.assertIn(len(unmeasured), (0, 4))

    def test_json_is_the_table(self):
        done = self.run_bench("table1", "--quick", "--scenes", "scenes", "--json", "-o", "a/b")
        self.assertEqual(done.returncode, 0, done.stderr)
        report = json.loads(done.stdout)
        self.assertEqual(report["bench"], "table1")
        self.assertTrue(report["quick"])
        self.assertEqual([r["scene"] for r in report["rows"]], ["strut_whole", "strut_joint"])
        self.assertEqual(report["units"]["step_ms"], "ms")
        self.assertEqual(len(self.check_csv("table1", self.at("a", "b", "table1.csv"))), 2)

    def test_wrong_words(self):
        for words, said in ((("fig8",), "did you mean fig6"), (("walls",), "did you mean wall"),
                            (("nonsense",), "there are all, table1"), ((), "which NAME"),
                            (("wall", "--threads", "0"), "1 to 4096"),
                            (("wall", "--threads", "1,"), "1 to 4096"),
                            (("wall", "--threads", ",".join(["2"] * 17)), "up to 16"),
                            (("wall", "--quik"), "did you mean --quick"),
                            (("wall", "--set", "a=b"), "unknown option --set")):
            done = self.run_bench(*words)
            self.assertEqual(done.returncode, 2, words)
            self.assertIn(said, done.stderr)
            self.assertEqual(done.stdout, "")
        self.assertFalse(os.path.exists(self.at("bench")))

    def test_no_scenes(self):
        done = self.run_bench("table1")
        self.assertEqual(done.returncode, 4)
        self.assertIn("examples/paper in the current folder", done.stderr)
        self.assertIn("share/nmm/examples/paper", done.stderr)
        done = self.run_bench("fig6", "--scenes", "nowhere")
        self.assertEqual(done.returncode, 4)
        self.assertIn("nowhere", done.stderr)
        os.mkdir(self.at("nothing"))
        done = self.run_bench("fig6", "--scenes", "nothing")
        self.assertEqual(done.returncode, 4)
        self.assertIn("scene.yaml", done.stderr)

    def test_scenes_where_there_are_none_to_name(self):
        for name in ("contact", "wall", "growth", "only"):
            done = self.run_bench(name, "--quick", "--scenes", "scenes")
            self.assertEqual(done.returncode, 2, done.stderr)
            self.assertIn("--scenes has no effect", done.stderr)
        self.assertFalse(os.path.exists(self.at("bench")))

    def test_scenes_of_the_current_folder(self):
        os.makedirs(self.at("examples"))
        os.rename(self.at("scenes"), self.at("examples", "paper"))
        done = self.run_bench("fig6", "--quick", "--quiet")
        self.assertEqual((done.returncode, done.stdout), (0, ""), done.stderr)

    def test_a_wrong_scene(self):
        os.mkdir(self.at("scenes", "wrong"))
        with open(self.at("scenes", "wrong", "scene.yaml"), "w", encoding="utf-8") as file:
            file.write("nmm: 1\ndomian: []\n")
        done = self.run_bench("table1", "--quick", "--scenes", "scenes")
        self.assertEqual(done.returncode, 3)
        self.assertIn("wrong/scene.yaml:2:1: error:", done.stderr)

    def test_folder_that_cannot_be(self):
        with open(self.at("file"), "w", encoding="utf-8"):
            pass
        for path in ("file", "file/below", "/proc/nothing"):
            done = self.run_bench("wall", "--quick", "-o", path)
            self.assertEqual(done.returncode, 4, path)
            self.assertIn("file" if "file" in path else "/proc/nothing", done.stderr)

    def test_folder_without_rights(self):
        """Told at once, not after minutes of measuring."""
        def without_rights():
            if os.getuid() == 0:
                os.setuid(65534)
        os.chmod(self.folder, 0o755)
        os.mkdir(self.at("taken"), 0o555)
        try:
            done = subprocess.run([PROGRAM, "bench", "wall", "-o", "taken"], cwd=self.folder,
                                  preexec_fn=without_rights, capture_output=True, text=True,
                                  check=False, timeout=100)
        except PermissionError:
            self.skipTest("only the superuser may start the program here")
        self.assertEqual((done.returncode, done.stdout), (4, ""))
        self.assertIn("taken: Permission denied", done.stderr)

    def test_nothing_is_left_of_a_failure(self):
        os.mkdir(self.at("nothing"))
        done = self.run_bench("fig6", "--scenes", "nothing", "-o", "new")
        self.assertEqual(done.returncode, 4)
        self.assertFalse(os.path.exists(self.at("new")))

    def test_no_target(self):
        done = self.run_bench("fig7", "--quick", "--scenes", "scenes", "--device", "target")
        # A build with a target runs there.
        self.assertIn(done.returncode, (0, 5))
        if done.returncode == 5:
            self.assertIn("no target device", done.stderr)

    def test_interrupted(self):
        program = subprocess.Popen([PROGRAM, "bench", "contact", "--threads", "1"],
                                   cwd=self.folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                                   text=True)
        # Long before the largest wall.
        time.sleep(2)
        program.send_signal(signal.SIGINT)
        output, messages = program.communicate(timeout=200)
        self.assertEqual(program.returncode, 1, messages)
        self.assertIn("ending after this measurement", messages)
        self.assertIn("ended early", messages)
        if "Written" in output:
            self.check_pictures("contact", self.at("bench"))

    def test_interrupted_twice(self):
        # One measurement, of seconds.
        os.remove(self.at("scenes", "strut_whole", "scene.yaml"))
        program = subprocess.Popen([PROGRAM, "bench", "table1", "--scenes", "scenes"],
                                   cwd=self.folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                                   text=True)
        while not os.path.exists(self.at("bench")) and program.poll() is None:
            time.sleep(0.05)
        for _ in range(2):
            time.sleep(0.5)
            program.send_signal(signal.SIGINT)
        _, messages = program.communicate(timeout=200)
        self.assertEqual(program.returncode, 1, messages)
        self.assertNotIn("frame", messages)
        self.assertIn("ended at once; nothing of this measurement was written", messages)
        self.assertFalse(os.path.exists(self.at("bench")))

    def test_help(self):
        done = self.run_bench("--help")
        self.assertEqual(done.returncode, 0)
        for name in list(COLUMNS) + ["all"]:
            self.assertRegex(done.stdout, rf"(?m)^  {re.escape(name)} ")


def main():
    global PROGRAM
    PROGRAM = os.path.abspath(sys.argv[1])
    unittest.main(argv=[sys.argv[0]] + sys.argv[2:])


if __name__ == "__main__":
    main()
