// SPDX-License-Identifier: GPL-3.0-or-later
// visit_page() reports the faults of a page: each page here has one fault.
#include "tests/support/browser.h"

#include <sys/wait.h>

#include <gtest/gtest-spi.h>

#include "tests/support/temporary_folder.h"

namespace vps::test {
namespace {

constexpr const char* kPolicy =
    "<!doctype html><meta charset='utf-8'><meta name='viewport' content='width=device-width, initial-scale=1'>"
    "<meta http-equiv='Content-Security-Policy' content=\"default-src 'none'; script-src 'unsafe-inline'; "
    "style-src 'unsafe-inline'; img-src data: blob:\">";

PageVisit visit_text(const std::string& text, const VisitOptions& options = {}) {
  const TemporaryFolder folder;
  write_file(folder / "page.html", text);
  return visit_page(folder / "page.html", options);
}

// The first complaint that contains these words; "" if there is none.
std::string complaint_with(const PageVisit& visit, const std::string& words) {
  for (const std::string& complaint : visit.complaints) {
    if (complaint.find(words) != std::string::npos) return complaint;
  }
  return "";
}

TEST(Browser, APageThatIsWellIsSound) {
  VPS_BROWSER_OR_SKIP();
  VisitOptions options;
  options.script = "new Promise(done => setTimeout(() => done({width: innerWidth, words: document.title}), 5))";
  const PageVisit visit = visit_text(std::string(kPolicy) +
                                         "<title>w\u00e9ll</title><p id='p'>before</p><script>console.log('fine');"
                                         "document.getElementById('p').textContent = 'after'</script>",
                                     options);
  expect_sound(visit, 1e-4);
  EXPECT_NE(visit.dom.find("<p id=\"p\">after</p>"), std::string::npos) << visit.dom;
  EXPECT_EQ(visit.text, "after");
  EXPECT_EQ(visit.value["width"], 1280);
  EXPECT_EQ(visit.value["words"], "w\u00e9ll");
  EXPECT_EQ(visit.picture.width, 1280U);
  EXPECT_EQ(visit.picture.height, 800U);
}

TEST(Browser, WhatAPageThrowsIsHeard) {
  VPS_BROWSER_OR_SKIP();
  const PageVisit visit = visit_text(std::string(kPolicy) +
                                     "<p>text</p><script>setTimeout(() => { throw new Error('late') }, 20);"
                                     "Promise.reject(new Error('promised')); nothing.at.all</script>");
  ASSERT_EQ(visit.failure, "");
  EXPECT_NE(complaint_with(visit, "nothing is not defined"), "");
  EXPECT_NE(complaint_with(visit, "late"), "");
  EXPECT_NE(complaint_with(visit, "promised"), "");
  EXPECT_NONFATAL_FAILURE(expect_sound(visit, 0), "nothing is not defined");
}

TEST(Browser, WhatAPageLogsAsErrorOrWarningIsHeard) {
  VPS_BROWSER_OR_SKIP();
  const PageVisit visit =
      visit_text(std::string(kPolicy) +
                 "<p>text</p><script>console.error('bad', 7); console.warn('odd'); console.log('fine')</script>");
  EXPECT_EQ(visit.complaints, (std::vector<std::string>{"error: bad 7", "warning: odd"}));
}

TEST(Browser, AnEmptyPageIsNotPainted) {
  VPS_BROWSER_OR_SKIP();
  const PageVisit visit = visit_text(kPolicy);
  EXPECT_EQ(visit.failure, "");
  EXPECT_EQ(painted_share(visit.picture), 0);
  EXPECT_NONFATAL_FAILURE(expect_sound(visit), "all but empty");
}

TEST(Browser, APageThatWantsANetworkImageIsFoundOut) {
  VPS_BROWSER_OR_SKIP();
  const std::string image = "<p>text</p><img src='http://example.invalid/a.png'>";
  for (const std::string& page : {std::string(kPolicy) + image, "<!doctype html>" + image}) {
    const PageVisit visit = visit_text(page);
    ASSERT_EQ(visit.failure, "");
    EXPECT_EQ(visit.network_links, std::vector<std::string>{"http://example.invalid/a.png"});
    EXPECT_FALSE(visit.complaints.empty());
  }
  // A script makes this request, so that no attribute of the page contains its address.
  const PageVisit visit =
      visit_text("<!doctype html><p>text</p><script>new Image().src = 'http://example.invalid/b.png'</script>");
  EXPECT_EQ(visit.requests, std::vector<std::string>{"http://example.invalid/b.png"});
}

TEST(Browser, APageThatBreaksItsPolicyIsFoundOut) {
  VPS_BROWSER_OR_SKIP();
  const PageVisit visit = visit_text(std::string(kPolicy) +
                                     "<p>text</p><script>try { eval('1') } catch (e) {}"
                                     "fetch('https://example.invalid/').catch(() => {})</script>");
  EXPECT_NE(complaint_with(visit, "Content Security Policy"), "");
}

TEST(Browser, APageTooWideForAPhoneIsFoundOut) {
  VPS_BROWSER_OR_SKIP();
  VisitOptions phone;
  phone.width = 390;
  phone.height = 844;
  const PageVisit visit =
      visit_text(std::string(kPolicy) + "<div style='width: 900px; height: 500px; background: blue'></div>", phone);
  EXPECT_NONFATAL_FAILURE(expect_sound(visit), "scrolls sideways");
}

TEST(Browser, ThePageSeesTheThemeItIsShownIn) {
  VPS_BROWSER_OR_SKIP();
  VisitOptions options;
  options.theme = Theme::dark;
  options.script = "matchMedia('(prefers-color-scheme: dark)').matches";
  EXPECT_EQ(visit_text(std::string(kPolicy) + "<p>text</p>", options).value, true);
}

TEST(Browser, APageWithoutEndIsLeftInTimeAndNothingStaysBehind) {
  VPS_BROWSER_OR_SKIP();
  VisitOptions options;
  options.timeout = 2;
  const auto begin = std::chrono::steady_clock::now();
  const PageVisit visit = visit_text("<!doctype html><script>while (true) {}</script>", options);
  EXPECT_NE(visit.failure.find("took too long"), std::string::npos) << visit.failure;
  EXPECT_LT(std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count(), 10);
  EXPECT_EQ(::waitpid(-1, nullptr, WNOHANG), -1) << "a child is left";
  EXPECT_NE(visit_page("/nowhere/page.html").failure, "");
}

}  // namespace
}  // namespace vps::test
