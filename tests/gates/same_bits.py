#!/usr/bin/python3
# SPDX-License-Identifier: MIT
"""One scene gives the same bits for any number of threads, and on a device.

    same_bits.py threads PROGRAM SCENE...
    same_bits.py device PROGRAM SOURCE BUILD REASON SCENE...

Each scene is run for its first millisecond, and the whole results of `nmm run --json` are compared,
numbers and state hash, but for places and times.

threads: PROGRAM with 1, 2 and 3 threads.
device: the preset fake-device is configured in BUILD and its program built. Its runs with
--device target (which must say that they were on a device) and --device host must equal those of
PROGRAM, which another compiler built. REASON: why there is no such device here, for exit status 77;
empty where it is.
"""

import json
import os
import subprocess
import sys
import tempfile

SHORT = ["--set", "time.dt=1e-4", "--set", "time.end=1e-3"]
PLACES_AND_TIMES = ("output", "wall_seconds", "phase_seconds")

n_failed = 0


def run(program, scene, *words):
    """Result of `nmm run` without places and times; the solver apart from where it ran."""
    # Threads that spin would wait for one another where cores are shared.
    environment = {**os.environ, "OMP_WAIT_POLICY": "passive"}
    with tempfile.TemporaryDirectory() as folder:
        command = [program, "run", scene, "--json", "-q", "-o", os.path.join(folder, "run.vtkhdf")]
        done = subprocess.run(command + SHORT + list(words), env=environment, text=True,
                              capture_output=True, check=False)
    if done.returncode != 0:
        sys.exit(f"{' '.join(command)}: exit status {done.returncode}\n{done.stderr}")
    result = json.loads(done.stdout)
    for name in PLACES_AND_TIMES:
        del result[name]
    place = result["solver"].pop("device"), result["solver"].pop("on_device")
    return result, place


def compare(what, result, expected):
    global n_failed
    differing = [name for name in expected if result.get(name) != expected[name]]
    n_failed += len(differing) > 0
    print(f"{'FAILED' if differing else 'ok    '} {what}: {result['state_hash']}")
    for name in differing:
        print(f"       {name}: {result.get(name)}, expected {expected[name]}")


def head(scene, result):
    print(f"{os.path.relpath(scene)}: {result['unknowns']} unknowns, {result['contacts']} contacts, "
          f"{result['steps']} steps, {result['solver']['method']}")


def threads(program, *scenes):
    for scene in scenes:
        expected, _ = run(program, scene, "--threads", "1")
        head(scene, expected)
        for n_thread in "2", "3":
            compare(f"{n_thread} threads", run(program, scene, "--threads", n_thread)[0], expected)


def build_device_program(source, build):
    cmake = os.environ.get("CMAKE", "cmake")
    for words in (["--preset", "fake-device", "-B", build], ["--build", build, "--target", "nmm"]):
        subprocess.run([cmake, *words], cwd=source, check=True, stdout=subprocess.DEVNULL)
    return os.path.join(build, "nmm")


def device(program, source, build, reason, *scenes):
    global n_failed
    if reason:
        print(f"skipped: {reason}")
        sys.exit(77)
    device_program = build_device_program(source, build)
    for scene in scenes:
        for method in "pcg", "jacobi":
            choice = ["--set", f"solver.method={method}"]
            expected, _ = run(program, scene, "--device", "host", "--threads", "1", *choice)
            head(scene, expected)
            for where in "target", "host":
                result, place = run(device_program, scene, "--device", where, *choice)
                compare(f"{place[0]}, on a device: {place[1]}", result, expected)
                if place != (where, where == "target"):
                    print(f"FAILED asked for {where}")
                    n_failed += 1


if __name__ == "__main__":
    {"threads": threads, "device": device}[sys.argv[1]](*sys.argv[2:])
    print(f"{n_failed} failed")
    sys.exit(n_failed > 0)
