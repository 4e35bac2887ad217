// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/depfile.h"

#include <fstream>
#include <string>
#include <system_error>

#include "cli/output_file.h"

namespace vps::cli {
namespace {

namespace fs = std::filesystem;

// As GCC's -MD: backslashes count twice before a space alone.
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

// Whether a file is empty, or its first line is that of a rule.
bool is_depfile(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::string line;
  if (!std::getline(in, line)) return in.eof();
  constexpr std::size_t kLongest = 1 << 16;
  return line.size() < kLongest && (line.ends_with(": \\") || line.ends_with(":"));
}

}  // namespace

std::string depfile_text(const fs::path& target, const std::vector<fs::path>& files) {
  std::string out = escaped(target.string()) + ":";
  for (const fs::path& file : files) out += " \\\n  " + escaped(file.string());
  out += '\n';
  // Rules without a recipe, so that make goes on when one of them is removed.
  for (const fs::path& file : files) out += escaped(file.string()) + ":\n";
  return out;
}

std::string depfile_refusal(const fs::path& depfile, const fs::path& target, const std::vector<fs::path>& files) {
  std::error_code ignored;
  if (depfile.lexically_normal() == target.lexically_normal()) return "this is the asset; choose another --depfile";
  bool listable = target.string().find('\n') == std::string::npos;
  for (const fs::path& file : files) {
    if (fs::equivalent(file, depfile, ignored)) return "this is a file of the mesh; choose another --depfile";
    listable = listable && file.string().find('\n') == std::string::npos;
  }
  if (!listable) return "make knows no names with line breaks; rename the mesh or the asset";
  if (std::string reason = output_refusal(depfile, "", "a depfile"); !reason.empty()) return reason;
  if (!fs::exists(depfile, ignored) || is_depfile(depfile)) return "";
  return "the file exists and is not a depfile; remove it or choose another --depfile";
}

}  // namespace vps::cli
