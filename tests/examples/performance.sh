#!/bin/sh
# SPDX-License-Identifier: MIT
#
# Makes the tables of docs/performance.md: builds the program and measures, on a machine that does
# nothing else. The profile needs perf (Debian: linux-perf) and is left as it is without.
#
# Usage: sh tests/examples/performance.sh [BUILD_FOLDER] [-- OPTIONS of performance.py, see its --help]

NMM_PAGE=performance exec sh "$(dirname "$0")/experiments.sh" "$@"
