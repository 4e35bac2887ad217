// SPDX-License-Identifier: GPL-3.0-or-later
#include "formats/mesh/read_obj.h"

#include <algorithm>
#include <limits>
#include <string_view>

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

// A backslash at the end of a line continues the line, except in a comment, where a path may end with one.
void join_continued_lines(std::string& text) {
  if (text.find('\\') == std::string::npos) return;
  bool comment = false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] == '#') comment = true;
    if (text[i] == '\\' && i + 1 < text.size() && text[i + 1] == '\n' && !comment) text[i] = text[i + 1] = ' ';
    if (text[i] == '\n') comment = false;
  }
}

std::array<double, 3> read_vertex(std::string_view rest, const LineScan& at) {
  std::array<double, 3> position{};
  for (double& x : position) x = check_number(take_word(rest), at);
  int more = 0;
  std::string_view last;
  for (std::string_view word = take_word(rest); !word.empty(); word = take_word(rest)) last = word, ++more;
  double weight = 1;
  if (more == 1) std::from_chars(last.data(), last.data() + last.size(), weight);
  if (weight != 1) throw NeedsAssimp(at.place() + "the vertex has the weight " + in_quotes(last));
  // Three or four more are a colour.
  if (more == 2 || more > 4) throw ReadError(at.place() + "a vertex of " + std::to_string(3 + more) + " numbers");
  return position;
}

// v, v/vt, v//vn, v/vt/vn: only the first number is used, but all must be valid.
// @param vertices  before the face; a negative number counts back from there
std::size_t read_corner(std::string_view word, std::size_t vertices, const LineScan& at) {
  std::string_view rest = word;
  std::int64_t vertex = 0;
  for (int part = 0; part < 3; ++part) {
    const std::size_t slash = std::min(rest.find('/'), rest.size());
    const std::string_view number = rest.substr(0, slash);
    const auto index = to_integer(number);
    const bool left_out = part > 0 && number.empty();
    if (!index && !left_out) break;
    constexpr std::int64_t kMost = std::numeric_limits<std::int32_t>::max();
    if (part == 0 && (*index == 0 || *index > kMost || *index < -kMost))
      throw ReadError(at.place() + "a face refers to vertex " + in_quotes(number) + ", which is not there");
    if (part == 0) vertex = *index;
    if (slash == rest.size())
      return static_cast<std::size_t>(vertex > 0 ? vertex - 1 : static_cast<std::int64_t>(vertices) + vertex);
    rest.remove_prefix(slash + 1);
  }
  throw ReadError(at.place() + in_quotes(word) + " is no corner of a face");
}

}  // namespace

PolygonSoup read_obj(std::string& text) {
  unify_line_ends(text);
  join_continued_lines(text);
  PolygonSoup soup;
  // More than most files need. Memory that is never written takes none.
  soup.vertices.reserve(text.size() / 48);
  soup.corners.reserve(text.size() / 8);
  soup.ends.reserve(text.size() / 24);
  LineScan lines(text);
  while (lines.next()) {
    std::string_view rest = lines.line().substr(0, lines.line().find('#'));
    const std::string_view keyword = take_word(rest);
    if (keyword == "v") {
      soup.vertices.push_back(read_vertex(rest, lines));
    } else if (keyword == "f") {
      for (std::string_view word = take_word(rest); !word.empty(); word = take_word(rest))
        soup.corners.push_back(read_corner(word, soup.vertices.size(), lines));
      soup.end_polygon();
    } else if (keyword == "l" || keyword == "p") {
      ++soup.skipped_primitives;
    } else if (!keyword.empty() && std::find(std::begin(kWithoutPolygons), std::end(kWithoutPolygons), keyword) ==
                                       std::end(kWithoutPolygons)) {
      throw NeedsAssimp(lines.place() + "unknown word " + in_quotes(keyword));
    }
  }
  return soup;
}

}  // namespace vps
