// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Opens a page of the file system in its own headless Chromium, without network. Returns the console's messages,
/// the page after its scripts, and a screenshot.
#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tests/support/image.h"

namespace vps::test {

enum class Theme { light, dark };

struct VisitOptions {
  int width = 1280;  ///< of the window; a phone has 390 x 844. [px]
  int height = 800;
  Theme theme = Theme::light;
  std::string script;    ///< JavaScript run in the loaded page, such as "document.querySelector('button').click(), 3";
                         ///< its value, or the result of its promise, becomes PageVisit::value
  double timeout = 120;  ///< of the whole visit; then the browser is killed. [s]
};

struct PageVisit {
  std::string failure;                     ///< why the visit failed; empty: it succeeded
  std::vector<std::string> complaints;     ///< console errors and warnings, uncaught exceptions, violations of the CSP
  std::vector<std::string> requests;       ///< requested addresses, allowed or refused, without the page itself, data:
                                           ///< and blob:
  std::vector<std::string> network_links;  ///< every src, and every href of link, image and use, with a network address
  std::string dom;                         ///< after the scripts ran
  std::string text;                        ///< visible text of the page
  nlohmann::json value;                    ///< of VisitOptions::script
  int page_width = 0;                      ///< wider than the window: the page scrolls sideways. [px]
  std::string screenshot;                  ///< of the window, PNG
  Image picture;                           ///< the same, decoded
};

/// Path of Chromium; empty: not in PATH.
[[nodiscard]] std::filesystem::path find_browser();

/// Opens the page, waits until it has loaded and painted, runs the script and waits again. Any number of programs may
/// call this at a time. The caller must have no other child processes: they would be reaped with the browser's. With
/// VPS_SCREENSHOTS=FOLDER in the environment the screenshot is kept there, named after the test and the page.
[[nodiscard]] PageVisit visit_page(const std::filesystem::path& page, const VisitOptions& options = {});

/// Expects that the visit succeeded without complaints, that the page needs no network and fits the window's width, and
/// that at least `painted` of the window is not background.
void expect_sound(const PageVisit& visit, double painted = 0.01);

}  // namespace vps::test

/// Skips the test where there is no browser.
#define VPS_BROWSER_OR_SKIP() \
  if (vps::test::find_browser().empty()) GTEST_SKIP() << "needs chromium, which is absent"
