// SPDX-License-Identifier: GPL-3.0-or-later
#include "formats/mesh/read_off.h"

#include <limits>

#include "formats/mesh/raw_mesh.h"
#include "formats/mesh/text_scan.h"
#include "formats/mesh/tidy.h"

namespace vps {
namespace {

struct Header {
  std::uint64_t vertices = 0, faces = 0;
  bool homogeneous = false;
};

void need_line(LineScan& lines) {
  if (!lines.next_with_content()) throw ReadError("the file ends before its last vertex or face");
}

// The header's next word. Numbers may follow the keyword on its line or be on a line of their own.
std::string_view header_word(LineScan& lines, std::string_view& rest) {
  std::string_view word = take_word(rest);
  if (!word.empty()) return word;
  need_line(lines);
  rest = lines.line();
  return take_word(rest);
}

std::uint64_t count(std::string_view word, const LineScan& lines) {
  const auto value = to_integer(word);
  if (!value || *value < 0) throw ReadError(lines.place() + in_quotes(word) + " is no count");
  return static_cast<std::uint64_t>(*value);
}

// [ST][C][N][4][n]OFF; the keyword may be left out.
Header read_header(LineScan& lines, std::size_t file_bytes) {
  need_line(lines);
  std::string_view rest = lines.line();
  std::string_view word = take_word(rest);
  Header header;
  bool dimension_follows = false;
  if (!to_integer(word)) {
    const std::string_view keyword = word;
    if (word.starts_with("ST")) word.remove_prefix(2);
    for (const char letter : {'C', 'N', '4', 'n'}) {
      if (!word.starts_with(letter)) continue;
      word.remove_prefix(1);
      header.homogeneous |= letter == '4';
      dimension_follows |= letter == 'n';
    }
    if (word != "OFF") throw ReadError(lines.place() + in_quotes(keyword) + " is no OFF header");
    word = header_word(lines, rest);
  }
  if (word == "BINARY") throw ReadError("binary OFF is not supported");
  if (dimension_follows) {
    if (word != "3") throw ReadError(lines.place() + "the mesh has " + in_quotes(word) + " dimensions, not 3");
    word = header_word(lines, rest);
  }
  header.vertices = count(word, lines);
  header.faces = count(header_word(lines, rest), lines);
  // A third number, of edges, is often left out.
  if (!(word = take_word(rest)).empty()) (void)count(word, lines);
  if (!take_word(rest).empty()) throw ReadError(lines.place() + "more than three numbers in the header");
  // The shortest vertex is "0 0 0\n", the shortest face "0\n".
  const std::uint64_t room = file_bytes + 2;
  if (header.vertices > room / 6 || header.faces > room / 2 || header.vertices * 6 + header.faces * 2 > room) {
    throw ReadError("the header promises " + std::to_string(header.vertices) + " vertices and " +
                    std::to_string(header.faces) + " faces, more than " + std::to_string(file_bytes) +
                    " bytes can hold");
  }
  constexpr std::uint64_t kMost = std::numeric_limits<std::int32_t>::max();
  if (header.vertices > kMost || header.faces > kMost) throw ReadError("the file has more than 2^31 vertices or faces");
  return header;
}

// Colours, normals and texture coordinates may follow.
std::array<double, 3> read_vertex(const LineScan& lines, const Header& header) {
  std::string_view rest = lines.line();
  std::array<double, 3> position{};
  for (double& x : position) x = check_number(take_word(rest), lines);
  if (header.homogeneous) (void)check_number(take_word(rest), lines);
  return position;
}

// A colour may follow.
void read_face(const LineScan& lines, const Header& header, PolygonSoup& soup) {
  std::string_view rest = lines.line();
  for (std::uint64_t corners = count(take_word(rest), lines); corners > 0; --corners) {
    const std::string_view word = take_word(rest);
    if (word.empty()) throw ReadError(lines.place() + "the face has too few corners");
    soup.corners.push_back(count(word, lines));
    if (soup.corners.back() >= header.vertices)
      throw ReadError(lines.place() + "a face refers to vertex " + in_quotes(word) + ", which is not there");
  }
  soup.end_polygon();
}

}  // namespace

PolygonSoup read_off(std::string& text) {
  unify_line_ends(text);
  LineScan lines(text);
  const Header header = read_header(lines, text.size());
  PolygonSoup soup;
  soup.vertices.reserve(header.vertices);
  soup.corners.reserve(3 * header.faces);
  soup.ends.reserve(header.faces);
  for (std::uint64_t i = 0; i < header.vertices; ++i) {
    need_line(lines);
    soup.vertices.push_back(read_vertex(lines, header));
  }
  for (std::uint64_t i = 0; i < header.faces; ++i) {
    need_line(lines);
    read_face(lines, header, soup);
  }
  if (lines.next_with_content()) throw ReadError(lines.place() + "the file goes on after its last face");
  if (header.homogeneous) throw NeedsAssimp("its coordinates are homogeneous");
  return soup;
}

}  // namespace vps
