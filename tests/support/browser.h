// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Visits a page of the file system in a headless Chromium of its own, without network, and tells what a reader
/// would meet: what the console says, what the scripts made of the page, and how it looks.
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
  int width = 1280;  ///< of the window, a phone has 390 x 844. [px]
  int height = 800;
  Theme theme = Theme::light;
  std::string script;    ///< JavaScript run in the loaded page, such as "document.querySelector('button').click(), 3";
                         ///< its value, or what its promise gives, becomes PageVisit::value
  double timeout = 120;  ///< of the whole visit, the browser is killed then. [s]
};

struct PageVisit {
  std::string failure;                     ///< why there was no visit; empty: there was one
  std::vector<std::string> complaints;     ///< console errors and warnings, uncaught exceptions, violations of the CSP
  std::vector<std::string> requests;       ///< addresses asked for, whether or not they were allowed, but for the page
                                           ///< itself, data: and blob:
  std::vector<std::string> network_links;  ///< every src, and href of link elements, that leads into a network
  std::string dom;                         ///< after the scripts ran
  std::string text;                        ///< of it, as a reader sees it
  nlohmann::json value;                    ///< of VisitOptions::script
  int page_width = 0;                      ///< more than the window's: it scrolls sideways. [px]
  std::string screenshot;                  ///< of the window, PNG
  Image picture;                           ///< the same, decoded
};

/// Where Chromium is; empty: nowhere in PATH.
[[nodiscard]] std::filesystem::path find_browser();

/// Opens the page, waits for it to load and to paint, runs the script, waits again. Any number of programs may do so at
/// a time, but the caller must have no child processes of its own: their ends would be taken for the browser's. With
/// VPS_SCREENSHOTS=FOLDER in the environment the screenshot is kept there, by the test's and the page's name.
[[nodiscard]] PageVisit visit_page(const std::filesystem::path& page, const VisitOptions& options = {});

/// Expects that the page was visited, complains of nothing, asks for no network, fits the window's width, and that at
/// least `painted` of the window is not background.
void expect_sound(const PageVisit& visit, double painted = 0.01);

}  // namespace vps::test

/// Skips the test where there is no browser.
#define VPS_BROWSER_OR_SKIP() \
  if (vps::test::find_browser().empty()) GTEST_SKIP() << "needs chromium, which is absent"
