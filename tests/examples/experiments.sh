#!/bin/sh
# SPDX-License-Identifier: MIT
#
# Makes the tables and pictures of docs/experiments.md and docs/only.md: builds the program and
# measures, on a machine that does nothing else. Says how long each experiment took; the page tells
# how long all took.
#
# Usage: sh tests/examples/experiments.sh [BUILD_FOLDER] [-- OPTIONS of experiments.py, see its --help]

set -e
root=$(cd "$(dirname "$0")/../.." && pwd)
. "$root/cmake/packages.sh"

build="$root/build/experiments"
if [ $# -gt 0 ] && [ "$1" != -- ]; then
    build=$1
    shift
fi
[ "$1" = -- ] && shift

need_packages $packages_build python3
cmake -S "$root" -B "$build" -G Ninja -D CMAKE_BUILD_TYPE=Release -D NMM_BUILD_TESTS=OFF >/dev/null
cmake --build "$build" --target nmm
exec python3 "$root/tests/examples/${NMM_PAGE:-experiments}.py" "$build/nmm" "$@"
