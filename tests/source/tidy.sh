#!/bin/sh
# SPDX-License-Identifier: MIT
#
# clang-tidy on src and offload with .clang-tidy. Flags that only gcc knows are taken out first.
#
# Usage: tidy.sh RUN_CLANG_TIDY BUILD_FOLDER SOURCE_FOLDER

set -eu
commands=$(mktemp -d)
trap 'rm -rf "$commands"' EXIT
sed 's/-foffload=disable//g' "$2/compile_commands.json" >"$commands/compile_commands.json"
"$1" -quiet -p "$commands" "$3/(src|offload)/.*" >"$commands/log" 2>&1 && exit 0
sed 's|\x1b\[[0-9;]*m||g' "$commands/log" | grep -E 'error:|warning:' | sort -u
exit 1
