// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/bench/growth/curves.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "tests/bench/query_report.h"

namespace vps::bench {
namespace {

struct Curve {
  std::string name;
  std::vector<const Job*> samples{};

  // Least squares of log(time) over log(size), of the samples from `first` on.
  [[nodiscard]] double exponent(std::size_t first = 0) const {
    double n = 0, x = 0, y = 0, xx = 0, xy = 0;
    for (std::size_t i = first; i < samples.size(); ++i) {
      const double u = std::log(samples[i]->size);
      const double v = std::log(median(samples[i]->us));
      n += 1;
      x += u;
      y += v;
      xx += u * u;
      xy += u * v;
    }
    return n > 1 ? (n * xy - x * y) / (n * xx - x * x) : 0;
  }
  [[nodiscard]] double last() const { return exponent(samples.size() - std::min<std::size_t>(2, samples.size())); }
  [[nodiscard]] double slowest() const {
    double most = 0;
    for (const Job* job : samples) most = std::max(most, median(job->us));
    return most;
  }
};

std::vector<Curve> curves_of(const Section& section) {
  std::vector<Curve> curves;
  for (const Job& job : section.jobs) {
    auto at = std::find_if(curves.begin(), curves.end(), [&](const Curve& c) { return c.name == job.curve; });
    if (at == curves.end()) at = curves.insert(at, {job.curve});
    at->samples.push_back(&job);
  }
  const auto key = [&](const Curve& c) { return std::isfinite(section.most_us) ? c.slowest() : c.last(); };
  std::stable_sort(curves.begin(), curves.end(), [&](const Curve& a, const Curve& b) { return key(a) > key(b); });
  return curves;
}

void add(const Section& section, const Curve& curve, nlohmann::ordered_json& json) {
  for (const Job* job : curve.samples) {
    json["samples"].push_back({{"section", section.title},
                               {"curve", curve.name},
                               {section.size_name, job->size},
                               {"queries", job->us.size()},
                               {"median_us", median(job->us)},
                               {"p99_us", percentile(job->us, 0.99)}});
  }
  json["exponents"].push_back(
      {{"section", section.title}, {"curve", curve.name}, {"all", curve.exponent()}, {"last_two", curve.last()}});
}

}  // namespace

double median(const Times& us) {
  return percentile(us, 0.5);
}

std::string name_of(const Section& section, const Job& job) {
  return fmt::format("{}, {}, {}", section.title, job.curve, job.column);
}

void measure(Section& section, int rounds) {
  for (int round = 1; round <= rounds; ++round) {
    fmt::print(stderr, "growth_bench: {}: round {} of {}\n", section.title, round, rounds);
    for (Job& job : section.jobs) {
      const Times us = job.run();
      job.us.insert(job.us.end(), us.begin(), us.end());
    }
  }
}

std::string markdown(const Section& section, nlohmann::ordered_json& json) {
  const std::vector<Curve> curves = curves_of(section);
  const bool judged = std::isfinite(section.most_us) || std::isfinite(section.most_exponent);
  std::vector<std::string> head = {"us, median, by " + section.size_name, "exponent", "of the last two"};
  if (judged) head.push_back("target");
  for (const Job* job : curves[0].samples) head.push_back(job->column);
  std::string out = fmt::format("\n## {}\n\n", section.title);
  out += row(head) + row(std::vector<std::string>(head.size(), "---"));
  for (const Curve& curve : curves) {
    std::vector<std::string> cells = {curve.name, fmt::format("{:.2f}", curve.exponent()),
                                      fmt::format("{:.2f}", curve.last())};
    if (judged) {
      const bool met = curve.last() <= section.most_exponent && curve.slowest() <= section.most_us;
      cells.emplace_back(!curve.name.starts_with(section.judged) ? "" : met ? "met" : "**missed**");
    }
    for (const Job* job : curve.samples) cells.push_back(number(median(job->us)));
    out += row(cells);
    add(section, curve, json);
  }
  return out;
}

}  // namespace vps::bench
