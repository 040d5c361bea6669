#!/bin/sh
# SPDX-License-Identifier: MIT
#
# Everything that a change must pass, from a bare Debian 12: installs what is missing, builds with
# sanitizers, runs all tests that are not labelled long; then builds as users do and runs there what
# is too long under sanitizers: the examples with all numbers of their READMEs, the verification
# cases in full, extremes, equal bits of a run with all kinds of events, clang-tidy. Left to whom it
# concerns, as it takes minutes: the paper's scenes at ten times their unknowns (ctest -R _large).
#
# Usage: sh tests/all.sh

set -eu
cd "$(dirname "$0")/.."

. cmake/packages.sh
need_packages $packages_build $packages_test

cmake --preset dev
cmake --build build/dev
ctest --preset dev -j "$(nproc)"

# Anew, for what was not installed yet when it was last configured.
cmake --preset release --fresh
cmake --build build/release --target nmm verify_programs
extremes='extreme_(random|materials|geometry|penalty|scales|turns)'
OMP_WAIT_POLICY=passive ctest --test-dir build/release --output-on-failure --no-tests=error \
    -j "$(nproc)" \
    -R "^(example_[a-z0-9_]+|$extremes|verify_all_[a-z]+|gate_threads_eventful|source_tidy)$" \
    -E '_large$'
