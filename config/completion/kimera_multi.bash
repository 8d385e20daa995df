# Completion of the programs' options in bash. Options come from --help, so they are those of the installed program.
#   source config/completion/kimera_multi.bash                                    # for this shell
#   cp config/completion/kimera_multi.bash /etc/bash_completion.d/kimera_multi    # for all, with bash-completion

# Prints the options and subcommands in the help of a program, one a line.
_kimera_multi_words() {
  "$@" --help 2>/dev/null | awk '
    /^Subcommands:/ {commands = 1; next}
    /^[A-Z[]/ {commands = 0}
    commands && /^  [a-z]/ {print $1}
    match($0, /^ +(-[a-zA-Z],)?--[a-z][a-z-]*/) {sub(/^ +(-[a-zA-Z],)?/, ""); sub(/[^a-z-].*/, ""); print}' | sort -u
}

_kimera_multi() {
  local program=$1 word=$2 before=$3 key
  COMPREPLY=()
  case $before in
    --link) mapfile -t COMPREPLY < <(compgen -W 'wired wifi intermittent' -- "$word"); return ;;
    --log) mapfile -t COMPREPLY < <(compgen -W 'error warn info debug' -- "$word"); return ;;
    --rate) mapfile -t COMPREPLY < <(compgen -W '1.0 max auto' -- "$word"); return ;;
  esac
  # A word after a value is a file, by `complete -o default`.
  local -a command=("$program")
  [[ $COMP_CWORD -gt 1 && ${COMP_WORDS[1]} == [a-z]* && ! -e ${COMP_WORDS[1]} ]] && command+=("${COMP_WORDS[1]}")
  [[ $word == -* || $COMP_CWORD -eq 1 ]] || return
  key=${command[*]}
  declare -gA _kimera_multi_cache
  [[ ${_kimera_multi_cache[$key]+set} ]] || _kimera_multi_cache[$key]=$(_kimera_multi_words "${command[@]}")
  mapfile -t COMPREPLY < <(compgen -W "${_kimera_multi_cache[$key]}" -- "$word")
}

complete -o default -F _kimera_multi kimera_multi_robot kimera_multi_team kimera_multi_doctor kimera_multi_publish \
  kimera_multi_viewer kimera_multi_evaluate kimera_multi_simulate kimera_multi_keys kimera_multi_vocabulary \
  kimera_multi_pgo
