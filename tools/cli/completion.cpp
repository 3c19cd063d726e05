// SPDX-License-Identifier: Apache-2.0
// Shell completion and the manual page, both made from the declared options, so neither can be
// behind.
#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdio>

#include "sim/sensor/sensor_model.h"
#include "tools/cli/command.h"
#include "tools/cli/options.h"

namespace toftwin::cli {
namespace {

std::vector<CLI::App*> subcommandsOf(CLI::App& app) {
  return app.get_subcommands([](CLI::App* sub) { return !sub->get_group().empty(); });
}

/// The options with a name, in the order declared; arguments without one are not completed.
std::vector<const CLI::Option*> optionsOf(const CLI::App& app) {
  return app.get_options([](const CLI::Option* option) { return option->nonpositional(); });
}

std::vector<std::string> wordsOf(const CLI::Option& option) {
  std::vector<std::string> words;
  for (const std::string& name : option.get_snames()) words.push_back("-" + name);
  for (const std::string& name : option.get_lnames()) words.push_back("--" + name);
  return words;
}

std::string quoted(std::string text) {
  for (std::size_t at = 0; (at = text.find('\'', at)) != std::string::npos; at += 4)
    text.replace(at, 1, "'\\''");
  return "'" + text + "'";
}

/// What bash offers in the place of the value of an option: words, files, or nothing that is known.
std::string valueCase(const CLI::Option& option) {
  std::string pattern, action;
  for (const std::string& word : wordsOf(option)) pattern += (pattern.empty() ? "" : "|") + word;
  const auto& names = option.get_lnames();
  const auto is = [&](std::string_view name) {
    return std::ranges::find(names, name) != names.end();
  };
  std::string words;
  if (is("plane")) words = planeNames();
  if (is("camera")) words = fmt::format("{}", fmt::join(sim::SensorModel::presetNames(), " "));
  if (is("pace")) words = "exact fast";
  if (is("source"))
    return fmt::format("      {}) offer \"$(toftwin list --names 2> /dev/null)\"; return ;;\n",
                       pattern);
  std::ranges::replace(words, ',', ' ');
  if (!words.empty())
    return fmt::format("      {}) offer {}; files; return ;;\n", pattern, quoted(words));
  return fmt::format("      {}) files; return ;;\n", pattern);
}

constexpr const char* kBashPositional = R"bash(  local -a given=()
  local word
  for word in "${COMP_WORDS[@]:2:$((COMP_CWORD - 2))}"; do
    [[ $word == -* ]] || given+=("$word")
  done
  case "$command" in
    grab|record|pose|trigger) offer "$(toftwin list --names 2> /dev/null)" ;;
    info|compare) offer "$(toftwin list --names 2> /dev/null)"; files ;;
    set)
      if [ ${#given[@]} -eq 0 ]; then
        offer "$(toftwin list --names 2> /dev/null)"
      elif [ ${#given[@]} -eq 1 ]; then
        offer "$(toftwin set "${given[0]}" 2> /dev/null | while read -r word _; do echo "$word"; done)"
      fi ;;
    compliance)
      offer "$(toftwin list --drivers 2> /dev/null | while read -r word _; do [[ $word == *:* ]] && echo "$word"; done)"
      files
      declare -F __ltrim_colon_completions > /dev/null && __ltrim_colon_completions "$current" ;;
    completion) offer 'bash zsh fish manual' ;;
    *) files ;;
  esac
)bash";

std::string bash(CLI::App& app) {
  std::string names, options, values;
  for (CLI::App* sub : subcommandsOf(app)) {
    names += " " + sub->get_name();
    std::string words, cases;
    for (const CLI::Option* option : optionsOf(*sub)) {
      for (const std::string& word : wordsOf(*option)) words += " " + word;
      if (option->get_expected_max() != 0) cases += valueCase(*option);
    }
    options += fmt::format("    {}) options={} ;;\n", sub->get_name(), quoted(words.substr(1)));
    if (!cases.empty())
      values +=
          fmt::format("    {}) case \"$before\" in\n{}      esac ;;\n", sub->get_name(), cases);
  }
  return "# bash completion for toftwin; made by `toftwin completion bash`\n"
         "_toftwin() {\n"
         "  local current=${COMP_WORDS[COMP_CWORD]} before=${COMP_WORDS[COMP_CWORD-1]}\n"
         "  local command=${COMP_WORDS[1]} options=''\n"
         "  offer() { COMPREPLY+=($(compgen -W \"$1\" -- \"$current\")); }\n"
         "  files() { local IFS=$'\\n'; compopt -o filenames 2> /dev/null;\n"
         "            COMPREPLY+=($(compgen -f -- \"$current\")); }\n"
         "  COMPREPLY=()\n"
         "  if [ \"$COMP_CWORD\" -eq 1 ]; then\n"
         "    offer '" +
         names.substr(1) +
         " --help --version'\n"
         "    return\n"
         "  fi\n"
         "  case \"$command\" in\n" +
         options +
         "  esac\n"
         "  case \"$command\" in\n" +
         values +
         "  esac\n"
         "  if [[ $current == -* ]]; then\n"
         "    offer \"$options\"\n"
         "    return\n"
         "  fi\n" +
         kBashPositional +
         "}\n"
         "complete -F _toftwin toftwin\n";
}

std::string zsh(CLI::App& app) {
  std::string commands, cases;
  const auto colonFree = [](std::string text) {
    for (char& c : text) c = c == ':' || c == '[' || c == ']' ? ' ' : c;
    return text;
  };
  for (CLI::App* sub : subcommandsOf(app)) {
    commands +=
        fmt::format("    {}\n", quoted(sub->get_name() + ":" + colonFree(sub->get_description())));
    cases += fmt::format("    {}) _arguments \\\n", sub->get_name());
    for (const CLI::Option* option : optionsOf(*sub)) {
      for (const std::string& word : wordsOf(*option)) {
        const std::string value = option->get_expected_max() == 0 ? "" : ":value:_files";
        cases +=
            fmt::format("      {} \\\n",
                        quoted(word + "[" + colonFree(option->get_description()) + "]" + value));
      }
    }
    cases += "      '*:file:_files' ;;\n";
  }
  return fmt::format(
      "#compdef toftwin\n"
      "# zsh completion for toftwin; made by `toftwin completion zsh`\n"
      "_toftwin() {{\n"
      "  local -a commands\n"
      "  commands=(\n{}  )\n"
      "  if (( CURRENT == 2 )); then\n"
      "    _describe command commands\n"
      "    return\n"
      "  fi\n"
      "  local command=$words[2]\n"
      "  (( CURRENT-- )); shift words\n"
      "  case $command in\n{}"
      "  esac\n"
      "}}\n"
      "compdef _toftwin toftwin\n",
      commands, cases);
}

std::string fish(CLI::App& app) {
  std::string script = "# fish completion for toftwin; made by `toftwin completion fish`\n";
  for (CLI::App* sub : subcommandsOf(app)) {
    script += fmt::format("complete -c toftwin -n __fish_use_subcommand -f -a {} -d {}\n",
                          sub->get_name(), quoted(sub->get_description()));
    for (const CLI::Option* option : optionsOf(*sub)) {
      script +=
          fmt::format("complete -c toftwin -n '__fish_seen_subcommand_from {}'", sub->get_name());
      for (const std::string& name : option->get_snames()) script += " -s " + name;
      for (const std::string& name : option->get_lnames()) script += " -l " + name;
      if (option->get_expected_max() != 0) script += " -r";
      script += " -d " + quoted(option->get_description()) + "\n";
    }
  }
  return script;
}

}  // namespace

std::string completionScript(CLI::App& app, const std::string& shell) {
  return shell == "bash" ? bash(app) : shell == "zsh" ? zsh(app) : fish(app);
}

std::string manual(CLI::App& app) {
  std::string page =
      "# Command line\n\n"
      "`toftwin` is the one tool for people and scripts. This page is made from the program "
      "itself\n"
      "(`toftwin completion manual`), and a test keeps it so.\n\n"
      "```\n" +
      app.help() + "```\n";
  for (CLI::App* sub : subcommandsOf(app)) {
    page += fmt::format("\n## toftwin {}\n\n```\n{}```\n", sub->get_name(), sub->help("toftwin"));
  }
  return page;
}

Command completionCommand() {
  return {
      "completion", "print the completion script for a shell",
      "  toftwin completion bash > ~/.local/share/bash-completion/completions/toftwin\n"
      "  toftwin completion zsh > ~/.zfunc/_toftwin\n"
      "  toftwin completion fish > ~/.config/fish/completions/toftwin.fish\n",
      [](Arguments& args) -> Run {
        const auto shell = std::make_shared<std::string>();
        args.option("SHELL", *shell, "bash, zsh or fish; manual: the page docs/command-line.md")
            .required()
            .oneOf({"bash", "zsh", "fish", "manual"});
        return [shell]() -> Result<Exit> {
          CLI::App whole;
          whole.name("toftwin");
          static_cast<void>(declare(whole));
          fmt::print("{}", *shell == "manual" ? manual(whole) : completionScript(whole, *shell));
          return Exit::Ok;
        };
      }};
}

}  // namespace toftwin::cli
