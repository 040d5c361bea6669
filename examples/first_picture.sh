#!/bin/sh
# SPDX-License-Identifier: MIT
#
# From a bare Debian 12 to the first picture: installs what is missing, builds, runs the slope
# example and draws its last frame.
#
# Usage: sh examples/first_picture.sh [FOLDER]      FOLDER: for slope.vtkhdf and slope.png (here)

set -eu
target=$(mkdir -p "${1:-.}" && cd "${1:-.}" && pwd)
cd "$(dirname "$0")/.."

. cmake/packages.sh
need_packages $packages_build

cmake --preset release -DNMM_BUILD_TESTS=OFF >/dev/null
cmake --build build/release

build/release/nmm run examples/slope/scene.yaml -o "$target/slope.vtkhdf"
build/release/nmm plot "$target/slope.vtkhdf" -o "$target/slope.png"
echo "The picture is $target/slope.png; the program is $PWD/build/release/nmm"
