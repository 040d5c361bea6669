#!/bin/sh
# SPDX-License-Identifier: MIT
#
# Makes the tables and pictures of docs/solvers.md: installs what is missing, builds, measures.
#
# Usage: sh tests/solve/peers/run.sh [BUILD_FOLDER] [-- OPTIONS of bench.py, see its --help]

set -e
root=$(cd "$(dirname "$0")/../../.." && pwd)
. "$root/cmake/packages.sh"

build="$root/build/peers"
if [ $# -gt 0 ] && [ "$1" != -- ]; then
    build=$1
    shift
fi
[ "$1" = -- ] && shift

need_packages $packages_build $packages_bench
cmake -S "$root" -B "$build" -G Ninja -D CMAKE_BUILD_TYPE=Release -D NMM_PEERS=ON >/dev/null
cmake --build "$build" --target bench_solvers
# Debian's own Python, which has matplotlib.
exec /usr/bin/python3 "$root/tests/solve/peers/bench.py" --build "$build" "$@"
