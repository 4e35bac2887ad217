// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/batch/job.h"

namespace vps::cli::batch {

std::vector<std::string> command_words(const OptionTexts& options) {
  std::vector<std::string> words;
  for (const auto& [name, text] : options) words.push_back("--" + name + "=" + text);
  return words;
}

bake::BakeSettings read_settings(const Job& job, const OptionReader& reader) {
  try {
    return reader.settings(job.options);
  } catch (const UsageError& error) {
    throw BatchError(job.mesh.string(), error.what());
  }
}

std::string path_from(const std::filesystem::path& file, const std::filesystem::path& folder) {
  namespace fs = std::filesystem;
  const fs::path whole = fs::absolute(file).lexically_normal();
  const fs::path from = fs::weakly_canonical(fs::absolute(folder));
  return (fs::weakly_canonical(whole.parent_path()) / whole.filename()).lexically_proximate(from).generic_string();
}

}  // namespace vps::cli::batch
