// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/batch/memory_budget.h"

#include <algorithm>
#include <fstream>
#include <optional>
#include <string>

namespace vps::cli::batch {
namespace {

std::optional<std::size_t> number_in(const std::string& file) {
  std::ifstream in(file);
  std::size_t number = 0;
  if (in >> number) return number;  // "max" means no limit
  return std::nullopt;
}

// Bytes of inactive file cache; 0 when the system does not say.
std::size_t file_cache(const std::string& file) {
  std::ifstream in(file);
  std::size_t number = 0;
  for (std::string name; in >> name >> number;) {
    if (name == "inactive_file") return number;
  }
  return 0;
}

// For cgroup version 2, which containers of today have. With version 1 the host's memory counts.
std::optional<std::size_t> left_in_cgroup() {
  std::ifstream file("/proc/self/cgroup");
  std::optional<std::size_t> least;
  for (std::string line; std::getline(file, line);) {
    if (!line.starts_with("0::")) continue;
    // A limit holds for everything below it. In a container its own limit is at the root.
    for (std::string path = line.substr(3);; path.resize(path.find_last_of('/'))) {
      while (path.ends_with('/')) path.pop_back();
      const std::string folder = "/sys/fs/cgroup" + path;
      const auto limit = number_in(folder + "/memory.max");
      if (limit) {
        // The system frees file cache when memory is needed, so it does not count as used.
        const std::size_t all = number_in(folder + "/memory.current").value_or(0);
        const std::size_t used = all - std::min(all, file_cache(folder + "/memory.stat"));
        least = std::min(least.value_or(*limit), *limit > used ? *limit - used : 0);
      }
      if (path.empty()) break;
    }
  }
  return least;
}

}  // namespace

std::size_t available_memory() {
  std::size_t bytes = std::size_t{4} << 30;  // when the system does not say
  std::ifstream file("/proc/meminfo");
  for (std::string name, unit; file >> name;) {
    std::size_t kilobytes = 0;
    if (!(file >> kilobytes)) break;
    std::getline(file, unit);
    if (name == "MemAvailable:") bytes = kilobytes * 1024;
  }
  if (const auto left = left_in_cgroup()) bytes = std::min(bytes, *left);
  constexpr std::size_t kLeast = 100'000'000;  // what the smallest bakes need
  return std::max(kLeast, bytes - bytes / 10);
}

}  // namespace vps::cli::batch
