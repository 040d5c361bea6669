# Completion of the nmm command for bash. Commands and options are read from --help, so that they
# are never out of date.

_nmm() {
    local word=${COMP_WORDS[COMP_CWORD]} before=${COMP_WORDS[COMP_CWORD - 1]} command=${COMP_WORDS[1]}
    local words
    COMPREPLY=()
    if ((COMP_CWORD == 1)); then
        words=$(nmm --help 2>/dev/null | sed -n '/^Commands:/,/^$/s/^  \([a-z]*\) .*/\1/p')
        mapfile -t COMPREPLY < <(compgen -W "$words --help --version" -- "$word")
        return
    fi
    case $before in
    --method)
        words="auto jacobi chebyshev pcg sor gauss-seidel direct"
        mapfile -t COMPREPLY < <(compgen -W "$words" -- "$word")
        ;;
    --blocks) mapfile -t COMPREPLY < <(compgen -W "auto cover cluster body" -- "$word") ;;
    --precision) mapfile -t COMPREPLY < <(compgen -W "auto double mixed" -- "$word") ;;
    --stop) mapfile -t COMPREPLY < <(compgen -W "residual average_change" -- "$word") ;;
    --knobs)
        words=$(nmm trade --help 2>/dev/null | sed -n '/--knobs/{s/.*NAME\.\.\. *//;s/(.*//;s/,//g;p}')
        mapfile -t COMPREPLY < <(compgen -W "$words" -- "$word")
        ;;
    --device) mapfile -t COMPREPLY < <(compgen -W "auto host target" -- "$word") ;;
    --field)
        words="stress sxx syy sxy displacement velocity block"
        mapfile -t COMPREPLY < <(compgen -W "$words" -- "$word")
        ;;
    *)
        if [[ $command == bench && $word != -* && $COMP_CWORD == 2 ]]; then
            words=$(nmm bench --help 2>/dev/null | sed -n '/^NAME is/,/^Each/s/^  \([a-z0-9]*\) .*/\1/p')
            mapfile -t COMPREPLY < <(compgen -W "$words" -- "$word")
        elif [[ $word == -* ]]; then
            words=$(nmm "$command" --help 2>/dev/null | grep -o -- '--[a-z][a-z-]*' | sort -u)
            mapfile -t COMPREPLY < <(compgen -W "$words" -- "$word")
        else
            compopt -o filenames 2>/dev/null
            mapfile -t COMPREPLY < <(compgen -f -- "$word")
        fi
        ;;
    esac
}
complete -F _nmm nmm
