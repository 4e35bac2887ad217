// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/batch/reasons.h"

#include <fmt/format.h>

#include <sstream>
#include <system_error>

#include "bake/quantity_text.h"

namespace vps::cli::batch {
namespace {

namespace fs = std::filesystem;

enum class Form { text, hash, number, voxels, length, unit, flag };

// How a line of a record is printed: with the name of the option that sets it.
struct Spelling {
  const char* name;
  const char* said;
  Form form;
};
constexpr Spelling kSpellings[] = {
    {"voxel_size", "voxel", Form::length},
    {"max_error", "max-error", Form::length},
    {"sheet_thickness", "open-surface", Form::length},
    {"unit", "unit x scale", Form::unit},
    {"band_inside", "band-inside", Form::voxels},
    {"band_outside", "band-outside", Form::voxels},
    {"field_error", "field-error", Form::voxels},
    {"prove_bound", "prove-bound", Form::flag},
    {"alpha", "alpha", Form::number},
    {"thin_faces", "thin-faces", Form::number},
    {"layers", "field layers", Form::flag},
    {"scaled", "field scaled", Form::flag},
    {"real", "field real", Form::flag},
    {"voxelmap", "part voxelmap", Form::flag},
    {"pointshell", "part pointshell", Form::flag},
    {"format", "the asset format", Form::text},
    {"mesh", "the mesh", Form::hash},
    {"buffer", "a file that the mesh refers to", Form::hash},
    {"vertices", "the mesh's vertices", Form::hash},
    {"triangles", "the mesh's triangles", Form::hash},
    {"program", "the program", Form::hash},
};

struct RecordLine {
  std::string name, value;
  bool operator==(const RecordLine&) const = default;
};

std::vector<RecordLine> lines_of(const bake::BakeRecord& record) {
  std::vector<RecordLine> lines;
  std::istringstream in(record.text);
  for (std::string line; std::getline(in, line);) {
    const std::size_t space = line.find(' ');
    lines.push_back({line.substr(0, space), space == line.npos ? "" : line.substr(space + 1)});
  }
  return lines;
}

Spelling spelling_of(const std::string& name) {
  for (const Spelling& one : kSpellings) {
    if (name == one.name) return one;
  }
  return {name.c_str(), name.c_str(), Form::text};
}

std::string said_value(const RecordLine& line, Form form) {
  const double number = bake::exact_number(line.value).value_or(0);
  switch (form) {
    case Form::number:
      return fmt::format("{:.6g}", number);
    case Form::voxels:
      return fmt::format("{:.6g} vx", number);
    case Form::length:
      return number == 0 ? "not given" : bake::format_length(number);
    case Form::unit:
      return fmt::format("{:.6g} m", number);
    case Form::flag:
      return line.value == "0" ? "off" : "on";
    case Form::text:
    case Form::hash:
      break;
  }
  if (line.name == "precision" && line.value == "-1") return "automatic";
  return line.name == "resolution" && line.value == "0" ? "not given" : line.value;
}

}  // namespace

std::vector<std::string> differences(const bake::BakeRecord& had, const bake::BakeRecord& wanted) {
  const std::vector<RecordLine> before = lines_of(had);
  const std::vector<RecordLine> after = lines_of(wanted);
  std::vector<std::string> out;
  const auto add = [&](std::string sentence) {
    if (out.empty() || out.back() != sentence) out.push_back(std::move(sentence));
  };
  // Lines have a fixed order. Only the number of buffers may differ.
  for (std::size_t i = 0; i < std::max(before.size(), after.size()); ++i) {
    const RecordLine none;
    const RecordLine& old = i < before.size() ? before[i] : none;
    const RecordLine& now = i < after.size() ? after[i] : none;
    if (old == now) continue;
    const std::string& name = now.name.empty() ? old.name : now.name;
    const Spelling spelling = spelling_of(name);
    if (spelling.form == Form::hash || old.name != now.name) {
      add(fmt::format("{} changed", spelling.said));
    } else {
      add(fmt::format("{} was {}, is {}", spelling.said, said_value(old, spelling.form),
                      said_value(now, spelling.form)));
    }
  }
  return out;
}

std::vector<std::string> readable_settings(const bake::BakeRecord& record) {
  std::vector<std::string> out;
  for (const RecordLine& line : lines_of(record)) {
    const Spelling spelling = spelling_of(line.name);
    out.push_back(fmt::format("{} {}", spelling.said, said_value(line, spelling.form)));
  }
  return out;
}

Standing compare_with_asset(const Job& job) {
  Standing out{bake::bake_record(job.mesh, job.settings), {}};
  const auto because = [&](std::string reason) {
    out.reasons = {std::move(reason)};
    return out;
  };
  if (!out.wanted) return because("the mesh cannot be read");
  std::error_code ignored;
  if (!fs::exists(job.asset(), ignored)) return because("there is no asset yet");
  Asset asset;
  Status status = Asset::open(job.asset().c_str(), asset);
  if (status == Status::ok) status = asset.verify();
  if (status == Status::wrong_version) return because(describe(status));
  if (status != Status::ok) return because(fmt::format("the asset is damaged: {}", describe(status)));
  const bake::BakeRecord had = bake::record_of(asset);
  if (had.text.empty()) return because("the asset does not say what it was baked from");
  out.reasons = differences(had, *out.wanted);
  return out;
}

}  // namespace vps::cli::batch
