// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/terminal/estimate.h"

#include <algorithm>
#include <cmath>

namespace vps::cli {

void Estimate::report(double fraction, double time) {
  if (!(fraction > reported_)) return;
  reported_ = std::min(fraction, 1.0);
  reported_at_ = time;
}

Estimate::Shown Estimate::at(double time) {
  if (reported_ <= 0 || reported_at_ <= 0) return {shown_, -1};
  // The pace so far goes on, but slows down towards the end, so that no figure is reached before the work is done.
  const double pace = reported_ / reported_at_;
  const double room = 1 - reported_;
  const double since = std::max(time - reported_at_, 0.0);
  const double now = room > 0 ? 1 - room / (1 + pace * since / room) : 1;
  // What was shown too early goes on slowly.
  constexpr double kSlow = 0.1;
  const double step = 1 - std::exp(-kSlow * pace * std::max(time - shown_at_, 0.0));
  shown_ = std::max(now, shown_ + (1 - shown_) * step);
  shown_at_ = time;
  return {shown_, std::max(time, reported_at_) * (1 - now) / now};
}

}  // namespace vps::cli
