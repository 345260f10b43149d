# Completion of palpate in bash: commands, their options, words and files, as the program's own help tells them.

_palpate_words() { mapfile -t COMPREPLY < <(compgen -W "$1" -- "$2"); }

_palpate_files() {  # WORD [ENDING]: files, with that ending alone, and folders
  compopt -o filenames 2> /dev/null
  mapfile -t COMPREPLY < <(
    if [[ -n "${2-}" ]]; then compgen -f -X "!*$2" -- "$1"; compgen -d -- "$1"; else compgen -f -- "$1"; fi | sort -u)
}

# The argument of an option, as help names it: "FILE", "left|right"; nothing for a switch.
_palpate_argument() { sed -n "s/^  $2 \([^ ]\+\).*/\1/p" <<< "$1"; }

_palpate() {
  local program=${COMP_WORDS[0]/#\~/$HOME} command=${COMP_WORDS[1]-}
  local word=${COMP_WORDS[COMP_CWORD]} before=${COMP_WORDS[COMP_CWORD - 1]}
  COMPREPLY=()
  if ((COMP_CWORD == 1)); then
    _palpate_words "$("$program" --help 2> /dev/null | sed -n 's/^  \([a-z]\+\)  .*/\1/p') --help --version" "$word"
    return
  fi
  # --option=value comes as three words.
  if [[ $word == "=" ]]; then
    word=""
  elif [[ $before == "=" ]]; then
    before=${COMP_WORDS[COMP_CWORD - 2]}
  fi
  local help argument
  help="$("$program" "$command" --help 2> /dev/null < /dev/null)" || return
  if [[ $before == --* ]]; then
    argument="$(_palpate_argument "$help" "$before")"
    case "$before:$argument" in
      --device:*) _palpate_words "falcon falcon2 forcedimension forcedimension2 inverse3 inverse3x2 touch touch2 mouse simulated" "$word"; return ;;
      --renderer:*) _palpate_words "point ray" "$word"; return ;;
      --times:*) _palpate_words "relative absolute" "$word"; return ;;
      --format:NAME) _palpate_words "csv bids psych-ds" "$word"; return ;;
      --format:*) _palpate_words "table csv json" "$word"; return ;;
      *\|*) _palpate_words "${argument//|/ }" "$word"; return ;;
      *:FILE* | *:PATH | *:DIR) _palpate_files "$word"; return ;;
      *:?*) return ;;  # a number or a name that only the user knows
    esac
  fi
  if [[ $word == -* ]]; then
    _palpate_words "$(sed -n 's/^  \(-h \[ \)\?\(--[a-z-]\+\).*/\2/p' <<< "$help")" "$word"
  elif [[ $help == "Usage: palpate $command PROTOCOL.json"* ]]; then
    _palpate_files "$word" .json
  elif [[ $command == merge ]]; then
    _palpate_files "$word" .db
  else
    _palpate_words "$(sed -n 's/^  \(-h \[ \)\?\(--[a-z-]\+\).*/\2/p' <<< "$help")" "$word"
  fi
}

complete -F _palpate palpate
