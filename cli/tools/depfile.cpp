// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/tools/depfile.h"

#include <fmt/format.h>

#include <fstream>
#include <string>
#include <string_view>
#include <system_error>

#include "cli/tools/output_file.h"
#include "cli/tools/utf8.h"

namespace vps::cli {
namespace {

namespace fs = std::filesystem;

// Escapes as GCC's -MD does: backslashes are doubled only before a space.
std::string escaped(const std::string& name) {
  std::string out;
  std::size_t backslashes = 0;
  for (const char c : name) {
    if (c == ' ' || c == '\t') out += std::string(backslashes + 1, '\\');
    if (c == '#' || c == ':') out += '\\';
    if (c == '$') out += '$';
    out += c;
    backslashes = c == '\\' ? backslashes + 1 : 0;
  }
  return out;
}

// Whether a file is empty, or its first line begins a rule for an asset or a manifest.
bool is_depfile(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::string line;
  if (!std::getline(in, line)) return in.eof();
  constexpr std::size_t kLongest = 1 << 16;
  if (line.size() >= kLongest) return false;
  if (line.ends_with(" \\")) line.resize(line.size() - 2);
  return line.ends_with(".vps.hdf:") || line.ends_with("vpsbake.json:");
}

// What make does not allow in this name; empty: the name is allowed.
std::string_view unlistable(const fs::path& file) {
  const std::string name = file.string();
  if (name.find('\n') != std::string::npos) return "line breaks";
  for (const std::string_view sign : {"=", ";", "|"}) {
    if (name.find(sign) != std::string::npos) return sign;
  }
  return "";
}

}  // namespace

std::string depfile_text(const fs::path& target, std::vector<fs::path> files) {
  // For a missing file, make and ninja would run the rule every time.
  std::erase_if(files, [](const fs::path& file) {
    std::error_code ignored;
    return !fs::exists(file, ignored);
  });
  std::string out = escaped(target.string()) + ":";
  for (const fs::path& file : files) out += " \\\n  " + escaped(file.string());
  out += '\n';
  // Rules without a recipe, so that make continues when one of the files is removed.
  for (const fs::path& file : files) out += escaped(file.string()) + ":\n";
  return out;
}

std::string depfile_refusal(const fs::path& depfile, const std::vector<fs::path>& targets,
                            const std::vector<fs::path>& files) {
  std::error_code ignored;
  for (const fs::path& target : targets) {
    if (target.filename() == depfile.filename() && is_same_place(target, depfile))
      return "this is written already; choose another --depfile";
  }
  fs::path named = targets.front();
  std::string_view sign = named.string().find('%') != std::string::npos ? "%" : unlistable(named);
  for (const fs::path& file : files) {
    if (fs::equivalent(file, depfile, ignored)) return "this is a file of the mesh; choose another --depfile";
    if (!sign.empty()) continue;
    named = file;
    sign = unlistable(file);
  }
  if (!sign.empty()) return fmt::format("make knows no names with {}; rename {}", sign, one_line(named.string()));
  if (std::string reason = output_refusal(depfile, "", "a depfile"); !reason.empty()) return reason;
  if (!fs::exists(depfile, ignored) || is_depfile(depfile)) return "";
  return "the file exists and is not a depfile; remove it or choose another --depfile";
}

}  // namespace vps::cli
