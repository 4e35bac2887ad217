// SPDX-License-Identifier: GPL-3.0-or-later
/// @file What tests of pages ask of every page.
#pragma once

#include "tests/cli/program.h"
#include "tests/support/browser.h"

namespace vps::test {

/// The page in a small window; sound.
inline PageVisit visit_small(const std::filesystem::path& page, const std::string& script) {
  VisitOptions options;
  options.width = 800;
  options.height = 500;
  options.script = script;
  PageVisit visit = visit_page(page, options);
  expect_sound(visit, 0.05);
  return visit;
}

/// The page as a desktop in light and a phone in dark show it; sound on both.
inline PageVisit visit_everywhere(const std::filesystem::path& page, const std::string& script) {
  VisitOptions phone;
  phone.width = 390;
  phone.height = 844;
  phone.theme = Theme::dark;
  phone.script = script;
  expect_sound(visit_page(page, phone), 0.05);
  VisitOptions desktop;
  desktop.script = script;
  PageVisit visit = visit_page(page, desktop);
  expect_sound(visit, 0.05);
  return visit;
}

}  // namespace vps::test
