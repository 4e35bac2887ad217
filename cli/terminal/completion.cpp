// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/terminal/completion.h"

#include <map>
#include <set>

#include "cli/terminal/command_tree.h"
#include "cli/tools/provenance.h"

namespace vps::cli {
namespace {

enum class Kind : std::uint8_t { flag, words, list, files, folders, anything };

// How a value is completed.
struct Completion {
  Kind kind = Kind::anything;
  std::string words;  // values, or extensions of files, separated by spaces; no extension: any file
};

Completion completion_of(const CLI::Option& option) {
  static const std::map<std::string, std::string> extensions = {{"MESH", "obj ply stl off gltf glb dae 3ds fbx"},
                                                                {"ASSET", "vps.hdf"},
                                                                {"SCENE", "toml urdf"},
                                                                {"FILE", ""},
                                                                {"NAME", ""}};
  if (is_flag(option)) return {Kind::flag, ""};
  if (const auto words = values_of(option); !words.empty()) {
    return {option.get_delimiter() == ',' ? Kind::list : Kind::words, CLI::detail::join(words, " ")};
  }
  std::string name = value_name(option);
  if (name.ends_with("...")) name.resize(name.size() - 3);
  if (name == "DIR") return {Kind::folders, ""};
  if (const auto known = extensions.find(name); known != extensions.end()) return {Kind::files, known->second};
  const std::size_t dot = name.find('.');  // as in JOBS.jsonl
  if (dot != name.npos && name.find('|') == name.npos) return {Kind::files, name.substr(dot + 1)};
  return {option.get_positional() ? Kind::files : Kind::anything, ""};
}

std::vector<std::string> names(const CLI::Option& option) {
  return CLI::detail::split(option.get_name(false, true), ',');
}

// The options of a command, in order, and those of its sub-commands. The root has only its own.
std::vector<const CLI::Option*> options_of(const CLI::App& app) {
  std::vector<const CLI::App*> apps = {&app};
  if (app.get_parent() != nullptr) {
    for (const CLI::App* const one : commands_of(app)) apps.push_back(one);
  }
  std::vector<const CLI::Option*> out;
  std::set<std::string> known;
  for (const CLI::App* const one : apps) {
    for (const OptionGroup& group : option_groups(*one)) {
      for (const CLI::Option* const option : group.options) {
        if (known.insert(option->get_name(false, true)).second) out.push_back(option);
      }
    }
  }
  return out;
}

// Names of the commands of a command, separated by spaces.
std::string command_names(const CLI::App& app) {
  std::string out;
  for (const CLI::App* const one : commands_of(app)) out += (out.empty() ? "" : " ") + one->get_name();
  return out;
}

// Calls `visit` with the name of each command ("": none was named) and the command.
template <class Visit>
void for_commands(const CLI::App& app, const Visit& visit) {
  for (const CLI::App* const one : commands_of(app)) visit(one->get_name(), *one);
  visit("", app);
}

// The call of the helper function in the bash script.
std::string bash_call(const Completion& completion) {
  switch (completion.kind) {
    case Kind::words:
      return "_vpsbake_words \"$cur\" " + completion.words;
    case Kind::list:
      return "_vpsbake_list \"$cur\" " + completion.words;
    case Kind::files:
      return "_vpsbake_files \"$cur\"" + (completion.words.empty() ? "" : " " + completion.words);
    case Kind::folders:
      return "_vpsbake_files \"$cur\" /";
    default:
      return "COMPREPLY=()";
  }
}

constexpr const char* kBashHelpers =
    R"(# bash completion of vpsbake, written by `vpsbake help-files` from the program's options
_vpsbake_words() {
  local cur=$1
  shift
  mapfile -t COMPREPLY < <(compgen -W "$*" -- "$cur")
}
# Words after commas.
_vpsbake_list() {
  local cur=$1 before=
  shift
  [[ $cur == *,* ]] && before=${cur%,*},
  mapfile -t COMPREPLY < <(compgen -P "$before" -W "$*" -- "${cur##*,}")
}
# Folders, and files with one of the extensions, or all without; / alone: no files.
_vpsbake_files() {
  local cur=$1 file extension
  shift
  compopt -o filenames 2>/dev/null
  COMPREPLY=()
  while IFS= read -r file; do
    if [[ $# == 0 || -d ${file/#\~\//$HOME/} ]]; then
      COMPREPLY+=("$file")
      continue
    fi
    for extension; do
      [[ ${file,,} == *."$extension" ]] && COMPREPLY+=("$file")
    done
  done < <(compgen -f -- "$cur")
}
_vpsbake() {
  local cur=${COMP_WORDS[COMP_CWORD]} previous=${COMP_WORDS[COMP_CWORD-1]} command=
  # Of --axis=x bash makes three words.
  [[ $cur == = ]] && cur=
  [[ $previous == = ]] && previous=${COMP_WORDS[COMP_CWORD-2]}
)";

// Escapes a text within '...' for zsh; colons and brackets have a meaning for _arguments.
std::string zsh_text(const std::string& text) {
  std::string out;
  for (const char c : text) {
    if (c == '[' || c == ']' || c == ':' || c == '\\') out += '\\';
    out += c == '\'' ? "'\\''" : std::string(1, c);
  }
  return out;
}

std::string zsh_action(const Completion& completion, const std::string& value) {
  switch (completion.kind) {
    case Kind::words:
      return "(" + completion.words + ")";
    case Kind::list:
      return "_values -s , " + value + " " + completion.words;
    case Kind::files: {
      if (completion.words.empty()) return "_files";
      return "_files -g \"*.(#i)(" + CLI::detail::find_and_replace(completion.words, " ", "|") + ")(-.)\"";
    }
    case Kind::folders:
      return "_files -/";
    default:
      return " ";
  }
}

// The options that exclude this one when they are already given: itself, and those that it excludes.
std::string zsh_exclusions(const CLI::Option& option) {
  std::string out = CLI::detail::join(names(option), " ");
  for (const CLI::Option* const other : option.get_excludes()) {
    if (!other->get_positional()) out += " " + CLI::detail::join(names(*other), " ");
  }
  return "(" + out + ")";
}

// @param place  of a positional, counted from one
std::string zsh_spec(const CLI::Option& option, const std::string& place = "") {
  const Completion completion = completion_of(option);
  const std::string value = zsh_text(value_name(option));
  const std::string argument = completion.kind == Kind::flag ? "" : ":" + value + ":" + zsh_action(completion, value);
  if (option.get_positional()) return "    '" + (option.get_expected_max() > 1 ? "*" : place) + argument + "' \\\n";
  std::string out;
  for (const std::string& name : names(option)) {
    const char* const joined = completion.kind == Kind::flag ? "" : name.starts_with("--") ? "=" : "+";
    out += "    '" + zsh_exclusions(option) + name + joined + "[" + zsh_text(description_of(option)) + "]" + argument +
           "' \\\n";
  }
  return out;
}

std::string zsh_function(const std::string& function, const CLI::App& app) {
  std::string out = function + "() {\n  _arguments -S \\\n";
  int place = 0;
  for (const CLI::Option* const one : positionals(app)) out += zsh_spec(*one, std::to_string(++place));
  if (app.get_parent() != nullptr && !commands_of(app).empty())
    out += "    '1:command:(" + command_names(app) + ")' \\\n";
  for (const CLI::Option* const option : options_of(app)) out += zsh_spec(*option);
  out.erase(out.size() - 3);
  return out + "\n}\n";
}

}  // namespace

std::string bash_completion(const CLI::App& app) {
  std::string out = std::string(kBashHelpers) + "  local commands='" + command_names(app) + "'\n";
  out += "  [[ $COMP_CWORD -gt 1 && \" $commands \" == *\" ${COMP_WORDS[1]} \"* ]] && command=${COMP_WORDS[1]}\n";
  out += "  case \"$command $previous\" in\n";
  std::string options = "  if [[ $cur == -* ]]; then\n    case \"$command\" in\n";
  std::string arguments = "  case \"$command\" in\n";
  for_commands(app, [&](const std::string& name, const CLI::App& command) {
    std::string words;
    std::map<std::string, std::string> patterns;  // by the call that completes them
    for (const CLI::Option* const option : options_of(command)) {
      const Completion completion = completion_of(*option);
      for (const std::string& one : names(*option)) {
        words += " " + one;
        if (completion.kind == Kind::flag) continue;
        std::string& pattern = patterns[bash_call(completion)];
        pattern += (pattern.empty() ? "" : " | ") + quoted_word(name + " " + one);
      }
    }
    for (const auto& [call, pattern] : patterns) out += "    " + pattern + ") " + call + "; return ;;\n";
    options += "      " + quoted_word(name) + ") _vpsbake_words \"$cur\"" + words + " ;;\n";
    if (const auto first = positionals(command); !first.empty()) {
      arguments += "    " + quoted_word(name) + ") " + bash_call(completion_of(*first[0])) + " ;;\n";
    } else if (!name.empty() && !commands_of(command).empty()) {
      arguments += "    " + quoted_word(name) + ") " + bash_call({Kind::words, command_names(command)}) + " ;;\n";
    }
  });
  out += "  esac\n" + options + "    esac\n    return\n  fi\n" + arguments + "  esac\n";
  out +=
      "  [[ $COMP_CWORD == 1 ]] && mapfile -t -O ${#COMPREPLY[@]} COMPREPLY < <(compgen -W \"$commands\" -- "
      "\"$cur\")\n";
  return out + "}\ncomplete -F _vpsbake vpsbake\n";
}

std::string zsh_completion(const CLI::App& app) {
  std::string out =
      "#compdef vpsbake\n# zsh completion of vpsbake, written by `vpsbake help-files` from the program's options\n";
  for_commands(app, [&](const std::string& name, const CLI::App& command) {
    out += zsh_function("_vpsbake_" + (name.empty() ? "mesh" : "command_" + name), command);
  });
  out += "_vpsbake() {\n  local -a commands=(\n";
  for (const CLI::App* const one : commands_of(app)) {
    out += "    '" + one->get_name() + ":" + zsh_text(one->get_description()) + "'\n";
  }
  return out +
         "  )\n"
         "  if (( CURRENT > 2 && $+functions[_vpsbake_command_$words[2]] )); then\n"
         "    local command=$words[2]\n"
         "    shift words\n"
         "    (( CURRENT-- ))\n"
         "    _vpsbake_command_$command\n"
         "    return\n"
         "  fi\n"
         "  local found=1\n"
         "  (( CURRENT == 2 )) && _describe -t commands command commands && found=0\n"
         "  _vpsbake_mesh && found=0\n"
         "  return found\n"
         "}\n"
         "_vpsbake \"$@\"\n";
}

}  // namespace vps::cli
