// --completion: what shells complete lines by. Each script holds the commands, their modifiers and choices as
// tables of its own, and asks the program nothing.
#include <algorithm>
#include <cctype>
#include <cstring>

#include "cli/describe.h"
#include "cli/help.h"

namespace tessera::cli {
namespace {

// Without what a shell would read otherwise.
bool IsPlain(const std::string& word) {
  return !word.empty() && std::all_of(word.begin(), word.end(), [](char c) {
    return std::isalnum(static_cast<unsigned char>(c)) != 0 || std::strchr("_-+.,/%", c) != nullptr;
  });
}

std::string Joined(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words) {
    if (IsPlain(word) || (word.ends_with("=") && IsPlain(word.substr(0, word.size() - 1))))
      text += (text.empty() ? "" : " ") + word;
  }
  return text;
}

struct Item {
  std::string name, summary;  // with dashes; a pattern without
  std::vector<std::string> modifiers;
  std::vector<std::pair<std::string, std::vector<std::string>>> values;  // of a modifier
  std::vector<std::string> argument;                                     // what the first one may be
};

void AddRow(const ops::OpInfo& row, Item& item) {
  for (const ops::ParamInfo& p : row.modifiers) {
    item.modifiers.push_back(p.name + "=");
    if (!p.choices.empty()) item.values.push_back({p.name, p.choices});
    if (p.type == ops::ParamType::kFlag) item.values.push_back({p.name, {"0", "1"}});
  }
  if (!row.arguments.empty()) item.argument = row.arguments[0].choices;
}

std::vector<Item> Patterns() {
  std::vector<Item> items;
  for (const ops::OpInfo* g : Generators()) {
    items.push_back({g->name, g->summary, {}, {}, {}});
    AddRow(*g, items.back());
    items.back().argument.clear();
  }
  return items;
}

std::vector<Item> Items() {
  std::vector<std::string> patterns, names = CommandNames();
  for (const ops::OpInfo* g : Generators()) patterns.push_back(g->name);
  names.insert(names.end(), patterns.begin(), patterns.end());
  std::vector<Item> items;
  for (const Command& c : Commands()) {
    std::vector<std::string> called = c.aliases;
    called.insert(called.begin(), c.info.name);
    for (const std::string& name : called) {
      items.push_back({Dashed(name), c.info.summary, {}, {}, {}});
      AddRow(c.info, items.back());
      if (c.info.name == "help") items.back().argument = names;
      if (c.info.name == "pattern") items.back().argument = patterns;
      if (c.info.name == "d") items.back().argument = {"uint8", "uint16", "half", "float"};
      if (c.info.name == "completion") items.back().argument = {"bash", "zsh", "fish"};
    }
  }
  return items;
}

// A function that prints words for a key, in the words of bash and zsh: case $1 in KEY) words;; esac.
void Table(std::ostream& out, const std::string& name,
           const std::vector<std::pair<std::string, std::string>>& rows) {
  out << name << "() {\n  case $1 in\n";
  for (const auto& [key, words] : rows) {
    if (!words.empty()) out << "    " << key << ") echo '" << words << "' ;;\n";
  }
  out << "  esac\n}\n";
}

using Rows = std::vector<std::pair<std::string, std::string>>;

struct Tables {
  Rows modifiers, values, arguments;
  std::vector<std::string> names;
};

Tables AllTables() {
  Tables tables;
  std::vector<Item> items = Items();
  for (const Item& item : items) tables.names.push_back(item.name);
  const std::vector<Item> patterns = Patterns();
  items.insert(items.end(), patterns.begin(), patterns.end());
  for (const Item& item : items) {
    tables.modifiers.push_back({item.name, Joined(item.modifiers)});
    for (const auto& [key, choices] : item.values)
      tables.values.push_back({item.name + ":" + key, Joined(choices)});
    tables.arguments.push_back({item.name, Joined(item.argument)});
  }
  return tables;
}

// Both shells: the candidates for a word behind another one, whole words, a line each.
constexpr char kCandidates[] = R"shell(_tessera_candidates() {
  local word=$1 before=$2 base given key item
  case $word in
    -*:* | [a-z]*:*)
      base=${word%%:*}
      [[ $word == --* || $word != -* || ${#base} == 2 ]] || base=-$base
      given=${word%:*} key=${word##*:}
      if [[ $key == *=* ]]; then
        for item in $(_tessera_values "$base:${key%%=*}"); do echo "$given:${key%%=*}=$item"; done
      else
        for item in $(_tessera_modifiers "$base"); do echo "$given:$item"; done
      fi
      return ;;
  esac
  for item in $(_tessera_arguments "${before%%:*}"); do echo "$item"; done
  case $word in
    -*) for item in $(_tessera_commands); do echo "$item"; done ;;
  esac
}
)shell";

void PrintTables(std::ostream& out) {
  const Tables tables = AllTables();
  Table(out, "_tessera_modifiers", tables.modifiers);
  Table(out, "_tessera_values", tables.values);
  Table(out, "_tessera_arguments", tables.arguments);
  out << "_tessera_commands() {\n  echo '" << Joined(tables.names) << "'\n}\n";
}

void PrintBash(std::ostream& out) {
  out << "# bash completion of tessera; made by tessera --completion bash.\n";
  PrintTables(out);
  // The word is taken from the line, for bash parts words at : and = and wants what follows the last of them.
  out << kCandidates << R"shell(_tessera() {
  local line=${COMP_LINE:0:COMP_POINT} word before parted
  word=${line##*[[:blank:]]}
  line=${line%"$word"}
  line=${line%"${line##*[![:blank:]]}"}
  before=${line##*[[:blank:]]}
  parted=
  if [[ $COMP_WORDBREAKS == *:* && $word == *:* ]]; then parted=${word%"${word##*:}"}; fi
  if [[ $COMP_WORDBREAKS == *=* && ${word#"$parted"} == *=* ]]; then parted=${word%"${word##*=}"}; fi
  local IFS=$'\n'
  COMPREPLY=($(IFS=$' \t\n'; compgen -W "$(_tessera_candidates "$word" "$before")" -- "$word"))
  COMPREPLY=("${COMPREPLY[@]#"$parted"}")
  if [[ ${#COMPREPLY[@]} == 0 && $word != -* ]]; then
    compopt -o filenames 2>/dev/null
    COMPREPLY=($(compgen -f -- "$word"))
  elif [[ ${#COMPREPLY[@]} == 1 && ${COMPREPLY[0]} == *= ]]; then
    compopt -o nospace 2>/dev/null
  fi
}
complete -F _tessera tessera
)shell";
}

void PrintZsh(std::ostream& out) {
  out << "#compdef tessera\n# zsh completion of tessera; made by tessera --completion zsh.\n";
  PrintTables(out);
  out << kCandidates << R"shell(_tessera() {
  setopt localoptions shwordsplit
  local -a found open
  local item word=${words[CURRENT]} before=${words[CURRENT-1]}
  for item in $(_tessera_candidates "$word" "$before"); do
    case $item in
      *=) open+=("$item") ;;
      *) found+=("$item") ;;
    esac
  done
  compadd -a found
  compadd -S '' -a open
  [[ $word == -* ]] || _files
}
if [[ $funcstack[1] == _tessera ]]; then _tessera "$@"; elif (( $+functions[compdef] )); then compdef _tessera tessera; fi
)shell";
}

// fish has a description beside each word.
void PrintFish(std::ostream& out) {
  const auto quoted = [](std::string text) {
    for (size_t i = 0; (i = text.find_first_of("'\\", i)) != std::string::npos; i += 2) text.insert(i, "\\");
    return "'" + text + "'";
  };
  out << "# fish completion of tessera; made by tessera --completion fish.\n";
  const Tables tables = AllTables();
  const auto table = [&](const char* name, const Rows& rows) {
    out << "function " << name << "\n  switch $argv[1]\n";
    for (const auto& [key, words] : rows) {
      if (!words.empty()) out << "    case " << quoted(key) << "\n      printf '%s\\n' " << words << "\n";
    }
    out << "  end\nend\n";
  };
  table("__tessera_modifiers", tables.modifiers);
  table("__tessera_values", tables.values);
  table("__tessera_arguments", tables.arguments);
  out << "function __tessera_commands\n";
  for (const Item& item : Items())
    out << "  printf '%s\\t%s\\n' " << item.name << " " << quoted(item.summary) << "\n";
  out << R"shell(end
function __tessera_candidates
  set -l word (commandline -ct)
  set -l before (commandline -opc)[-1]
  if string match -qr '^(-|[a-z]).*:' -- $word
    set -l base (string split -m1 : -- $word)[1]
    if string match -qr '^-[^-].' -- $base
      set base -$base
    end
    set -l key (string split -r -m1 : -- $word)[-1]
    set -l given (string split -r -m1 : -- $word)[1]
    if string match -q '*=*' -- $key
      set -l name (string split -m1 = -- $key)[1]
      for item in (__tessera_values $base:$name)
        echo $given:$name=$item
      end
    else
      for item in (__tessera_modifiers $base)
        echo $given:$item
      end
    end
    return
  end
  __tessera_arguments (string split -m1 : -- $before)[1]
  if string match -q -- '-*' $word
    __tessera_commands
  end
end
complete -c tessera -a '(__tessera_candidates)'
)shell";
}

}  // namespace

void PrintCompletion(std::ostream& out, const std::string& shell) {
  if (shell == "zsh") {
    PrintZsh(out);
  } else if (shell == "fish") {
    PrintFish(out);
  } else {
    PrintBash(out);
  }
}

}  // namespace tessera::cli
