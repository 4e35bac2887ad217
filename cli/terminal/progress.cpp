// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/terminal/progress.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <mutex>
#include <thread>

#include "cli/terminal/estimate.h"
#include "cli/terminal/terminal.h"

namespace vps::cli {
namespace {

using Clock = std::chrono::steady_clock;

// "12 s", "3 min".
std::string time_text(double seconds) {
  if (seconds < 100) return fmt::format("{:.0f} s", seconds);
  if (seconds < 6000) return fmt::format("{:.0f} min", seconds / 60);
  return fmt::format("{:.0f} h", seconds / 3600);
}

// In one call, so that what other threads print does not come between.
void write_to_terminal(const std::string& text) {
  [[maybe_unused]] const auto written = ::write(STDERR_FILENO, text.data(), text.size());
}

}  // namespace

struct Progress::Line {
  Line() : painter([this] { paint_until_end(); }) {}
  ~Line() {
    {
      const std::scoped_lock lock(mutex);
      over = true;
    }
    changed.notify_all();
    painter.join();
    erase();
  }

  void erase() {
    if (painted) write_to_terminal("\r\033[K");
    painted = false;
  }

  void paint() {
    const double time = std::chrono::duration<double>(Clock::now() - begin).count();
    const Estimate::Shown shown = estimate.at(time);
    const double percent = std::min(100 * shown.fraction, 99.0);
    const std::string numbers = shown.left < 0
                                    ? fmt::format(" {}", time_text(time))
                                    : fmt::format(" {:.0f} %, {} left", percent, time_text(std::max(shown.left, 1.0)));
    // A line that wraps could not be erased.
    const auto width = static_cast<std::size_t>(std::clamp(columns_of(STDERR_FILENO) - 1, 1, 99));
    const std::string name = what.substr(0, width - std::min(numbers.size(), width));
    write_to_terminal("\r\033[K" + (name + numbers).substr(0, width));
    painted = true;
  }

  void paint_until_end() {
    constexpr auto kPeriod = std::chrono::milliseconds(250);
    std::unique_lock lock(mutex);
    while (!over) {
      if (visible) paint();
      changed.wait_for(lock, kPeriod, [this] { return over; });
    }
  }

  std::mutex mutex;
  std::condition_variable changed;
  bool over = false, visible = false, painted = false;
  std::string what;
  Estimate estimate;
  Clock::time_point begin;
  bool begun = false;
  std::thread painter;  // last: it uses the others
};

Progress::Progress(Verbosity verbosity) {
  if (verbosity != Verbosity::quiet && takes_escapes(STDERR_FILENO)) line_ = std::make_unique<Line>();
}

Progress::~Progress() = default;

void Progress::show(const std::string& what, double fraction) const {
  if (!line_) return;
  const std::scoped_lock lock(line_->mutex);
  if (!line_->begun) line_->begin = Clock::now();
  line_->begun = line_->visible = true;
  line_->what = what;
  line_->estimate.report(fraction, std::chrono::duration<double>(Clock::now() - line_->begin).count());
}

void Progress::clear() const {
  if (!line_) return;
  const std::scoped_lock lock(line_->mutex);
  line_->visible = false;
  line_->erase();
}

}  // namespace vps::cli
