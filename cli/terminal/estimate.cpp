// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/terminal/estimate.h"

#include <algorithm>
#include <cmath>

namespace vps::cli {

void Estimate::report(double fraction, double time) {
  if (!(fraction > reported_)) return;
  reported_ = std::min(fraction, 1.0);
  reported_at_ = time;
  reports_.push_back({reported_, time});
  while (reports_.size() > 1 && reports_[1].fraction <= reported_ / 2) reports_.pop_front();
}

// Between that of everything and that of the last half: the beginning may have gone at another one, and a short time
// says little.
double Estimate::pace() const {
  const double overall = reported_ / reported_at_;
  const Report& from = reports_.front();
  if (from.fraction > reported_ / 2 || !(reported_at_ > from.time)) return overall;
  return std::sqrt(overall * (reported_ - from.fraction) / (reported_at_ - from.time));
}

Estimate::Shown Estimate::at(double time) {
  if (reported_ <= 0 || reported_at_ <= 0) return {shown_, -1};
  // The pace so far goes on, but slows down towards the end, so that no figure is reached before the work is done.
  const double pace = this->pace();
  const double room = 1 - reported_;
  const double since = std::max(time - reported_at_, 0.0);
  const double now = room > 0 ? 1 - room / (1 + pace * since / room) : 1;
  // What was shown too early goes on slowly.
  constexpr double kSlow = 0.1;
  const double step = 1 - std::exp(-kSlow * pace * std::max(time - shown_at_, 0.0));
  shown_ = std::max(now, shown_ + (1 - shown_) * step);
  shown_at_ = time;
  return {shown_, (1 - now) / pace};
}

}  // namespace vps::cli
