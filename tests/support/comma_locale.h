// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Sets a locale in which the decimal point is a comma, for a test; its destructor resets it.
#pragma once

#include <clocale>
#include <cstdlib>
#include <string>

#include "tests/support/temporary_folder.h"

namespace vps::test {

class CommaLocale {
 public:
  CommaLocale() {
    const std::string command = "localedef -i de_DE -f UTF-8 " + (folder_ / "comma").string() + " >/dev/null 2>&1";
    if (std::system(command.c_str()) != 0) return;
    ::setenv("LOCPATH", folder_.path().c_str(), 1);
    is_set_ = std::setlocale(LC_ALL, "comma") != nullptr;
  }
  CommaLocale(const CommaLocale&) = delete;
  CommaLocale& operator=(const CommaLocale&) = delete;
  ~CommaLocale() {
    std::setlocale(LC_ALL, "C");
    ::unsetenv("LOCPATH");
  }
  /// False where Debian's package `locales` is absent.
  [[nodiscard]] bool is_set() const { return is_set_; }

 private:
  TemporaryFolder folder_;
  bool is_set_ = false;
};

}  // namespace vps::test
