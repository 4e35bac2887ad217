// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Checks that tests apply to every page.
#pragma once

#include "tests/cli/program.h"
#include "tests/support/browser.h"

namespace vps::test {

/// Script: the painted share of the three-dimensional view, without the controls around it.
inline constexpr const char* kPaintedShare =
    "(() => {"
    "  const copy = Object.assign(document.createElement('canvas'), {width: 200, height: 200});"
    "  copy.getContext('2d').drawImage(document.querySelector('#view canvas'), 0, 0, 200, 200);"
    "  const data = copy.getContext('2d').getImageData(0, 0, 200, 200).data;"
    "  let n = 0; for (let i = 3; i < data.length; i += 4) n += data[i] > 0; return n / 40000;"
    "})()";

/// Visits the page in a small window and expects it to be sound.
inline PageVisit visit_small(const std::filesystem::path& page, const std::string& script) {
  VisitOptions options;
  options.width = 800;
  options.height = 500;
  options.script = script;
  PageVisit visit = visit_page(page, options);
  expect_sound(visit, 0.05);
  return visit;
}

/// Visits the page on a phone in dark and on a desktop in light theme, and expects it to be sound on both.
/// @return the desktop's visit
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
