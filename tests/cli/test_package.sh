#!/bin/sh
# SPDX-License-Identifier: MIT
#
# What an installed nmm is worth to others: install into an empty folder, move that folder, then use
# it by command, by find_package and by pkg-config.
#
# Usage: test_package.sh CMAKE BUILD_FOLDER COMPILER

set -eu
cmake=$1 build=$2 compiler=$3
here=$(cd "$(dirname "$0")" && pwd)
place=$(mktemp -d)
trap 'rm -rf "$place"' EXIT

"$cmake" --install "$build" --prefix "$place/first" >/dev/null
mv "$place/first" "$place/nmm"

"$place/nmm/bin/nmm" --version

"$cmake" -S "$here/consumer" -B "$place/build" -DCMAKE_PREFIX_PATH="$place/nmm" \
    -DCMAKE_C_COMPILER="$compiler" >/dev/null
"$cmake" --build "$place/build" >/dev/null
"$place/build/consumer" "$here/consumer/fall.yaml"

PKG_CONFIG_PATH=$(dirname "$(find "$place/nmm" -name nmm.pc)")
export PKG_CONFIG_PATH
"$compiler" "$here/consumer/consumer.c" -o "$place/other" \
    $(pkg-config --cflags --libs nmm)
LD_LIBRARY_PATH=$(pkg-config --variable=libdir nmm) "$place/other" \
    "$here/consumer/fall.yaml"
