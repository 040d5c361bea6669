# SPDX-License-Identifier: MIT
"""Good scenes, examples and the scenes of docs/format.md fit docs/scene.schema.json; bad ones whose
mistake a schema can see do not. Exit status 77 (skipped) without python3-jsonschema, python3-yaml."""

import json
import pathlib
import re
import sys

try:
    import jsonschema
    import yaml
except ImportError as error:
    print(f"skipped: {error}; install python3-jsonschema and python3-yaml")
    sys.exit(77)

ROOT = pathlib.Path(sys.argv[1])
HERE = ROOT / "tests" / "scene"

# What only the program can see: names that nothing bears, and YAML 1.1 as Python reads it.
BEYOND = {"material_unknown.yaml", "interface_unknown.yaml", "support_block_unknown.yaml",
          "material_ambiguous.yaml", "merge_key.yaml", "underscore.yaml"}


def complaints(validator, text):
    try:
        scene = yaml.safe_load(text)
    except (yaml.YAMLError, UnicodeDecodeError, ValueError):
        return ["not YAML"]
    return [error.message for error in validator.iter_errors(scene)]


def main():
    schema = json.loads((ROOT / "docs" / "scene.schema.json").read_text())
    jsonschema.Draft7Validator.check_schema(schema)
    validator = jsonschema.Draft7Validator(schema)
    failed = 0
    good = sorted((HERE / "good").glob("*.yaml"))
    examples = [p for p in (ROOT / "examples").rglob("*.yaml") if "nmm:" in p.read_text()]
    for path in good + sorted(examples):
        for message in complaints(validator, path.read_bytes()):
            print(f"{path}: {message[:200]}")
            failed += 1
    # The pieces shown in the documentation, on top of a whole scene.
    whole = yaml.safe_load((HERE / "good" / "slope.yaml").read_text())
    pieces = re.findall(r"```yaml\n(.*?)```", (ROOT / "docs" / "format.md").read_text(), re.S)
    for piece in pieces:
        for error in validator.iter_errors({**whole, **yaml.safe_load(piece)}):
            print(f"docs/format.md: {error.message[:200]}\n{piece}")
            failed += 1
    # Unknown and missing keys, wrong types, words and ranges must be seen by the schema as well.
    words = ("unknown key", "missing", "must be a", "one of", "must be above", "must be at least",
             "must be from", "needs one of", "besides", "MPa is")
    seen = missed = 0
    for line in (HERE / "bad" / "index.txt").read_text().splitlines():
        if line.startswith("#"):
            continue
        name, _, message = line.split(" ", 2)
        found = complaints(validator, (HERE / "bad" / name).read_bytes())
        seen += 1 if found else 0
        key = re.fullmatch(r"'\w+'", message) or any(w in message for w in words)
        if not found and key and "after" not in message and name not in BEYOND:
            print(f"{name}: the schema sees nothing; the program: {message}")
            missed += 1
    print(f"{len(good)} good scenes, {len(examples)} examples, {len(pieces)} pieces, "
          f"{seen} mistakes seen by the schema too")
    return 1 if failed or missed or seen < 100 else 0


if __name__ == "__main__":
    sys.exit(main())
