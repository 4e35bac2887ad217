// SPDX-License-Identifier: GPL-3.0-or-later
// Help at the terminal: --help, --version, colours, manual pages, completion in bash and zsh.
#include <gtest/gtest.h>

#include <regex>
#include <sstream>

#include "tests/cli/program.h"
#include "tests/cli/terminal/terminal.h"
#include "version.h"

namespace vps::test {
namespace {

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

bool has(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

std::size_t longest_line(const std::string& text) {
  std::size_t longest = 0;
  for (const std::string& line : lines_of(text)) longest = std::max(longest, line.size());
  return longest;
}

// The commands that --help lists; the subcommands of `of` if given.
std::vector<std::string> commands(const std::string& of = "") {
  const TemporaryFolder folder;
  std::vector<std::string> names;
  bool listed = false;
  for (const std::string& line : lines_of(vpsbake(folder, of + " --help").out)) {
    if (listed && line.empty()) break;
    if (listed && line.starts_with("  ") && line[2] != ' ') names.push_back(line.substr(2, line.find(' ', 2) - 2));
    if (line.starts_with("Commands")) listed = true;
  }
  return names;
}

// Writes a script to a file of the folder and runs it in a shell. @return what it prints
std::string from_shell(const TemporaryFolder& folder, const std::string& shell, const std::string& script) {
  write_file(folder / "script", script);
  std::system(("cd " + folder.path().string() + " && " + shell + " script >out.txt 2>&1 </dev/null").c_str());
  return read_file(folder / "out.txt");
}

bool is_there(const char* program) {
  return std::system(("command -v " + std::string(program) + " >/dev/null 2>&1").c_str()) == 0;
}

void write_help_files(const TemporaryFolder& folder) {
  ASSERT_EQ(vpsbake(folder, "help-files --into share").code, 0);
}

// The completions that bash offers for the last word.
std::vector<std::string> bash_offers(const TemporaryFolder& folder, const std::string& words) {
  return lines_of(from_shell(folder, "bash --norc --noprofile",
                             ". share/bash-completion/completions/vpsbake\nCOMP_WORDS=(vpsbake " + words +
                                 ")\nCOMP_CWORD=$((${#COMP_WORDS[@]} - 1))\n"
                                 "_vpsbake\n[ ${#COMPREPLY[@]} = 0 ] || printf '%s\\n' \"${COMPREPLY[@]}\" | sort\n"));
}

TEST(Help, LinesFitTheTerminal) {
  const TemporaryFolder folder;
  for (const unsigned short columns : std::initializer_list<unsigned short>{60, 72, 90}) {
    const std::string help = on_terminal(folder, "TERM=xterm", "--help", columns);
    EXPECT_LE(longest_line(help), columns) << help;
    EXPECT_GT(longest_line(help), columns - 12U);
  }
  EXPECT_LE(longest_line(on_terminal(folder, "TERM=xterm", "--help", 300)), 100U);
  EXPECT_LE(longest_line(vpsbake(folder, "--help").out), 80U);
}

TEST(Help, EveryCommandSaysHowItIsCalledAndGivesAnExample) {
  const TemporaryFolder folder;
  ASSERT_GE(commands().size(), 5U);
  for (const std::string& command : commands()) {
    const Outcome help = vpsbake(folder, command + " --help");
    EXPECT_EQ(help.code, 0);
    EXPECT_NE(help.out.find("Usage: vpsbake " + command + " "), std::string::npos) << help.out;
    EXPECT_NE(help.out.find("Example: vpsbake " + command + " "), std::string::npos) << help.out;
  }
}

TEST(Help, TheCommandHelpPrintsTheSame) {
  const TemporaryFolder folder;
  EXPECT_EQ(vpsbake(folder, "help").out, vpsbake(folder, "--help").out);
  for (const char* command : {"batch", "cache stats"})
    EXPECT_EQ(vpsbake(folder, std::string("help ") + command).out,
              vpsbake(folder, std::string(command) + " --help").out);
}

TEST(Help, MessagesFitTheTerminal) {
  const TemporaryFolder folder;
  std::filesystem::copy_file(sample("thin_plate"), folder / "plate.obj");
  write_file(folder / "open.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  const auto longest_message = [&](const char* arguments, unsigned short columns) {
    std::size_t longest = 0;
    for (const std::string& line : lines_of(on_terminal(folder, "TERM=xterm NO_COLOR=1", arguments, columns))) {
      const std::size_t erased = line.rfind("\033[K");  // the progress before it
      longest = std::max(longest, erased == line.npos ? line.size() : line.size() - erased - 3);
    }
    return longest;
  };
  const char* const plate = "plate.obj --resolution 20 --cache plate.obj";  // a result, a note and a warning
  for (const char* arguments : {"open.obj", plate}) EXPECT_LE(longest_message(arguments, 60), 60U) << arguments;
  EXPECT_LE(longest_message("open.obj", 300), 100U);
  EXPECT_GT(longest_message("open.obj", 300), 80U);
}

TEST(Help, WholeNumbersHaveARange) {
  const TemporaryFolder folder;
  std::vector<std::string> all = commands();
  all.emplace_back();
  for (const std::string& command : all) {
    // An option's text ends at the next option or at the end of its group.
    const std::string help = vpsbake(folder, command + " --help").out;
    const std::regex option("\n  (--[a-z-]+) N  ([^\n]*(\n   [^\n]*)*)");
    for (std::sregex_iterator it(help.begin(), help.end(), option), end; it != end; ++it) {
      const std::string text = std::regex_replace((*it)[2].str(), std::regex("\\s+"), " ");
      EXPECT_TRUE(std::regex_search(text, std::regex("[0-9]+ to [0-9]+")))
          << command << " " << (*it)[1] << ": " << text;
    }
  }
}

TEST(Help, VersionNamesTheLibrariesFromAnyCommand) {
  const TemporaryFolder folder;
  const Outcome version = vpsbake(folder, "--version");
  EXPECT_EQ(version.code, 0);
  EXPECT_TRUE(version.out.starts_with("vpsbake " VPSBAKE_VERSION "\n")) << version.out;
  for (const char* library : {"assimp", "cgal", "cli11", "eigen", "fmt", "hdf5", "highway", "json", "png", "pugixml",
                              "tbb", "tomlplusplus", "urdfdom"}) {
    EXPECT_TRUE(std::regex_search(version.out, std::regex("\n" + std::string(library) + " [0-9.]+[0-9]\n?")))
        << library << " in " << version.out;
  }
  for (const std::string& command : commands())
    EXPECT_EQ(vpsbake(folder, command + " --version").out, version.out) << command;
  for (const char* same : {"version", "-V"}) EXPECT_EQ(vpsbake(folder, same).out, version.out) << same;
}

TEST(Help, ErrorsAndWarningsAreColouredOnTerminalsAlone) {
  const TemporaryFolder folder;
  std::filesystem::copy_file(sample("cube"), folder / "cube.obj");
  const std::string plain = "vpsbake: error: no.obj: ";
  EXPECT_TRUE(has(on_terminal(folder, "TERM=xterm", "no.obj --voxel 1mm"), "\033[1;31merror:\033[0m no.obj: "));
  const std::string kept = "cube.obj --voxel 9mm --cache cube.obj";  // a file in place of the cache folder
  EXPECT_TRUE(has(on_terminal(folder, "TERM=xterm", kept), "\033[1;33mwarning:\033[0m cube.obj: "));
  EXPECT_TRUE(has(on_terminal(folder, "TERM=xterm NO_COLOR=", "no.obj --voxel 1mm"), "\033[1;31merror:"));
  for (const char* settings : {"TERM=xterm NO_COLOR=1", "TERM=xterm NO_COLOR=0", "TERM=dumb", "TERM="})
    EXPECT_TRUE(has(on_terminal(folder, settings, "no.obj --voxel 1mm"), plain)) << settings;
  EXPECT_EQ(on_terminal(folder, "TERM=dumb", "cube.obj --voxel 9mm").find('\033'), std::string::npos);
  EXPECT_TRUE(vpsbake(folder, "no.obj --voxel 1mm").err.starts_with(plain));
}

TEST(Help, EveryCommandHasAManualPageWithoutWarnings) {
  const TemporaryFolder folder;
  write_help_files(folder);
  std::vector<std::string> pages = {"vpsbake"};
  for (const std::string& command : commands()) pages.push_back("vpsbake-" + command);
  // Without a date, so that the same program gives the same page.
  std::string lint = "true";
  if (is_there("groff")) lint += "; groff -man -Tascii -ww -z $page";
  if (is_there("mandoc")) lint += "; mandoc -T lint -W warning $page | grep -v 'missing date'";
  for (const std::string& page : pages) {
    const std::string file = "share/man/man1/" + page + ".1";
    ASSERT_TRUE(std::filesystem::exists(folder / file)) << file;
    EXPECT_EQ(from_shell(folder, "sh", "page=" + file + "; " + lint), "");
  }
  if (lint == "true") GTEST_SKIP() << "neither groff nor mandoc is installed";
}

TEST(Help, BashCompletesCommandsOptionsValuesAndFiles) {
  if (!is_there("bash")) GTEST_SKIP() << "bash is not installed";
  const TemporaryFolder folder;
  write_help_files(folder);
  using Words = std::vector<std::string>;
  for (const char* name : {"a.obj", "a b.STL", "a.txt", "a.vps.hdf", "a.toml"}) write_file(folder / name, "");
  std::filesystem::create_directory(folder / "af");
  EXPECT_EQ(from_shell(folder, "bash", ". share/bash-completion/completions/vpsbake; complete -p vpsbake"),
            "complete -F _vpsbake vpsbake\n");
  EXPECT_EQ(bash_offers(folder, "sl"), Words{"slice"});
  EXPECT_EQ(bash_offers(folder, "help-f"), Words{});
  EXPECT_EQ(bash_offers(folder, "slice --wi"), Words{"--width"});
  EXPECT_EQ(bash_offers(folder, "cache ''"), (Words{"prune", "stats", "verify"}));
  EXPECT_EQ(bash_offers(folder, "cache prune --max"), Words{"--max-size"});
  EXPECT_EQ(bash_offers(folder, "slice --axis ''"), (Words{"x", "y", "z"}));
  EXPECT_EQ(bash_offers(folder, "slice --axis = z"), Words{"z"});  // --axis=z
  EXPECT_EQ(bash_offers(folder, "slice --axis ="), (Words{"x", "y", "z"}));
  EXPECT_EQ(bash_offers(folder, "check --unit c"), Words{"cm"});
  EXPECT_EQ(bash_offers(folder, "a.obj --repair w"), (Words{"weld", "wrap"}));
  EXPECT_EQ(bash_offers(folder, "a.obj --fields layers,s"), Words{"layers,scaled"});
  EXPECT_EQ(bash_offers(folder, "a.obj --voxel ''"), Words{});
  EXPECT_EQ(bash_offers(folder, "a"), (Words{"a b.STL", "a.obj", "af"}));
  EXPECT_EQ(bash_offers(folder, "check a"), (Words{"a b.STL", "a.obj", "af"}));
  EXPECT_EQ(bash_offers(folder, "check --json a"), (Words{"a b.STL", "a.obj", "af"}));
  EXPECT_EQ(bash_offers(folder, "info a"), (Words{"a.vps.hdf", "af"}));
  EXPECT_EQ(bash_offers(folder, "scene a"), (Words{"a.toml", "af"}));
  EXPECT_EQ(bash_offers(folder, "a.obj --cache a"), Words{"af"});
  EXPECT_EQ(bash_offers(folder, "a.obj -o a.v"), Words{"a.vps.hdf"});
}

// The options that a command's --help lists.
std::vector<std::string> options_of(const std::string& command) {
  const TemporaryFolder folder;
  std::string help = vpsbake(folder, command + " --help").out;
  help.resize(std::min(help.size(), help.find("\nExample: ")));
  std::vector<std::string> names;
  const std::regex option("\n  (?:-[a-zA-Z], )?(--[a-z-]+)");
  for (std::sregex_iterator it(help.begin(), help.end(), option), end; it != end; ++it) names.push_back((*it)[1]);
  std::sort(names.begin(), names.end());
  return names;
}

TEST(Help, BashKnowsEveryOptionOfEveryCommand) {
  if (!is_there("bash")) GTEST_SKIP() << "bash is not installed";
  const TemporaryFolder folder;
  write_help_files(folder);
  for (const std::string& command : commands()) {
    std::vector<std::string> offered = bash_offers(folder, command + " --");
    std::sort(offered.begin(), offered.end());
    std::vector<std::string> known = options_of(command);
    for (const std::string& below : commands(command)) {
      for (const std::string& name : options_of(command + " " + below)) known.push_back(name);
    }
    std::sort(known.begin(), known.end());
    known.erase(std::unique(known.begin(), known.end()), known.end());
    EXPECT_EQ(offered, known) << command;
  }
}

// Types a line into an interactive zsh on its own terminal and prints the completions offered at its end.
constexpr const char* kCapture = R"(zmodload zsh/zpty
zpty z zsh -f -i
zpty -w z "PROMPT=; fpath=(share/zsh/site-functions \$fpath); autoload -Uz compinit; compinit -D -u
compadd() {
  [[ \${@[1,(i)(-|--)]} == *-(O|A|D)\ * ]] || { local -a hits; builtin compadd -A hits \"\$@\"; print -l -- '<hit>'\$^hits; }
  builtin compadd \"\$@\"
}
capture() { _main_complete; print -n '<end>'; compstate[insert]= compstate[list]=; }
zle -C capture complete-word capture; bindkey '^I' capture; print -n '<rea''dy>'"
zpty -r z out '*<ready>*'
zpty -w -n z "$1"$'\t'
zpty -r z out '*<end>'
print -r -- "$out" | tr -d '\r' | sed -n 's/.*<hit>//p' | LC_ALL=C sort -u
zpty -d z
)";

TEST(Help, ZshCompletesCommandsOptionsValuesAndFiles) {
  if (!is_there("zsh")) GTEST_SKIP() << "zsh is not installed";
  const TemporaryFolder folder;
  write_help_files(folder);
  EXPECT_EQ(from_shell(folder, "sh", "zsh -n share/zsh/site-functions/_vpsbake"), "");
  for (const char* name : {"a.obj", "a.vps.hdf", "a.txt"}) write_file(folder / name, "");
  write_file(folder / "capture", kCapture);
  using Words = std::vector<std::string>;
  const auto offers = [&](const std::string& line) {
    return lines_of(from_shell(folder, "sh", "timeout 60 zsh -f capture 'vpsbake " + line + "'"));
  };
  EXPECT_EQ(offers("sl"), Words{"slice"});
  EXPECT_EQ(offers("check --unit "), (Words{"cm", "in", "m", "mm"}));
  EXPECT_EQ(offers("scene --dry-run --c"), Words{"--cache"});  // not --compare, which it excludes
  EXPECT_EQ(offers("a.obj --parts voxelmap,"), Words{"pointshell"});
  EXPECT_EQ(offers("check a"), Words{"a.obj"});
  EXPECT_EQ(offers("info a"), Words{"a.vps.hdf"});
}

}  // namespace
}  // namespace vps::test
