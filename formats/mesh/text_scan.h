// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Lines, words and numbers of a text, without copies. Internal to mesh import.
#pragma once

#include <charconv>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace vps {

inline bool is_blank(char c) {
  return c == ' ' || c == '\t' || c == '\r' || c == '\v' || c == '\f';
}

/// Cuts the first word off `line` and returns it; empty at the end of the line.
inline std::string_view take_word(std::string_view& line) {
  std::size_t begin = 0;
  while (begin < line.size() && is_blank(line[begin])) ++begin;
  std::size_t end = begin;
  while (end < line.size() && !is_blank(line[end])) ++end;
  const std::string_view word = line.substr(begin, end - begin);
  line.remove_prefix(end);
  return word;
}

/// The whole word as an integer.
inline std::optional<std::int64_t> to_integer(std::string_view word) {
  if (word.starts_with('+') && !word.starts_with("+-")) word.remove_prefix(1);
  std::int64_t value = 0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (error != std::errc() || end != word.data() + word.size()) return std::nullopt;
  return value;
}

enum class NumberKind { finite, not_finite, none };

/// Whether the whole word is a number; one that a double cannot hold counts as not finite.
NumberKind number_kind(std::string_view word);

/// For messages: in quotes, printable and not too long.
std::string in_quotes(std::string_view word);

/// Line ends of DOS and of old Macs become '\n'; a byte order mark is blanked.
void unify_line_ends(std::string& text);

/// Walks through the lines of a text. Numbers them from 1.
class LineScan {
 public:
  explicit LineScan(std::string_view text) : text_(text) {}
  /// Moves to the next line. False at the end of the text.
  bool next();
  /// Moves to the next line that has more than blanks and a comment after '#'. Cuts the comment off.
  bool next_with_content();
  [[nodiscard]] std::string_view line() const { return line_; }
  /// Offset of the line after this one.
  [[nodiscard]] std::size_t end() const { return at_; }
  /// "line 12: " for messages.
  [[nodiscard]] std::string place() const { return "line " + std::to_string(number_) + ": "; }
  void set_number(std::size_t number) { number_ = number; }
  [[nodiscard]] std::size_t number() const { return number_; }

 private:
  std::string_view text_, line_;
  std::size_t at_ = 0, number_ = 0;
};

/// @return a coordinate
/// @throw ReadError when the word is no number, NeedsAssimp when it is not finite, because CGAL stops there
double check_number(std::string_view word, const LineScan& at);

}  // namespace vps
