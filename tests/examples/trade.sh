#!/bin/sh
# SPDX-License-Identifier: MIT
#
# Makes the tables and pictures of docs/trade.md: builds the program and measures, on a machine that
# does nothing else.
#
# Usage: sh tests/examples/trade.sh [BUILD_FOLDER] [-- OPTIONS of trade.py, see its --help]

NMM_PAGE=trade exec sh "$(dirname "$0")/experiments.sh" "$@"
