// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/tools/provenance.h"

#include <hwy/targets.h>
#include <sys/utsname.h>
#include <unistd.h>

#include <cstdlib>
#include <fstream>
#include <sstream>
#include <string>
#include <thread>

#include "version.h"

namespace vps::cli {
namespace {

std::string command;

std::string processor() {
  std::ifstream file("/proc/cpuinfo");
  for (std::string line; std::getline(file, line);) {
    if (line.starts_with("model name")) return line.substr(std::min(line.size(), line.find(':') + 2));
  }
  return "unknown";
}

const char* instruction_set() {
  const std::int64_t targets = hwy::SupportedTargets();
  return hwy::TargetName(targets & -targets);  // the lowest bit is the widest
}

nlohmann::ordered_json machine() {
  double load[1] = {0};
  if (getloadavg(load, 1) != 1) load[0] = -1;
  utsname system{};
  ::uname(&system);
  return {{"processor", processor()},
          {"cores", std::thread::hardware_concurrency()},
          {"instruction_set", instruction_set()},
          {"memory_bytes", std::uint64_t(::sysconf(_SC_PHYS_PAGES)) * std::uint64_t(::sysconf(_SC_PAGE_SIZE))},
          {"load", load[0]},
          {"system", std::string(system.sysname) + " " + system.release}};
}

// "name version;name version", as CMake found them.
nlohmann::ordered_json versions() {
  nlohmann::ordered_json out = {{"vpsbake", VPSBAKE_VERSION}};
  std::istringstream libraries(VPSBAKE_LIBRARIES);
  for (std::string one; std::getline(libraries, one, ';');) {
    const std::size_t space = one.find(' ');
    out[one.substr(0, space)] = one.substr(space + 1);
  }
  return out;
}

}  // namespace

std::string version_text() {
  std::string out;
  const nlohmann::ordered_json all = versions();
  for (const auto& [name, version] : all.items()) {
    out += (out.empty() ? "" : "\n") + name + " " + version.get<std::string>();
  }
  return out;
}

std::string quoted_word(const std::string& word) {
  constexpr const char* kPlain = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-+=./:,@%";
  if (!word.empty() && word.find_first_not_of(kPlain) == std::string::npos) return word;
  std::string out = "'";
  for (const char c : word) out += c == '\'' ? "'\\''" : std::string(1, c);
  return out + "'";
}

void remember_command(int argc, char** argv) {
  command = "vpsbake";
  for (int i = 1; i < argc; ++i) command.append(" ").append(quoted_word(argv[i]));
}

nlohmann::ordered_json provenance(std::uint64_t seed) {
  return {{"machine", machine()}, {"versions", versions()}, {"seed", seed}, {"command", command}};
}

}  // namespace vps::cli
