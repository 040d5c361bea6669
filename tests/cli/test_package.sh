#!/bin/sh
# SPDX-License-Identifier: MIT
#
# What an installed nmm is worth to others: build it as users do, warnings as errors, install into
# an empty folder, move that folder, then use it by command, by find_package and by pkg-config.
#
# Usage: test_package.sh CMAKE SOURCE_FOLDER COMPILER

set -eu
cmake=$1 source=$2 compiler=$3
here=$(cd "$(dirname "$0")" && pwd)
place=$(mktemp -d)
trap 'rm -rf "$place"' EXIT
CC=$compiler
export CC

"$cmake" -S "$source" -B "$place/release" -G Ninja -DCMAKE_BUILD_TYPE=Release -DNMM_WERROR=ON \
    -DNMM_BUILD_TESTS=OFF >/dev/null
"$cmake" --build "$place/release" >"$place/log" || { cat "$place/log" && exit 1; }
"$cmake" --install "$place/release" --prefix "$place/first" >/dev/null
mv "$place/first" "$place/nmm"
rm -r "$place/release"

"$place/nmm/bin/nmm" --version
# The scenes of the experiments are found where they were installed.
(cd "$place" && nmm/bin/nmm bench fig6 --quick --quiet && test -s bench/fig6.svg)

"$cmake" -S "$here/consumer" -B "$place/build" -DCMAKE_PREFIX_PATH="$place/nmm" >/dev/null
"$cmake" --build "$place/build" >/dev/null
"$place/build/consumer" "$here/consumer/fall.yaml"

PKG_CONFIG_PATH=$(dirname "$(find "$place/nmm" -name nmm.pc)")
export PKG_CONFIG_PATH
"$CC" "$here/consumer/consumer.c" -o "$place/other" $(pkg-config --cflags --libs nmm)
LD_LIBRARY_PATH=$(pkg-config --variable=libdir nmm) "$place/other" "$here/consumer/fall.yaml"
