// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <cctype>
#include <utility>

#include "formats/mesh/raw_mesh.h"
#include "formats/mesh/text_scan.h"
#include "formats/mesh/tidy.h"

namespace vps {
namespace {

/// The words of a text one after the other, across lines.
class WordScan {
 public:
  explicit WordScan(std::string_view text) : lines_(text) {}
  /// Empty at the end of the text.
  std::string_view next() {
    while (true) {
      if (const std::string_view word = take_word(rest_); !word.empty()) return word;
      if (!lines_.next()) return {};
      rest_ = lines_.line();
    }
  }
  std::string_view take_rest_of_line() { return std::exchange(rest_, {}); }
  [[nodiscard]] const LineScan& lines() const { return lines_; }

 private:
  LineScan lines_;
  std::string_view rest_;
};

}  // namespace

void tidy_stl(std::string& bytes) {
  unify_line_ends(bytes);
  // Some exporters write capitals. An exponent may be written either way.
  for (char& c : bytes) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  const auto blank = [&](std::string_view part) {
    std::fill_n(bytes.begin() + (part.data() - bytes.data()), part.size(), ' ');
  };
  WordScan words(bytes);
  std::string_view word = words.next();
  if (word != "solid") throw ReadError("neither text that begins with 'solid' nor binary data of the size it states");
  const auto place = [&] { return words.lines().place(); };
  bool open = false;
  bool in_facet = false;
  int corners = 0;
  for (; !word.empty(); word = words.next()) {
    if (word == "solid" || word == "endsolid") {
      if (in_facet) throw ReadError(place() + "a facet has no end");
      const bool opens = word == "solid";
      // A name may hold any word. A solid without an end continues with the next one.
      if (opens == open) blank(word);
      open = opens;
      blank(words.take_rest_of_line());
    } else if (word == "facet" && !in_facet) {
      in_facet = true;
      corners = 0;
    } else if (word == "vertex" && in_facet) {
      for (int axis = 0; axis < 3; ++axis) check_number(words.next(), words.lines());
      ++corners;
    } else if (word == "endfacet" && in_facet) {
      if (corners != 3) throw ReadError(place() + "a facet of " + std::to_string(corners) + " corners");
      in_facet = false;
    } else if (word == "normal" && in_facet) {
      // The normal is not used, and is often not a number.
      for (int axis = 0; axis < 3; ++axis) words.next();
    } else if (word != "outer" && word != "loop" && word != "endloop") {
      throw ReadError(place() + "unexpected word " + in_quotes(word));
    }
  }
  if (in_facet) throw ReadError("the file ends inside a facet");
  if (open) throw NeedsAssimp("its last solid has no end");
}

}  // namespace vps
