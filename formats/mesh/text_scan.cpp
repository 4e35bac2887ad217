// SPDX-License-Identifier: GPL-3.0-or-later
#include "formats/mesh/text_scan.h"

#include <algorithm>
#include <cctype>
#include <cmath>

#include "formats/mesh/raw_mesh.h"
#include "formats/mesh/tidy.h"

namespace vps {
namespace {

NumberKind parse_number(std::string_view word, double& value) {
  if (word.starts_with('+') && !word.starts_with("+-")) word.remove_prefix(1);
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (error == std::errc::invalid_argument || end != word.data() + word.size()) return NumberKind::none;
  return error == std::errc() && std::isfinite(value) ? NumberKind::finite : NumberKind::not_finite;
}

}  // namespace

NumberKind number_kind(std::string_view word) {
  double value = 0;
  return parse_number(word, value);
}

std::string in_quotes(std::string_view word) {
  constexpr std::size_t kLongest = 24;
  std::string text(word.substr(0, kLongest));
  // A zero byte would end the message.
  std::replace_if(
      text.begin(), text.end(), [](char c) { return std::isgraph(static_cast<unsigned char>(c)) == 0; }, '?');
  return "'" + text + (word.size() > kLongest ? "...'" : "'");
}

void unify_line_ends(std::string& text) {
  if (text.starts_with("\xEF\xBB\xBF")) text.replace(0, 3, 3, ' ');
  std::size_t to = std::min(text.find('\r'), text.size());
  for (std::size_t from = to; from < text.size(); ++from) {
    const bool carriage_return = text[from] == '\r';
    if (carriage_return && from + 1 < text.size() && text[from + 1] == '\n') continue;
    text[to++] = carriage_return ? '\n' : text[from];
  }
  text.resize(to);
}

bool LineScan::next() {
  if (at_ >= text_.size()) return false;
  const std::size_t end = std::min(text_.find('\n', at_), text_.size());
  line_ = text_.substr(at_, end - at_);
  at_ = std::min(end + 1, text_.size());
  ++number_;
  return true;
}

bool LineScan::next_with_content() {
  while (next()) {
    line_ = line_.substr(0, line_.find('#'));
    std::string_view rest = line_;
    if (!take_word(rest).empty()) return true;
  }
  return false;
}

double check_number(std::string_view word, const LineScan& at) {
  double value = 0;
  switch (parse_number(word, value)) {
    case NumberKind::finite:
      break;
    case NumberKind::not_finite:
      throw NeedsAssimp(at.place() + in_quotes(word) + " is not a finite number");
    case NumberKind::none:
      throw ReadError(at.place() + (word.empty() ? "a number is missing" : in_quotes(word) + " is no number"));
  }
  return value;
}

}  // namespace vps
