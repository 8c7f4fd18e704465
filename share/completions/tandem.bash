# Bash completion of tandem: commands, options, and the names of built-in scenarios and studies.
_tandem() {
  local current="${COMP_WORDS[COMP_CWORD]}" command="${COMP_WORDS[1]}" words=""
  COMPREPLY=()
  if [ "$COMP_CWORD" -eq 1 ]; then
    words="$(tandem --reference words 2>/dev/null) help --help --version"
  elif [ "$command" = help ]; then
    words="$(tandem --reference words 2>/dev/null)"
  elif [[ "$current" == -* ]]; then
    words="$(tandem "$command" --reference words 2>/dev/null)"
  elif [ "$command" = study ]; then
    words="run merge export show trial list $(tandem study list 2>/dev/null | awk '{ print $1 }')"
  elif [ "$COMP_CWORD" -eq 2 ]; then
    words="$(tandem scenarios 2>/dev/null | awk '{ print $1 }')"
  fi
  mapfile -t COMPREPLY < <(compgen -W "$words" -- "$current")
}
complete -o default -F _tandem tandem
