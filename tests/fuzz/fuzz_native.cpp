// SPDX-License-Identifier: GPL-3.0-or-later
// Asks everything about mutants for a while, without sanitizers and with the machine's widest vectors: the kernels that
// libFuzzer's program leaves out. A crash, a wrong answer and a mutant that takes too long end the run with its number.
#include <hwy/targets.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <string>

#include "tests/fuzz/ask_everything.h"

namespace {

constexpr unsigned kMostSeconds = 120;  // for one mutant
char current[128] = "";                 // the mutant that is asked now

void say_current(int signal) {
  const char* const what = signal == SIGALRM ? " takes too long\n" : " crashes\n";
  (void)!::write(STDERR_FILENO, current, std::strlen(current));
  (void)!::write(STDERR_FILENO, what, std::strlen(what));
  std::signal(signal, SIG_DFL);
  ::raise(signal);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2 && argc != 3 && argc != 4) {
    std::fprintf(stderr, "fuzz_native SECONDS [FIRST_NUMBER [SEED]]\n");
    return EXIT_FAILURE;
  }
  for (const int signal : {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT, SIGALRM}) std::signal(signal, say_current);
  const double seconds = std::atof(argv[1]);
  const auto first = argc > 2 ? std::strtoull(argv[2], nullptr, 10) : 0;
  const std::string only = argc > 3 ? argv[3] : "";
  const auto begin = std::chrono::steady_clock::now();
  const auto spent = [&] { return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count(); };
  unsigned long long asked = 0;
  unsigned long long opened = 0;
  std::uint64_t number = first;
  for (; spent() < seconds; ++number) {
    for (const auto& [name, bytes] : vps::test::seed_files()) {
      if (!only.empty() && name != only) continue;
      std::snprintf(current, sizeof current, "seed %s, mutant %llu", name.c_str(),
                    static_cast<unsigned long long>(number));
      ::alarm(kMostSeconds);
      const auto questions = number % 16 < 2 ? vps::test::Questions::everything : vps::test::Questions::queries;
      try {
        if (vps::test::ask_mutant(bytes, number, questions) == vps::Status::ok) ++opened;
      } catch (const std::exception& error) {
        std::fprintf(stderr, "%s: %s\n", current, error.what());
        return EXIT_FAILURE;
      }
      ++asked;
    }
  }
  const auto targets = hwy::SupportedTargets();
  std::printf("%llu mutants, of which %llu opened, in %.0f s with %s: no crash, no wrong answer, none too slow\n",
              asked, opened, spent(), hwy::TargetName(targets & -targets) /* the widest */);
  return EXIT_SUCCESS;
}
