#!/usr/bin/python3
# SPDX-License-Identifier: MIT
"""Can the checks of check.py fail? Each gets a small tree, once whole and once with one fault.

Usage: test_check.py [--compiler CC]      (without a compiler: no faults in a built library)
"""

import os
import subprocess
import sys
import tempfile

CHECK = os.path.join(os.path.dirname(os.path.abspath(__file__)), "check.py")
TAG = "// SPDX-License-Identifier: MIT\n"

WHOLE = {
    ".clang-format": "BasedOnStyle: LLVM\nIndentWidth: 4\n",
    "README.md": "# Title\n\nSee [the page](docs/theory/one.md#first-part).\n",
    "docs/theory/one.md": "# First part\n\n$$x = y \\tag{1.2}$$\n",
    "docs/api.txt": "nmm_open\n",
    "docs/fields.md": "page\n",
    "docs/fields.py": "# SPDX-License-Identifier: MIT\nprint('page')\n",
    "include/nmm/nmm.h": TAG + "NMM_API int nmm_open(int n);\n",
    "src/CMakeLists.txt": "nmm_floor(low SOURCES low.c)\nnmm_floor(high SOURCES high.c USES low)\n",
    "src/low/low.h": TAG + "int low(void);\n",
    "src/low/low.c": TAG + '#include "low.h"\n\n// By eq. (1.2).\nint low(void) { return 1; }\n',
    "src/high/high.h": TAG + '#include "low.h"\n',
    "src/high/high.c": TAG + '#include "high.h"\n',
}

FAULTS = {
    "format": ("src/low/low.c", TAG + "int  low( void ) { return 1; }\n"),
    "target": ("src/low/low.c", TAG + "#pragma omp target\n"),
    "includes": ("src/low/low.c", TAG + '#include "high.h"\n'),
    "equations": ("src/low/low.c", TAG + "// By eq. (1.3).\n"),
    "links": ("README.md", "See [the page](docs/theory/two.md).\n"),
    "licence": ("src/low/low.c", "int low(void) { return 1; }\n"),
    "exports": ("docs/api.txt", "nmm_open\nnmm_close\n"),
    "fields": ("docs/fields.md", "another page\n"),
    "words": ("src/low/low.c", TAG + "// TODO\n"),
}
MORE_FAULTS = [
    ("equations", "docs/theory/one.md", "# First part\n\n$$x = y \\tag{1.2}$$\n\n$$z = y \\tag{1.2}$$\n"),
    ("links", "README.md", "See [the page](docs/theory/one.md#second-part).\n"),
    ("includes", "src/low/low.h", TAG + '#include "low.h"\n'),
    ("includes", "src/CMakeLists.txt", "nmm_floor(high SOURCES high.c USES low)\nnmm_floor(low SOURCES low.c)\n"),
    ("words", "src/low/low.c", TAG + "int f(char *a) {\n    goto end;\n}\n"),
]


def write(root, path, text):
    full = os.path.join(root, path)
    os.makedirs(os.path.dirname(full), exist_ok=True)
    with open(full, "w", encoding="utf-8") as file:
        file.write(text)


def build(root, compiler, code):
    write(root, "library.c", code)
    library = os.path.join(root, "library.so")
    subprocess.run([compiler, "-shared", "-fPIC", "-fvisibility=hidden", "-o", library,
                    os.path.join(root, "library.c")], check=True)
    return library


def check(name, *extra, compiler=None, code=None):
    """Exit status of a check on the whole tree with some files replaced, and what it printed."""
    with tempfile.TemporaryDirectory() as root:
        for folder in ("offload", "tests", "examples", "cmake"):
            os.makedirs(os.path.join(root, folder))
        for path, text in {**WHOLE, **dict(extra)}.items():
            write(root, path, text)
        command = [sys.executable, CHECK, name, "--root", root]
        if compiler:
            command += ["--library", build(root, compiler, code)]
        done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                              text=True)
        return done.returncode, done.stdout


VISIBLE = '__attribute__((visibility("default")))'
LIBRARIES = [
    ("exports", 0, VISIBLE + " int nmm_open(int n) { return n; }"),
    ("exports", 1, VISIBLE + " int nmm_open(int n) { return n; } " + VISIBLE + " int f(void) { return 1; }"),
    ("exports", 1, "int nmm_open(int n) { return n; }"),
    ("globals", 0, "static const int table[2] = {1, 2}; const int *f(void) { return table; }"),
    ("globals", 1, "static int count; int *f(void) { return &count; }"),
    ("globals", 1, "static int count = 3; int *f(void) { return &count; }"),
]


def check_libraries(compiler):
    failed = 0
    for name, wanted, code in LIBRARIES:
        status, output = check(name, compiler=compiler, code=code)
        if status != wanted or "Traceback" in output:
            failed += 1
            print(f"{name}: exit status {status}, wanted {wanted}, for\n{code}\n{output}")
    return failed


def main():
    failed = check_libraries(sys.argv[2]) if sys.argv[1:2] == ["--compiler"] else 0
    for name in FAULTS:
        status, output = check(name)
        if status != 0:
            failed += 1
            print(f"{name}: complains about a whole tree:\n{output}")
    for name, path, text in [(n, *f) for n, f in FAULTS.items()] + MORE_FAULTS:
        status, output = check(name, (path, text))
        if status != 1 or "Traceback" in output:
            failed += 1
            print(f"{name}: does not see the fault in {path}:\n{text}{output}")
    print(f"{len(FAULTS) + len(MORE_FAULTS)} faults planted, {failed} wrong answers")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
