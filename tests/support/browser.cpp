// SPDX-License-Identifier: GPL-3.0-or-later
// Controls Chromium through its debugging pipe. Messages are JSON that ends with a zero byte. An answer carries the id
// of its request, an event carries its name.
#include "tests/support/browser.h"

#include <fcntl.h>
#include <poll.h>
#include <spawn.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <sstream>
#include <stdexcept>
#include <string_view>
#include <thread>

#include "tests/support/temporary_folder.h"

namespace vps::test {
namespace {

using Json = nlohmann::json;
using Clock = std::chrono::steady_clock;

constexpr int kFirstFree = 10;  // pipes avoid the file descriptors of the browser: it reads from 3 and writes to 4

class Pipe {
 public:
  Pipe() {
    int low[2];
    if (::pipe2(low, O_CLOEXEC) != 0) throw std::runtime_error("no pipe");
    for (int i = 0; i < 2; ++i) {
      ends_[i] = ::fcntl(low[i], F_DUPFD_CLOEXEC, kFirstFree);
      ::close(low[i]);
    }
  }
  Pipe(const Pipe&) = delete;
  Pipe& operator=(const Pipe&) = delete;
  ~Pipe() {
    close(0);
    close(1);
  }
  void close(int end) {
    if (ends_[end] >= 0) ::close(ends_[end]);
    ends_[end] = -1;
  }
  [[nodiscard]] int read_end() const { return ends_[0]; }
  [[nodiscard]] int write_end() const { return ends_[1]; }

 private:
  int ends_[2] = {-1, -1};
};

// The browser and all its processes. The destructor ends them and removes the profile.
class Browser {
 public:
  explicit Browser(double timeout)
      : deadline_(Clock::now() + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(timeout))) {
    const std::string browser = find_browser();
    if (browser.empty()) throw std::runtime_error("there is no chromium");
    std::vector<std::string> words = {browser,
                                      "--headless",
                                      "--no-sandbox",  // root cannot use the sandbox
                                      "--no-first-run",
                                      "--disable-breakpad",
                                      "--disable-dev-shm-usage",
                                      "--disable-background-networking",
                                      "--disable-component-update",
                                      "--disable-extensions",
                                      "--hide-scrollbars",
                                      "--use-angle=swiftshader",
                                      "--enable-unsafe-swiftshader",
                                      "--host-resolver-rules=MAP * ~NOTFOUND",
                                      "--remote-debugging-pipe",
                                      "--user-data-dir=" + (folder_ / "profile").string(),
                                      "--no-startup-window"};
    std::vector<char*> argv;
    for (std::string& word : words) argv.push_back(word.data());
    argv.push_back(nullptr);
    // Files that a killed browser leaves behind are removed with the folder.
    std::string temporary = "TMPDIR=" + folder_.path().string();
    std::vector<char*> environment = {temporary.data()};
    for (char** word = environ; *word != nullptr; ++word) {
      if (!std::string_view(*word).starts_with("TMPDIR=")) environment.push_back(*word);
    }
    environment.push_back(nullptr);
    posix_spawn_file_actions_t files;
    ::posix_spawn_file_actions_init(&files);
    ::posix_spawn_file_actions_addopen(&files, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
    const std::string log = (folder_ / "log").string();
    ::posix_spawn_file_actions_addopen(&files, STDERR_FILENO, log.c_str(), O_WRONLY | O_CREAT, 0600);
    ::posix_spawn_file_actions_adddup2(&files, STDERR_FILENO, STDOUT_FILENO);
    ::posix_spawn_file_actions_adddup2(&files, to_.read_end(), 3);
    ::posix_spawn_file_actions_adddup2(&files, from_.write_end(), 4);
    ::prctl(PR_SET_CHILD_SUBREAPER, 1);  // so that this process inherits the browser's children
    posix_spawnattr_t attributes;
    ::posix_spawnattr_init(&attributes);
    ::posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETPGROUP);  // so that its children end with it
    const int error = ::posix_spawn(&process_, browser.c_str(), &files, &attributes, argv.data(), environment.data());
    ::posix_spawn_file_actions_destroy(&files);
    ::posix_spawnattr_destroy(&attributes);
    if (error != 0) throw std::runtime_error("chromium does not start");
    to_.close(0);
    from_.close(1);
  }
  Browser(const Browser&) = delete;
  Browser& operator=(const Browser&) = delete;
  ~Browser() {
    ::kill(-process_, SIGKILL);
    // This process has inherited the browser's children. They may write to the profile until they end.
    while (::waitpid(-process_, nullptr, 0) > 0 || errno == EINTR) {
    }
    // The crash handlers are inherited as well. They leave the process group and end after the browser.
    for (int i = 0; i < 400 && ::waitpid(-1, nullptr, WNOHANG) >= 0; ++i)
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }

  /// Sends a request and waits for its answer. Events that arrive meanwhile are added to `events`.
  Json ask(const std::string& method, const Json& parameters = Json::object()) {
    Json message = {{"id", ++last_id_}, {"method", method}, {"params", parameters}};
    if (!session.empty()) message["sessionId"] = session;
    const std::string text = message.dump();
    write(text.c_str(), text.size() + 1);
    while (true) {
      Json answer = next();
      if (answer.value("id", 0) != last_id_) {
        events.push_back(std::move(answer));
      } else if (answer.contains("error")) {
        throw std::runtime_error(method + ": " + answer["error"].dump());
      } else {
        return answer["result"];
      }
    }
  }
  /// Waits for an event; one already in `events` counts.
  void wait_for(const std::string& method) {
    for (std::size_t i = 0;; ++i) {
      if (i == events.size()) events.push_back(next());
      if (events[i].value("method", "") == method) return;
    }
  }

  std::vector<Json> events;
  std::string session;

 private:
  void write(const char* data, std::size_t bytes) {
    while (bytes > 0) {
      const ssize_t written = ::write(to_.write_end(), data, bytes);
      if (written < 0 && errno == EINTR) continue;
      if (written <= 0) throw std::runtime_error("chromium has ended: " + read_file(folder_ / "log"));
      data += written;
      bytes -= static_cast<std::size_t>(written);
    }
  }
  Json next() {
    std::size_t end = 0;
    while ((end = buffer_.find('\0', scanned_)) == std::string::npos) {
      scanned_ = buffer_.size();
      const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(deadline_ - Clock::now()).count();
      if (left <= 0) throw std::runtime_error("the page took too long");
      pollfd waiting{from_.read_end(), POLLIN, 0};
      if (::poll(&waiting, 1, static_cast<int>(left) + 1) <= 0) continue;
      char chunk[1 << 16];
      const ssize_t got = ::read(from_.read_end(), chunk, sizeof chunk);
      if (got < 0 && errno == EINTR) continue;
      if (got <= 0) throw std::runtime_error("chromium has ended: " + read_file(folder_ / "log"));
      buffer_.append(chunk, static_cast<std::size_t>(got));
    }
    Json message = Json::parse(buffer_.substr(0, end));
    buffer_.erase(0, end + 1);
    scanned_ = 0;
    return message;
  }

  TemporaryFolder folder_;
  Clock::time_point deadline_;
  Pipe to_, from_;
  pid_t process_ = -1;
  int last_id_ = 0;
  std::string buffer_;
  std::size_t scanned_ = 0;
};

std::string decode_base64(const std::string& text) {
  std::string bytes;
  unsigned bits = 0;
  int count = 0;
  for (const char c : text) {
    static const std::string kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    const std::size_t digit = kDigits.find(c);
    if (digit == std::string::npos) break;
    bits = bits << 6 | static_cast<unsigned>(digit);
    if ((count += 6) >= 8) bytes += static_cast<char>(bits >> (count -= 8) & 255U);
  }
  return bytes;
}

Json evaluate(Browser& browser, const std::string& script) {
  const Json answer =
      browser.ask("Runtime.evaluate", {{"expression", script}, {"awaitPromise", true}, {"returnByValue", true}});
  if (answer.contains("exceptionDetails")) throw std::runtime_error("the script: " + answer["exceptionDetails"].dump());
  return answer["result"].value("value", Json());
}

// Resolves after the timers of the page's start have run and their changes are painted.
constexpr const char* kSettled =
    "new Promise(done => setTimeout(() => requestAnimationFrame(() => requestAnimationFrame(() => done())), 100))";

constexpr const char* kNetworkLinks =
    "[...document.querySelectorAll('[src],link[href],image[href],use[href]')]"
    ".map(e => e.getAttribute('src') ?? e.getAttribute('href')).filter(a => /^\\s*([a-z]+:)?\\/\\//i.test(a))";

// The arguments of console.error(...) or a thrown value, as text.
std::string words_of(const Json& arguments) {
  std::string words;
  for (const Json& one : arguments) {
    const Json value = one.value("value", Json());
    words += (words.empty() ? "" : " ") + (value.is_null()     ? one.value("description", "")
                                           : value.is_string() ? value.get<std::string>()
                                                               : value.dump());
  }
  return words;
}

void file_event(const Json& event, const std::string& page, PageVisit& visit) {
  const std::string method = event.value("method", "");
  const Json& parameters = event.contains("params") ? event["params"] : event;
  if (method == "Runtime.consoleAPICalled") {
    const std::string type = parameters["type"];
    if (type == "error" || type == "warning" || type == "assert")
      visit.complaints.push_back(type + ": " + words_of(parameters["args"]));
  } else if (method == "Runtime.exceptionThrown") {
    const Json& details = parameters["exceptionDetails"];
    const Json thrown = details.contains("exception") ? Json::array({details["exception"]}) : Json::array();
    visit.complaints.push_back("exception: " + details.value("text", "") + " " + words_of(thrown));
  } else if (method == "Log.entryAdded") {
    const Json& entry = parameters["entry"];
    const std::string level = entry["level"];
    if (level == "error" || level == "warning")
      visit.complaints.push_back(level + ": " + entry.value("text", "") + " " + entry.value("url", ""));
  } else if (method == "Network.requestWillBeSent") {
    const std::string address = parameters["request"]["url"];
    if (address != page && !address.starts_with("data:") && !address.starts_with("blob:"))
      visit.requests.push_back(address);
  }
}

void keep_screenshot(const std::filesystem::path& page, const PageVisit& visit) {
  const char* const folder = std::getenv("VPS_SCREENSHOTS");
  if (folder == nullptr) return;
  const auto* const test = ::testing::UnitTest::GetInstance()->current_test_info();
  const std::string name = std::string(test == nullptr ? "" : test->name()) + "_" + page.stem().string();
  for (int n = 1;; ++n) {
    const std::filesystem::path file = std::filesystem::path(folder) / (name + "_" + std::to_string(n) + ".png");
    if (std::filesystem::exists(file)) continue;
    return write_file(file, visit.screenshot);
  }
}

void visit_with(Browser& browser, const std::string& page, const VisitOptions& options, PageVisit& visit) {
  const std::string target = browser.ask("Target.createTarget", {{"url", "about:blank"}})["targetId"];
  const std::string session =
      browser.ask("Target.attachToTarget", {{"targetId", target}, {"flatten", true}})["sessionId"];
  browser.session = session;
  for (const char* const domain : {"Runtime.enable", "Log.enable", "Network.enable", "Page.enable"})
    browser.ask(domain);
  const bool phone = options.width < 600;
  browser.ask("Emulation.setDeviceMetricsOverride",
              {{"width", options.width}, {"height", options.height}, {"deviceScaleFactor", 1}, {"mobile", phone}});
  browser.ask("Emulation.setEmulatedMedia",
              {{"features", Json::array({{{"name", "prefers-color-scheme"},
                                          {"value", options.theme == Theme::dark ? "dark" : "light"}}})}});
  browser.events.clear();
  const Json navigation = browser.ask("Page.navigate", {{"url", page}});
  if (navigation.contains("errorText")) throw std::runtime_error("the page does not open: " + navigation.dump());
  browser.wait_for("Page.loadEventFired");
  evaluate(browser, kSettled);
  if (!options.script.empty()) {
    visit.value = evaluate(browser, options.script);
    evaluate(browser, kSettled);
  }
  visit.dom = evaluate(browser, "document.documentElement.outerHTML");
  visit.text = evaluate(browser, "document.body.innerText");
  visit.page_width = evaluate(browser, "document.documentElement.scrollWidth");
  for (const Json& link : evaluate(browser, kNetworkLinks)) visit.network_links.push_back(link);
  visit.screenshot = decode_base64(browser.ask("Page.captureScreenshot", {{"format", "png"}})["data"]);
  visit.picture = decode_png(visit.screenshot);
  for (const Json& event : browser.events) file_event(event, page, visit);
}

}  // namespace

std::filesystem::path find_browser() {
  const char* const path = std::getenv("PATH");
  std::istringstream folders(path == nullptr ? "" : path);
  for (std::string folder; std::getline(folders, folder, ':');) {
    const std::filesystem::path file = std::filesystem::path(folder) / "chromium";
    if (::access(file.c_str(), X_OK) == 0) return file;
  }
  return {};
}

PageVisit visit_page(const std::filesystem::path& page, const VisitOptions& options) {
  PageVisit visit;
  // A browser that ends early must not kill the test with SIGPIPE.
  std::signal(SIGPIPE, SIG_IGN);
  try {
    if (!std::filesystem::is_regular_file(page)) throw std::runtime_error("there is no such page");
    Browser browser(options.timeout);
    visit_with(browser, "file://" + std::filesystem::canonical(page).string(), options, visit);
    keep_screenshot(page, visit);
  } catch (const std::exception& error) {
    visit.failure = page.string() + ": " + error.what();
  }
  return visit;
}

void expect_sound(const PageVisit& visit, double painted) {
  ASSERT_EQ(visit.failure, "");
  EXPECT_EQ(visit.complaints, std::vector<std::string>{});
  EXPECT_EQ(visit.requests, std::vector<std::string>{});
  EXPECT_EQ(visit.network_links, std::vector<std::string>{});
  EXPECT_LE(visit.page_width, static_cast<int>(visit.picture.width)) << "the page scrolls sideways";
  EXPECT_GE(painted_share(visit.picture), painted) << "the window is all but empty";
}

}  // namespace vps::test
