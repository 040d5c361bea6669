#!/usr/bin/python3
# SPDX-License-Identifier: MIT
"""Full disks, forbidden folders and missing files: run, plot and export end with status 4, say
which file and why, and leave no part of a file.

    files.py PROGRAM SCENE
"""

import os
import resource
import subprocess
import sys
import tempfile
import unittest

PROGRAM, SCENE = "", ""
NOBODY = 65534


def little_room():
    """No file beyond 8 KiB, as when a quota is used up."""
    resource.setrlimit(resource.RLIMIT_FSIZE, (8192, 8192))


def without_rights():
    """Permissions do not bind the superuser."""
    if os.getuid() == 0:
        os.setuid(NOBODY)


class Files(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = folder.name
        os.chmod(self.folder, 0o755)
        done = self.nmm(self.run_to("made.vtkhdf"))
        self.assertEqual(done.returncode, 0, done.stderr)
        with open(self.at("file"), "w", encoding="utf-8"):
            pass
        os.mkdir(self.at("taken"))
        self.before = self.listing()

    def at(self, name):
        return os.path.join(self.folder, name)

    def listing(self):
        return sorted(os.path.join(path, name) for path, _, names in os.walk(self.folder)
                      for name in names)

    def nmm(self, words, **more):
        return subprocess.run([PROGRAM, *words], cwd=self.folder, capture_output=True, text=True,
                              check=False, **more)

    @staticmethod
    def run_to(path):
        return ["run", SCENE, "-q", "--threads", "1", "--set", "time.dt=1e-4", "--set",
                "time.end=3e-4", "--set", "output.every=0", "-o", path]

    @staticmethod
    def writers(path):
        """Each command that writes, told to write `path`."""
        yield Files.run_to(path + ".vtkhdf")
        for kind in ".png", ".svg", ".pdf":
            yield ["plot", "made.vtkhdf", "-o", path + kind]

    def refused(self, words, reason, **more):
        done = self.nmm(words, **more)
        self.assertEqual(done.returncode, 4, f"{words}: {done.stderr}")
        self.assertRegex(done.stderr, rf"^error: cannot .*: {reason}[^\n]*\n$")
        self.assertEqual((self.listing(), done.stdout), (self.before, ""), words)

    @unittest.skipIf("TSAN_OPTIONS" in os.environ, "libomp and TSan die of a quota")
    def test_full_disk(self):
        for words in [*self.writers("new"), ["export", "made.vtkhdf", "--vtu", "taken"]]:
            self.refused(words, "File too large", preexec_fn=little_room)

    def test_no_such_folder(self):
        for words in self.writers("none/new"):
            self.refused(words, "No such file or directory")
        self.refused(["export", "made.vtkhdf", "--vtu", "none/new"], "No such file or directory")

    def test_file_where_a_folder_must_be(self):
        for words in self.writers("file/new"):
            self.refused(words, "Not a directory")
        for folder in "file", "file/new":
            self.refused(["export", "made.vtkhdf", "--vtu", folder], "Not a directory")

    def test_folder_where_a_file_must_be(self):
        for name in "new.vtkhdf", "new.png", "new.svg", "new.pdf":
            os.mkdir(self.at(name))
        for words in self.writers("new"):
            self.refused(words, "Is a directory")

    def test_forbidden_folder(self):
        if os.getuid() == 0 and self.nmm(["--version"], preexec_fn=without_rights).returncode != 0:
            self.skipTest("only the superuser may start the program here")
        os.chmod(self.at("taken"), 0o555)
        for words in self.writers("taken/new"):
            self.refused(words, "Permission denied", preexec_fn=without_rights)
        for folder in "taken", "taken/new":
            self.refused(["export", "made.vtkhdf", "--vtu", folder], "Permission denied",
                         preexec_fn=without_rights)

    def test_missing_and_forbidden_files(self):
        readers = ["info"], ["plot"], ["export", "--vtu", "taken"]
        for words in [*readers, ["check"], ["run"]]:
            self.refused([*words, "none"], "No such file or directory")
            self.refused([*words, "taken"], "Is a directory")
        if os.getuid() != 0:
            os.chmod(self.at("made.vtkhdf"), 0)
            for words in readers:
                self.refused([*words, "made.vtkhdf"], "Permission denied")


if __name__ == "__main__":
    PROGRAM, SCENE = (os.path.abspath(word) for word in sys.argv[1:3])
    unittest.main(argv=["files.py", *sys.argv[3:]])
