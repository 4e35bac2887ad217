// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <limits>

#include "formats/mesh/raw_mesh.h"
#include "formats/mesh/text_scan.h"
#include "formats/mesh/tidy.h"

namespace vps {
namespace {

// Statements without polygons: attributes, groups, display, free-form curves and surfaces.
constexpr std::string_view kWithoutPolygons[] = {
    "vt",     "vn",    "vp",       "g",        "s",          "o",        "mg",     "usemtl", "mtllib", "usemap",
    "maplib", "bevel", "c_interp", "d_interp", "lod",        "ctech",    "stech",  "cstype", "deg",    "step",
    "bmat",   "con",   "curv",     "curv2",    "surf",       "parm",     "trim",   "hole",   "scrv",   "sp",
    "end",    "bsp",   "bzp",      "cdc",      "cdp",        "res",      "surf_1", "surf_2", "q0_1",   "q0_2",
    "q1_1",   "q1_2",  "curv2d_1", "curv2d_2", "shadow_obj", "trace_obj"};

void blank(std::string& text, std::string_view part) {
  std::fill_n(text.begin() + (part.data() - text.data()), part.size(), ' ');
}

// A backslash at the end of a line continues the line, except in a comment, where a path may end with one.
void join_continued_lines(std::string& text) {
  bool comment = false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] == '#') comment = true;
    if (text[i] == '\\' && i + 1 < text.size() && text[i + 1] == '\n' && !comment) text[i] = text[i + 1] = ' ';
    if (text[i] == '\n') comment = false;
  }
}

void check_vertex(std::string_view rest, const LineScan& at, std::string& text) {
  for (int axis = 0; axis < 3; ++axis) check_number(take_word(rest), at);
  const std::string_view attributes = rest;
  int more = 0;
  std::string_view last;
  for (std::string_view word = take_word(rest); !word.empty(); word = take_word(rest)) last = word, ++more;
  double weight = 1;
  if (more == 1) std::from_chars(last.data(), last.data() + last.size(), weight);
  if (weight != 1) throw NeedsAssimp(at.place() + "the vertex has the weight " + in_quotes(last));
  // Three or four more are a colour.
  if (more == 2 || more > 4) throw ReadError(at.place() + "a vertex of " + std::to_string(3 + more) + " numbers");
  blank(text, attributes);
}

// v, v/vt, v//vn, v/vt/vn: only the first number is used, but all must be valid.
void check_corner(std::string_view word, const LineScan& at) {
  std::string_view rest = word;
  for (int part = 0; part < 3; ++part) {
    const std::size_t slash = std::min(rest.find('/'), rest.size());
    const std::string_view number = rest.substr(0, slash);
    const auto index = to_integer(number);
    const bool left_out = part > 0 && number.empty();
    if (!index && !left_out) break;
    constexpr std::int64_t kMost = std::numeric_limits<std::int32_t>::max();
    if (part == 0 && (*index == 0 || *index > kMost || *index < -kMost))
      throw ReadError(at.place() + "a face refers to vertex " + in_quotes(number) + ", which is not there");
    if (slash == rest.size()) return;
    rest.remove_prefix(slash + 1);
  }
  throw ReadError(at.place() + in_quotes(word) + " is no corner of a face");
}

}  // namespace

std::uint64_t tidy_obj(std::string& text) {
  unify_line_ends(text);
  join_continued_lines(text);
  std::uint64_t skipped = 0;
  LineScan lines(text);
  while (lines.next()) {
    const std::string_view line = lines.line();
    const std::size_t comment = std::min(line.find('#'), line.size());
    blank(text, line.substr(comment));
    std::string_view rest = line.substr(0, comment);
    const std::string_view keyword = take_word(rest);
    if (keyword == "v") {
      check_vertex(rest, lines, text);
    } else if (keyword == "f") {
      for (std::string_view word = take_word(rest); !word.empty(); word = take_word(rest)) check_corner(word, lines);
    } else if (keyword == "l" || keyword == "p") {
      ++skipped;
      blank(text, line);
    } else if (std::find(std::begin(kWithoutPolygons), std::end(kWithoutPolygons), keyword) !=
               std::end(kWithoutPolygons)) {
      blank(text, line);
    } else if (!keyword.empty()) {
      throw NeedsAssimp(lines.place() + "unknown word " + in_quotes(keyword));
    }
  }
  // CGAL reads a tab as a part of the corner.
  std::replace_if(text.begin(), text.end(), is_blank, ' ');
  return skipped;
}

}  // namespace vps
