#!/bin/sh
# SPDX-License-Identifier: MIT
#
# Everything that a change must pass, from a bare Debian 12: installs what is missing, builds with
# sanitizers, runs all tests that are not labelled long.
#
# Usage: sh tests/all.sh

set -eu
cd "$(dirname "$0")/.."

. cmake/packages.sh
need_packages $packages_build $packages_test

cmake --preset dev
cmake --build build/dev
ctest --preset dev -j "$(nproc)"
