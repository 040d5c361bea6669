#!/usr/bin/python3
# SPDX-License-Identifier: MIT
"""The whole program under valgrind's memcheck: no wrong access, no use of what was never set, no
block that stays.

    memcheck.py PROGRAM SOURCE

Every wrong scene of the corpus is checked, a few scenes are run, with success and without, and
their files are read, drawn and exported, whole and damaged. What other libraries keep is listed in
others.supp. Exit status 77: valgrind is not installed.
"""

import os
import shutil
import subprocess
import sys
import tempfile

ERROR = 99
SHORT = ["--set", "time.dt=1e-4", "--set", "time.end=5e-4"]


def memcheck_words():
    supp = os.path.join(os.path.dirname(os.path.abspath(__file__)), "others.supp")
    return ["valgrind", "-q", f"--error-exitcode={ERROR}", "--leak-check=full",
            "--show-leak-kinds=all", "--errors-for-leak-kinds=all", f"--suppressions={supp}"]


def damage(folder):
    """A run file with its second half cut off, and one with other bytes in its middle."""
    with open(os.path.join(folder, "strut.vtkhdf"), "rb") as file:
        whole = file.read()
    half = len(whole) // 2
    with open(os.path.join(folder, "half.vtkhdf"), "wb") as file:
        file.write(whole[:half])
    with open(os.path.join(folder, "bytes.vtkhdf"), "wb") as file:
        file.write(whole[:half] + bytes(range(256)) * 8 + whole[half + 2048:])


def cases(source, folder):
    """(expected exit statuses, words)."""
    def example(name):
        return os.path.join(source, "examples", name, "scene.yaml")

    strut = [*SHORT, "-o", "strut.vtkhdf", example("strut")]
    yield (0,), ["run", "--json", "--threads", "1", *strut]
    yield (0,), ["run", "--threads", "2", *strut]
    for method in "jacobi", "sor":
        yield (0,), ["run", "--set", f"solver.method={method}", *strut]
    for name in "arch", "incline", "slope", "wall":
        yield (0,), ["run", *SHORT, "-o", name + ".vtkhdf", example(name)]
        yield (0,), ["check", example(name)]
    yield (1,), ["run", *strut, "--set", "time.max_move=1e-12", "--set", "time.dt_min=5e-5"]
    yield (3,), ["run", *strut, "--set", "time.ende=1"]
    yield (4,), ["run", *SHORT, "-o", "none/a.vtkhdf", example("strut")]
    yield (5,), ["run", *strut, "--device", "target"]
    yield (0,), ["run", *strut]
    yield (0,), ["info", "strut.vtkhdf"]
    yield (0,), ["info", "strut.vtkhdf", "--json"]
    for picture in "a.png", "a.svg", "a.pdf":
        yield (0,), ["plot", "slope.vtkhdf", "-o", picture]
    yield (0,), ["export", "strut.vtkhdf", "--vtu", "vtu"]
    damage(folder)
    for name in "half.vtkhdf", "bytes.vtkhdf":
        for words in ["info"], ["plot"], ["export", "--vtu", "vtu"]:
            yield (0, 3), [*words, name]
    bad = os.path.join(source, "tests", "scene", "bad")
    for name in sorted(os.listdir(bad)):
        if name.endswith(".yaml"):
            yield (3,), ["check", os.path.join(bad, name)]


def main(program, source):
    if shutil.which("valgrind") is None:
        print("skipped: valgrind is not installed")
        return 77
    environment = {**os.environ, "OMP_WAIT_POLICY": "passive"}
    n_case, n_failed = 0, 0
    with tempfile.TemporaryDirectory() as folder:
        for expected, words in cases(source, folder):
            done = subprocess.run([*memcheck_words(), program, *words], cwd=folder, check=False,
                                  env=environment, capture_output=True)
            n_case += 1
            if done.returncode not in expected:
                n_failed += 1
                print(f"FAILED nmm {' '.join(words)}: exit status {done.returncode}, "
                      f"expected {expected}")
                print(done.stderr.decode("utf-8", "replace")[:6000])
    print(f"{n_case} commands, {n_failed} failed")
    return n_failed > 0 or n_case < 100


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
