#!/usr/bin/python3
# SPDX-License-Identifier: MIT
"""Checks of the source itself: is docs/contributing.md kept?

Usage: check.py NAME [--root FOLDER] [--library FILE] [--clang-format PROGRAM]

Each check prints what it found as FILE:LINE: MESSAGE and exits with 1 when there was anything.
`figures` only prints. tests/source/test_check.py breaks a copy of the tree on purpose and asks
each check to notice.
"""

import argparse
import os
import re
import shutil
import subprocess
import sys

FOLDERS = ["src", "offload", "include", "tests", "examples", "docs", "cmake"]
CODE = (".c", ".h", ".inl")


class Tree:
    """The files of the project, without builds and hidden folders."""

    def __init__(self, root):
        self.root = os.path.abspath(root)
        self.problems = []

    def files(self, endings, folders=FOLDERS):
        for folder in folders:
            for place, inner, names in os.walk(os.path.join(self.root, folder)):
                inner[:] = sorted(d for d in inner if not d.startswith((".", "__", "build")))
                for name in sorted(names):
                    if name.endswith(endings):
                        yield os.path.relpath(os.path.join(place, name), self.root)

    def text(self, path):
        with open(os.path.join(self.root, path), encoding="utf-8") as file:
            return file.read()

    def lines(self, path):
        return list(enumerate(self.text(path).split("\n"), 1))

    def problem(self, path, line, message):
        self.problems.append(f"{path}:{line}: {message}")


def markdown(tree):
    top = [n for n in sorted(os.listdir(tree.root)) if n.endswith(".md")]
    return top + list(tree.files((".md",)))


# --- The checks


def check_format(tree, given):
    """Every C file is as clang-format writes it; the field tables are aligned by hand."""
    paths = [p for p in tree.files(CODE) if not p.endswith("_fields.inl")]
    command = [given.clang_format, "--dry-run", "-Werror", "--style=file"] + paths
    done = subprocess.run(command, cwd=tree.root, stderr=subprocess.PIPE, text=True)
    for line in done.stderr.split("\n"):
        if "error:" in line:
            tree.problems.append(line)
    if done.returncode and not tree.problems:
        tree.problems.append(done.stderr)


def check_target(tree, _):
    """Device constructs are written in offload/ only, so that the seam stays one."""
    pattern = re.compile(r"pragma\s+omp\b.*\btarget\b|\bomp_target_\w+\s*\(")
    for path in tree.files(CODE, ["src", "include"]):
        for number, line in tree.lines(path):
            if pattern.search(line):
                tree.problem(path, number, "a device construct outside offload/")
    # All copies go through the words of offload/target.h, which count them.
    copies = re.compile(r"omp\s+target\s+(update|enter|exit|data)\b|omp_target_memcpy")
    for path in tree.files(CODE, ["offload"]):
        for number, line in tree.lines(path):
            if copies.search(line) and not path.endswith("offload/target.h"):
                tree.problem(path, number, "a transfer outside offload/target.h")


def read_floors(tree):
    """Floor -> (folder, floors it uses), in the order of src/CMakeLists.txt."""
    floors = {}
    text = re.sub(r"#.*", "", tree.text("src/CMakeLists.txt"))
    for body in re.findall(r"nmm_floor\(([^)]*)\)", text):
        words = body.split()
        name, uses, folder = words[0], [], "src/" + words[0]
        part = ""
        for word in words[1:]:
            if word in ("SOURCES", "USES", "LINKS", "DIRECTORY"):
                part = word
            elif part == "USES":
                uses.append(word)
            elif part == "DIRECTORY":
                folder = word.replace("${PROJECT_SOURCE_DIR}/", "")
        floors[name] = (folder, uses)
    return floors


def floors_below(floors, name):
    below, todo = set(), [name]
    while todo:
        for used in floors[todo.pop()][1]:
            if used not in below:
                below.add(used)
                todo.append(used)
    return below


def headers_of(tree, folder):
    return {os.path.relpath(p, folder) for p in tree.files((".h", ".inl"), [folder])}


def check_floor_order(tree, floors):
    seen = set()
    for name, (_, uses) in floors.items():
        for used in uses:
            if used not in seen:
                tree.problem("src/CMakeLists.txt", 1, f"floor {name} uses {used}, which is not below")
        seen.add(name)


def quoted_includes(tree, folder):
    """(file, line, header) for each header of ours; a header named by a path counts by its name.

    Left out: the public headers, and headers of tests (..._test.h), which stand behind an #ifdef.
    """
    for path in tree.files(CODE, [folder]):
        for number, line in tree.lines(path):
            found = re.match(r'\s*#\s*include\s+"([^"]+)"', line)
            if found and not found[1].startswith("nmm/") and not found[1].endswith("_test.h"):
                yield path, number, os.path.basename(found[1])


def check_includes(tree, _):
    """A file includes headers of its own floor and of floors below; floors have an order."""
    floors = read_floors(tree)
    check_floor_order(tree, floors)
    headers = {name: headers_of(tree, folder) for name, (folder, _) in floors.items()}
    allowed = {name: headers[name].union(*(headers[f] for f in floors_below(floors, name)))
               for name in floors}
    folders = {name: folder for name, (folder, _) in floors.items()}
    # The command line sees the public headers and its own.
    folders["cli"], allowed["cli"] = "src/cli", headers_of(tree, "src/cli")
    for name, folder in folders.items():
        for path, number, header in quoted_includes(tree, folder):
            if header not in allowed[name]:
                tree.problem(path, number, f"{header} is not of floor {name} nor of one below")
    check_cycles(tree, folders.values())


def check_cycles(tree, folders):
    """No header reaches itself through other headers."""
    graph = {}
    for folder in folders:
        for path in tree.files((".h",), [folder]):
            graph[os.path.basename(path)] = re.findall(r'#\s*include\s+"([^"]+)"', tree.text(path))
    for start in graph:
        reached, todo = set(), list(graph[start])
        while todo:
            header = todo.pop()
            if header not in reached:
                reached.add(header)
                todo += graph.get(header, [])
        if start in reached:
            tree.problem(start, 1, "this header includes itself through others")


def check_equations(tree, _):
    """Every equation that the code cites is numbered in the theory, no two have one number."""
    known, tags = set(), set()
    for path in tree.files((".md",), ["docs"]):
        if "theory" not in path:
            continue
        known |= set(re.findall(r"\\tag\{(\d+\.\d+[a-z]?)\}|\((\d+\.\d+[a-z]?)\)", tree.text(path)))
        for number, line in tree.lines(path):
            for tag in re.findall(r"\\tag\{(\d+\.\d+[a-z]?)\}", line):
                if tag in tags:
                    tree.problem(path, number, f"another equation is ({tag}), too")
                tags.add(tag)
    known = {a or b for a, b in known}
    cited = re.compile(r"eqs?\. \(?(\d+\.\d+[a-z]?)\)?")
    for path in tree.files(CODE, ["src", "offload", "include", "tests"]):
        for number, line in tree.lines(path):
            for equation in cited.findall(line):
                if equation not in known:
                    tree.problem(path, number, f"eq. ({equation}) is not in docs/theory")


def slug(heading):
    heading = re.sub(r"[`*]|\[([^]]*)\]\([^)]*\)", r"\1", heading.strip()).lower()
    return re.sub(r"[^\w\- ]", "", heading).replace(" ", "-")


def anchors(tree, path):
    text = re.sub(r"```.*?```", "", tree.text(path), flags=re.S)
    return {slug(h) for h in re.findall(r"^#+ (.*)$", text, flags=re.M)}


def check_links(tree, _):
    """Every relative link of the documents leads to a file, and to a heading where it names one."""
    for path in markdown(tree):
        text = re.sub(r"```.*?```", lambda m: "\n" * m[0].count("\n"), tree.text(path), flags=re.S)
        for number, line in enumerate(text.split("\n"), 1):
            for link in re.findall(r"\]\(<?([^)\s>]+)", re.sub(r"`[^`]*`", "", line)):
                if re.match(r"[a-z]+:", link):
                    continue
                name, _, anchor = link.partition("#")
                target = os.path.join(os.path.dirname(path), name) if name else path
                if not os.path.exists(os.path.join(tree.root, target)):
                    tree.problem(path, number, f"{link} is not there")
                elif anchor and target.endswith(".md") and anchor not in anchors(tree, target):
                    tree.problem(path, number, f"{link}: no such heading")


def check_licence(tree, _):
    """Every source file carries the licence tag near its top."""
    for path in tree.files(CODE + (".py", ".sh")):
        if "SPDX-License-Identifier: MIT" not in "\n".join(tree.text(path).split("\n")[:3]):
            tree.problem(path, 1, "no licence tag in the first three lines")


def public_names(tree):
    text = "\n".join(tree.text(path) for path in tree.files((".h",), ["include/nmm"]))
    return set(re.findall(r"^NMM_API [^;]*?\b(nmm_\w+)\(", text, flags=re.M))


def check_exports(tree, given):
    """The headers, docs/api.txt and the library name the same functions."""
    header = public_names(tree)
    listed = set(tree.text("docs/api.txt").split())
    for name in sorted(header ^ listed):
        tree.problem("docs/api.txt", 1, f"{name} is in one of the headers and this list only")
    if not given.library:
        return
    done = subprocess.run(["nm", "-D", "--defined-only", given.library], stdout=subprocess.PIPE,
                          text=True, check=True)
    # Names that begin with _ or . belong to the compiler's runtime (sanitizers, offload images).
    exported = {line.split()[-1] for line in done.stdout.split("\n") if line.strip()}
    exported = {n.split("@")[0] for n in exported if not n.startswith(("_", "."))}
    for name in sorted(exported ^ listed):
        where = "exported but not listed" if name in exported else "listed but not exported"
        tree.problem("docs/api.txt", 1, f"{name} is {where}")


def check_globals(tree, given):
    """The library has no variables that outlive a call: nothing of ours in .data or .bss."""
    done = subprocess.run(["objdump", "-t", given.library], stdout=subprocess.PIPE, text=True,
                          check=True)
    for line in done.stdout.split("\n"):
        found = re.match(r"\w+ .{6}O (\.t?data|\.t?bss)\s+\w+\s+(?:\.hidden )?(\S+)$", line)
        if found and not found[2].startswith(("_", ".", "completed.")):
            tree.problem(os.path.basename(given.library), 1,
                         f"{found[2]} is a variable in {found[1]}")


def check_fields(tree, _):
    """docs/fields.md is what docs/fields.py writes."""
    script = os.path.join(tree.root, "docs", "fields.py")
    done = subprocess.run([sys.executable, script, "--print"], stdout=subprocess.PIPE, text=True,
                          check=True)
    if done.stdout != tree.text("docs/fields.md"):
        tree.problem("docs/fields.md", 1, "not up to date: run docs/fields.py")


def check_words(tree, _):
    """What the code does without: goto, alloca, unbounded string functions, trailing notes to self."""
    pattern = re.compile(r"^\s*goto\s|\balloca\(|\b(sprintf|strcpy|strcat|gets)\(|\bTODO\b|\bFIXME\b")
    for path in tree.files(CODE, ["src", "offload", "include"]):
        for number, line in tree.lines(path):
            if pattern.search(line):
                tree.problem(path, number, f"not used here: {line.strip()}")


# --- Figures


def functions(tree, path):
    """(first line, lines, parameters, nesting) of each function, from the shape of formatted code."""
    lines = tree.text(path).split("\n")
    start, head = 0, ""
    for number, line in enumerate(lines):
        if re.match(r"[A-Za-z].*\(", line) and not line.endswith(";"):
            start, head = number, ""
        head += line if len(head) < 1000 else ""
        if line == "}" and start and "(" in head:
            inside = lines[start:number]
            ifs = [x for x in inside if re.match(r" +(for|if|while|switch|do)\b|( +\} else)", x)]
            depth = max(((len(x) - len(x.lstrip())) // 4 for x in ifs), default=0)
            listed = head[head.index("(") + 1:head.index(")")]
            yield start + 1, number - start + 1, listed.count(",") + 1, depth
            start = 0


def show_figures(tree, _):
    """Print lengths, parameters and nesting beside what docs/contributing.md aims for."""
    paths = [p for p in tree.files((".c", ".h", ".inl"), ["src", "offload", "include"])]
    sizes = sorted(len(tree.text(p).split("\n")) - 1 for p in paths)
    found = [(n, p, line, par, deep) for p in paths for line, n, par, deep in functions(tree, p)]
    lengths = sorted(f[0] for f in found)
    pick = lambda values, part: values[min(len(values) - 1, int(part * len(values)))]
    print(f"files      {len(sizes):4}: median {pick(sizes, .5)}, 90 % {pick(sizes, .9)}, "
          f"longest {sizes[-1]}   (aim: 200, 400, 600)")
    print(f"functions  {len(lengths):4}: median {pick(lengths, .5)}, 90 % {pick(lengths, .9)}, "
          f"longest {lengths[-1]}   (aim: 12, 40, 60)")
    print(f"parameters: most {max(f[3] for f in found)} (aim: 6); "
          f"nesting: deepest {max(f[4] for f in found)} (aim: 3)")
    for n, path, line, par, deep in sorted(found, reverse=True):
        if n > 60 or par > 6 or deep > 4:
            print(f"  {path}:{line}: {n} lines, {par} parameters, nesting {deep}")


CHECKS = {
    "format": check_format, "target": check_target, "includes": check_includes,
    "equations": check_equations, "links": check_links, "licence": check_licence,
    "exports": check_exports, "globals": check_globals, "fields": check_fields,
    "words": check_words, "figures": show_figures,
}


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("name", choices=CHECKS)
    parser.add_argument("--root", default=os.path.join(os.path.dirname(__file__), "..", ".."))
    parser.add_argument("--library", help="the built libnmm.so")
    parser.add_argument("--clang-format", help="the program",
                        default=shutil.which("clang-format-14") or "clang-format")
    given = parser.parse_args()
    tree = Tree(given.root)
    CHECKS[given.name](tree, given)
    for problem in tree.problems:
        print(problem)
    return 1 if tree.problems else 0


if __name__ == "__main__":
    sys.exit(main())
