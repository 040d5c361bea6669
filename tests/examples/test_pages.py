#!/usr/bin/python3
# SPDX-License-Identifier: MIT
"""The programs that make docs/experiments.md, only.md, performance.md and trade.md, in short forms on
copies of the pages: the parts they own are written, nothing else is touched.

Usage: test_pages.py PROGRAM [unittest arguments]
"""

import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

import experiments
import pages
import performance
import trade

PROGRAM = ""
HERE = os.path.dirname(os.path.abspath(__file__))
PART = re.compile(r"<!-- bench: (\w+) -->\n(.*?)<!-- end -->", re.S)


class Pages(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = folder.name
        for name in ("experiments.md", "only.md", "performance.md", "trade.md"):
            shutil.copy(os.path.join(pages.ROOT, "docs", name), self.folder)

    def read(self, name):
        with open(os.path.join(self.folder, name), encoding="utf-8") as file:
            return file.read()

    def make(self, script, *words):
        done = subprocess.run([sys.executable, os.path.join(HERE, script), PROGRAM, "--quick", *words],
                              capture_output=True, text=True, check=False)
        self.assertEqual(done.returncode, 0, done.stderr)
        return done.stdout

    def check_page(self, name, before, made):
        """The text around the parts stays; the parts made are tables now."""
        after = self.read(name)
        self.assertEqual(PART.sub("", after), PART.sub("", before))
        was, parts = dict(PART.findall(before)), dict(PART.findall(after))
        for part, body in parts.items():
            if part in made:
                self.assertRegex(body, r"(?m)^\|--[-:]")
                self.assertNotEqual(body, was[part])
                # A cell for each column, in every row.
                widths = {len(line.split(" | ")) for line in body.splitlines()
                          if line.startswith("| ")}
                self.assertEqual(len(widths), 1)
            elif part != "gpu":
                self.assertEqual(body, was[part])

    def test_experiments(self):
        before, only = self.read("experiments.md"), self.read("only.md")
        said = self.make("experiments.py", "--docs", self.folder, "--only", "fig6", "--only", "wall",
                         "--only", "only")
        self.assertRegex(said, r"fig6 \.\.\. .* s\nwall \.\.\. .* s\nonly \.\.\. .* s\nall: .* s\n")
        self.check_page("experiments.md", before, ("fig6", "wall"))
        self.check_page("only.md", only, ("only",))
        for picture in ("experiments-fig6.svg", "experiments-wall.svg", "only.svg"):
            self.assertTrue(os.path.exists(os.path.join(self.folder, "pictures", picture)))

    def test_performance(self):
        before = self.read("performance.md")
        self.make("performance.py", "--repeat", "1", "--threads", "1", "--part", "wall", "--page",
                  os.path.join(self.folder, "performance.md"))
        self.check_page("performance.md", before, ("wall",))

    def test_trade(self):
        before = self.read("trade.md")
        self.make("trade.py", "--docs", self.folder, "--only", "cantilever")
        self.check_page("trade.md", before, ("cantilever",))
        # What is named reaches the error wanted.
        body = dict(PART.findall(self.read("trade.md")))["cantilever"]
        named = re.search(r"Named: `(.*)`", body)[1].replace("--set ", "")
        error = re.search(rf"(?m)^\| `{re.escape(named)}` .*\| ([\d.]+) \| yes \|$", body)[1]
        self.assertLess(float(error), 1)

    def test_orders_at_equal_error(self):
        before = self.read("trade.md")
        self.make("trade.py", "--docs", self.folder, "--only", "orders_cantilever")
        self.check_page("trade.md", before, ("orders_cantilever",))
        row = lambda error, time: {"end": "completed", "error": error, "seconds": time, "unknowns": 8}
        rows = [row(2, 0.1), row(0.9, 0.7), row(0.5, 0.5), {"end": "took longer", "error": None}]
        self.assertEqual(trade.quickest(rows, 1), ["8", "0.5"])
        self.assertEqual(trade.quickest(rows, 0.1), ["", ""])

    def test_pages_have_a_place_for_everything(self):
        parts = [set(dict(PART.findall(self.read(name)))) for name in ("experiments.md", "only.md")]
        self.assertEqual(parts[0] | parts[1], set(experiments.NAMES) | {"gpu", "machine"})
        self.assertEqual(set(dict(PART.findall(self.read("performance.md")))),
                         set(performance.PARTS) | {"machine"})
        self.assertEqual(set(dict(PART.findall(self.read("trade.md")))),
                         set(trade.PARTS) | {"machine"})

    def test_what_a_gpu_measured_is_shown(self):
        page = os.path.join(self.folder, "experiments.md")
        self.assertEqual(experiments.show_gpu(page), "Not run on a GPU.")
        head = ("scene,times,order,device,threads,method,sor_ms,serial_ms,ms,speedup_over_sor,"
                "speedup_over_serial,sor_iterations,iterations,end\n")
        host = "slope,1,770,A processor,1,direct,12,1,1,12,1,2000,1,converged\n"
        there = "slope,1,770,A GPU,,pcg cluster,12,1,0.5,24,2,2000,40,converged\n"
        for rows, shown in ((host, False), (host + there, True)):
            with open(os.path.join(self.folder, "experiments-gpu.csv"), "w", encoding="utf-8") as file:
                file.write(head + rows)
            text = experiments.show_gpu(page)
            self.assertEqual("| A GPU | slope | 770 | pcg cluster | 40 | 12 | 1 | 0.5 | 24 | 2 |" in text,
                             shown)
            self.assertNotIn("A processor |", text)

    def test_list_of_the_papers_scenes(self):
        """Blocks and unknowns of each, as `nmm check` counts them."""
        folder = os.path.join(pages.ROOT, "examples", "paper")
        with open(os.path.join(folder, "README.md"), encoding="utf-8") as file:
            rows = re.findall(r"(?m)^\| \[.*\]\((\w+)/README.md\) \| (\d+) \| (\d+) \|", file.read())
        self.assertEqual({name for name, _, _ in rows},
                         {name for name in os.listdir(folder) if not name.endswith(".md")})
        self.assertEqual(len(rows), 15)
        for name, *numbers in rows:
            done = subprocess.run([PROGRAM, "check", os.path.join(folder, name, "scene.yaml"),
                                   "--json"], capture_output=True, text=True, check=True)
            found = json.loads(done.stdout)
            self.assertEqual([str(found["blocks"]), str(found["unknowns"])], numbers, name)

    def test_numbers(self):
        for value, digits, text in ((None, 3, ""), (3.0, 3, "3"), (0.07063, 3, "0.0706"),
                                    (12.345, 3, "12.3"), (1234.5, 3, "1234"), (4.3e-9, 2, "4.3e-09")):
            self.assertEqual(pages.number(value, digits), text)
        with self.assertRaises(SystemExit):
            pages.replace_part("<!-- bench: a -->\n<!-- end -->\n", "b", "")


if __name__ == "__main__":
    PROGRAM = os.path.abspath(sys.argv[1])
    unittest.main(argv=[sys.argv[0]] + sys.argv[2:])
