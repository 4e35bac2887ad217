// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/bench/query_report.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

namespace vps::bench {
namespace {

double median(const std::vector<double>& values) {
  return percentile(values, 0.5);
}

bool is_ours(const Series& series) {
  return series.side.starts_with("ours");
}

}  // namespace

std::string number(double value) {
  return value >= 1000 ? fmt::format("{:.0f}", value) : fmt::format("{:.3g}", value);
}

std::string row(const std::vector<std::string>& cells) {
  return fmt::format("| {} |\n", fmt::join(cells, " | "));
}

const Series* Report::find(const std::string& work, const std::string& side) const {
  const auto at =
      std::find_if(series_.begin(), series_.end(), [&](const Series& s) { return s.work == work && s.side == side; });
  return at != series_.end() ? &*at : nullptr;
}

std::string Report::verdicts(const Series& ours) const {
  std::vector<std::string> out;
  for (const Target& target : targets_) {
    if (target.work != ours.work) continue;
    const Series* const peer = find(ours.work, target.peer);
    if (!target.peer.empty() && peer == nullptr) continue;
    const double limit = target.factor * (peer != nullptr ? median(peer->microseconds) : 1.0);
    const std::string text =
        peer != nullptr ? fmt::format("{:g} x {}", target.factor, target.peer) : fmt::format("{:g} us", target.factor);
    out.push_back(fmt::format("at most {}: {}", text, median(ours.microseconds) <= limit ? "met" : "**missed**"));
  }
  return fmt::format("{}", fmt::join(out, "; "));
}

std::string Report::ratio_table() const {
  std::vector<std::string> peers;
  for (const Series& s : series_) {
    if (!is_ours(s) && std::find(peers.begin(), peers.end(), s.side) == peers.end()) peers.push_back(s.side);
  }
  std::vector<std::string> head{"work", "ours"};
  for (const std::string& peer : peers) head.push_back("/ " + peer);
  head.insert(head.end(), {"median, us", "targets"});
  std::string out = row(head) + row(std::vector<std::string>(head.size(), "---"));
  for (const Series& s : series_) {
    if (!is_ours(s)) continue;
    std::vector<std::string> cells{s.work, s.side};
    for (const std::string& name : peers) {
      const Series* const peer = find(s.work, name);
      cells.push_back(peer != nullptr ? number(median(s.microseconds) / median(peer->microseconds)) : "");
    }
    cells.insert(cells.end(), {number(median(s.microseconds)), verdicts(s)});
    out += row(cells);
  }
  return out;
}

std::string Report::time_table() const {
  const std::vector<std::string> head{
      "work",     "side",    "queries",          "median, us",
      "99 %, us", "max, us", "contacts, median", "depth off by, median / 99 % / max, mm",
      "remark"};
  std::string out = row(head) + row(std::vector<std::string>(head.size(), "---"));
  for (const Series& s : series_) {
    const auto& us = s.microseconds;
    const auto& off = s.depth_errors;
    out += row({s.work, s.side, std::to_string(us.size()), number(median(us)), number(percentile(us, 0.99)),
                number(percentile(us, 1)), s.contacts.empty() ? "" : number(median(s.contacts)),
                off.empty() ? ""
                            : fmt::format("{} / {} / {}", number(1000 * median(off)),
                                          number(1000 * percentile(off, 0.99)), number(1000 * percentile(off, 1))),
                s.remark});
  }
  return out;
}

nlohmann::json Report::json() const {
  nlohmann::json out = nlohmann::json::array();
  for (const Series& s : series_) {
    nlohmann::json entry{{"work", s.work},
                         {"side", s.side},
                         {"queries", s.microseconds.size()},
                         {"median_us", median(s.microseconds)},
                         {"p99_us", percentile(s.microseconds, 0.99)},
                         {"max_us", percentile(s.microseconds, 1)},
                         {"remark", s.remark}};
    if (!s.contacts.empty()) entry["contacts_median"] = median(s.contacts);
    if (!s.depth_errors.empty()) {
      entry["depth_error_median_m"] = median(s.depth_errors);
      entry["depth_error_p99_m"] = percentile(s.depth_errors, 0.99);
      entry["depth_error_max_m"] = percentile(s.depth_errors, 1);
    }
    nlohmann::json ratios = nlohmann::json::object();
    if (is_ours(s)) {
      for (const Series& peer : series_) {
        if (peer.work == s.work && !is_ours(peer))
          ratios[peer.side] = median(s.microseconds) / median(peer.microseconds);
      }
      entry["ratios"] = ratios;
    }
    out.push_back(entry);
  }
  return out;
}

}  // namespace vps::bench
