// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/terminal/wrapped.h"

#include <unistd.h>

#include <algorithm>
#include <sstream>
#include <string_view>

#include "cli/terminal/terminal.h"

namespace vps::cli {
namespace {

// Columns that a text takes: each UTF-8 character one, escape sequences none.
std::size_t columns(std::string_view text) {
  std::size_t count = 0;
  bool escape = false;
  for (const char c : text) {
    if (c == '\033') escape = true;
    if (!escape && (static_cast<unsigned char>(c) & 0xC0U) != 0x80U) ++count;
    if (escape && c == 'm') escape = false;
  }
  return count;
}

// Where a line's text continues: below its last column of a table, or two further than it begins.
std::size_t hanging_indent(const std::string& line, std::size_t width) {
  const std::size_t begin = std::min(line.find_first_not_of(' '), line.size());
  std::size_t indent = begin + 2;
  for (std::size_t at = line.find("  ", begin); at != line.npos; at = line.find("  ", at)) {
    at = std::min(line.find_first_not_of(' ', at), line.size());
    const std::size_t column = columns(std::string_view(line).substr(0, at));
    if (column > width / 2) break;
    indent = column;
  }
  return std::min(indent, width / 2);
}

std::string folded(const std::string& line, std::size_t width) {
  if (columns(line) <= width) return line;
  const std::size_t indent = hanging_indent(line, width);
  std::string out;
  std::size_t used = 0;
  for (std::size_t at = 0; at < line.size();) {
    const std::size_t word = std::min(line.find_first_not_of(' ', at), line.size());
    const std::size_t end = std::min(line.find(' ', word), line.size());
    const std::string text = line.substr(word, end - word);
    const std::size_t spaces = word - at;
    if (!out.empty() && used + spaces + columns(text) > width) {
      out += '\n' + std::string(indent, ' ') + text;
      used = indent + columns(text);
    } else {
      out += std::string(spaces, ' ') + text;
      used += spaces + columns(text);
    }
    at = end;
  }
  return out;
}

}  // namespace

std::string wrapped(const std::string& text, std::size_t width, std::size_t indent) {
  std::string out;
  std::size_t at = indent;
  std::istringstream words(text);
  for (std::string word; words >> word;) {
    if (at > indent && at + 1 + word.size() > width) {
      out += "\n" + std::string(indent, ' ');
      at = indent;
    }
    out += (at > indent ? " " : "") + word;
    at += (at > indent ? 1 : 0) + word.size();
  }
  return out;
}

std::string fitted(const std::string& text, int fd) {
  if (::isatty(fd) == 0) return text;
  const auto width = static_cast<std::size_t>(std::clamp(columns_of(fd), 40, 100));
  std::string out;
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = std::min(text.find('\n', begin), text.size());
    out += folded(text.substr(begin, end - begin), width);
    if (end < text.size()) out += '\n';
    begin = end + 1;
  }
  return out;
}

}  // namespace vps::cli
