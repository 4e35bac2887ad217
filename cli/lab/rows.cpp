// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/lab/rows.h"

#include <fmt/format.h>

#include "cli/lab/pareto.h"

namespace vps::lab {
namespace {

// Why a row cannot be on a front; empty when it can.
std::string refusal_of(const Row& row, Cost cost) {
  if (row.setting && !row.setting->repeatable()) return "a clock decides what it answers: another time another depth";
  const Spread& off = row.errors.contact.penetration;
  if (off.told == 0) return "tells no depth";
  if (off.told < off.asked) return fmt::format("tells {} of {} depths, perhaps the easy ones", off.told, off.asked);
  if (2 * row.errors.contact.missed > off.asked) {
    return fmt::format("misses {} of {} contacts, so that its error is mostly their depth", row.errors.contact.missed,
                       off.asked);
  }
  if (cost == Cost::step && !row.steps.failure.empty()) return row.steps.failure;
  const bool untimed =
      (cost == Cost::time && row.contacts.rounds == 0) || (cost == Cost::step && row.steps.dearest().rounds == 0);
  if (untimed) return "not timed";
  return "";
}

Candidate candidate_of(const Row& row, Cost cost) {
  const double error = row.errors.contact.penetration.rms;
  switch (cost) {
    case Cost::bytes:
      return {double(row.bytes), error, 0};
    case Cost::step:
      return {row.steps.dearest().p99, error, row.steps.dearest().noise_p99};
    case Cost::time:
      break;
  }
  return {row.contacts.p50, error, row.contacts.noise_p50};
}

Front find_front(std::span<const Row> rows, Way way, Cost cost) {
  Front front{way, cost, {}, {}};
  std::vector<Candidate> candidates;
  for (const Row& row : rows) {
    Candidate& one = candidates.emplace_back(Candidate{kNotTold, kNotTold});
    if (row.way != way || (cost == Cost::bytes && row.bytes == 0)) continue;
    if (std::string why = refusal_of(row, cost); !why.empty()) {
      front.left_out.push_back({row.name, std::move(why)});
      continue;
    }
    one = candidate_of(row, cost);
  }
  const Candidate* before = nullptr;
  for (const std::size_t i : pareto_front(candidates)) {
    front.members.push_back({i, before != nullptr && within_noise(*before, candidates[i])});
    before = &candidates[i];
  }
  return front;
}

}  // namespace

const char* describe(Way way) {
  return way == Way::query ? "bare query" : "in Bullet";
}

const char* describe(DepthOf depth) {
  switch (depth) {
    case DepthOf::hulls:
      return "pairs of hulls";
    case DepthOf::triangles:
      return "pairs of triangles";
    case DepthOf::bodies:
      break;
  }
  return "bodies";
}

std::vector<Front> find_fronts(std::span<const Row> rows) {
  return {find_front(rows, Way::query, Cost::time), find_front(rows, Way::bullet, Cost::time),
          find_front(rows, Way::query, Cost::bytes), find_front(rows, Way::bullet, Cost::step)};
}

}  // namespace vps::lab
