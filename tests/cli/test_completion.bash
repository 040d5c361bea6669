# SPDX-License-Identifier: MIT
#
# Does completion offer what --help lists?   Usage: test_completion.bash BIN_FOLDER COMPLETION
PATH=$1:$PATH
. "$2"

complete_words() {
    COMP_WORDS=("$@")
    COMP_CWORD=$(($# - 1))
    COMPREPLY=()
    _nmm
    echo "${COMPREPLY[*]}"
}

expect() {
    local wanted=$1 found
    shift
    found=$(complete_words "$@")
    [ "$found" = "$wanted" ] && return
    echo "$*: found '$found', wanted '$wanted'"
    exit 1
}

expect "run" nmm ru
expect "export" nmm e
expect "--device" nmm run --de
expect "host" nmm run --device h
expect "displacement" nmm plot --field di
expect "--version --vtu" nmm export --v
expect "--dump-system" nmm run --du
expect "--max-iterations" nmm solve --max-
expect "jacobi" nmm solve --method j
expect "cluster" nmm solve --blocks cl
expect "solve" nmm so
expect "bench" nmm b
expect "fig6 fig7" nmm bench f
expect "--quick --quiet" nmm bench --qui
expect "trade" nmm t
expect "--want" nmm trade --w
expect "penalty" nmm trade --knobs pe
expect "order" nmm trade --knobs o
