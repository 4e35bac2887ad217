// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/commands/commands.h"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <cstdlib>
#include <memory>
#include <system_error>

#include "bake/quantity_text.h"
#include "bake/store/cache_upkeep.h"
#include "cli/terminal/complain.h"
#include "cli/terminal/print.h"
#include "cli/tools/describe_asset.h"

namespace vps::cli {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

struct CacheArguments {
  std::string folder;
  std::size_t max_bytes = 0;
  bool dry_run = false;
  bool remove = false;
  bool json = false;
};

std::string size_text(std::uint64_t bytes) {
  return bake::format_bytes(static_cast<double>(bytes));
}

std::string count_text(std::uint64_t count, const char* one, const char* many) {
  return fmt::format("{} {}", count, count == 1 ? one : many);
}

std::string entries_text(std::uint64_t count) {
  return count_text(count, "entry", "entries");
}

std::string time_text(std::int64_t time) {
  return fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", fmt::gmtime(static_cast<std::time_t>(time)));
}

Json start_json(const CacheArguments& arguments, const char* action) {
  return {{"format", "vpsbake cache 1"}, {"action", action}, {"cache", arguments.folder}};
}

void note_empty(const CacheArguments& arguments, std::uint64_t entries) {
  if (entries == 0) complain("note", arguments.folder, "it holds no assets; check that it is the folder of a cache");
}

int print_usage(const CacheArguments& arguments) {
  const bake::CacheUsage usage = bake::cache_usage(arguments.folder);
  note_empty(arguments, usage.entries);
  if (arguments.json) {
    Json json = start_json(arguments, "stats");
    json["entries"] = usage.entries;
    json["bytes"] = usage.bytes;
    json["oldest_use"] = usage.entries > 0 ? Json(time_text(usage.oldest_use)) : Json();
    json["newest_use"] = usage.entries > 0 ? Json(time_text(usage.newest_use)) : Json();
    json["leftovers"] = usage.leftovers;
    json["leftover_bytes"] = usage.leftover_bytes;
    fmt::print("{}", to_text(json));
    return kOk;
  }
  print_lines("{}: {}, {}\n", arguments.folder, entries_text(usage.entries), size_text(usage.bytes));
  if (usage.entries > 0)
    print_lines("last used   {} to {}\n", time_text(usage.oldest_use), time_text(usage.newest_use));
  if (usage.leftovers > 0) {
    print_lines("left over   {} of bakes that are at work or were killed, {}; prune removes them after an hour\n",
                count_text(usage.leftovers, "file", "files"), size_text(usage.leftover_bytes));
  }
  return kOk;
}

int prune(const CacheArguments& arguments) {
  const bake::PrunedCache pruned = bake::prune_cache(
      arguments.folder, arguments.max_bytes, arguments.dry_run ? bake::PruneMode::dry_run : bake::PruneMode::remove);
  note_empty(arguments, pruned.entries + pruned.removed);
  if (arguments.json) {
    Json json = start_json(arguments, "prune");
    json["max_bytes"] = arguments.max_bytes;
    json["dry_run"] = arguments.dry_run;
    json["removed"] = pruned.removed;
    json["removed_bytes"] = pruned.removed_bytes;
    json["leftovers"] = pruned.leftovers;
    json["leftover_bytes"] = pruned.leftover_bytes;
    json["failed"] = pruned.failed;
    json["entries"] = pruned.entries;
    json["bytes"] = pruned.bytes;
    fmt::print("{}", to_text(json));
  } else {
    print_lines("{}: {} {} of {}, {} of {}\n", arguments.folder, arguments.dry_run ? "would remove" : "removed",
                pruned.removed, entries_text(pruned.removed + pruned.entries), size_text(pruned.removed_bytes),
                size_text(pruned.removed_bytes + pruned.bytes));
    if (pruned.leftovers > 0)
      print_lines("left over   {} of killed bakes, {}\n", count_text(pruned.leftovers, "file", "files"),
                  size_text(pruned.leftover_bytes));
  }
  if (pruned.failed == 0) return kOk;
  return fail(kIo, arguments.folder,
              count_text(pruned.failed, "file", "files") + " could not be removed; prune as the owner of the folder");
}

int verify(const CacheArguments& arguments) {
  const bake::CheckedCache checked = bake::verify_cache(
      arguments.folder, arguments.remove ? bake::VerifyMode::remove_damaged : bake::VerifyMode::report);
  note_empty(arguments, checked.entries + checked.other_versions);
  for (const bake::DamagedEntry& entry : checked.damaged)
    complain("error", entry.file.string(),
             entry.reason + (entry.removed ? "; it was removed" : "; remove it with --remove"));
  if (arguments.json) {
    Json json = start_json(arguments, "verify");
    json["entries"] = checked.entries;
    json["bytes"] = checked.bytes;
    json["other_versions"] = checked.other_versions;
    json["damaged"] = Json::array();
    for (const bake::DamagedEntry& entry : checked.damaged)
      json["damaged"].push_back({{"file", entry.file.string()}, {"reason", entry.reason}, {"removed", entry.removed}});
    fmt::print("{}", to_text(json));
  } else {
    print_lines("{}: {}, {}, {} damaged\n", arguments.folder, entries_text(checked.entries), size_text(checked.bytes),
                checked.damaged.empty() ? "none" : std::to_string(checked.damaged.size()));
    if (checked.other_versions > 0)
      print_lines("not checked {} of another version of the format\n", entries_text(checked.other_versions));
  }
  return checked.damaged.empty() ? kOk : kSomeFailed;
}

int run_cache(const CacheArguments& arguments, int (*action)(const CacheArguments&)) {
  std::error_code ignored;
  if (!fs::is_directory(arguments.folder, ignored))
    return fail(
        kIo, arguments.folder,
        std::string(fs::exists(arguments.folder, ignored) ? "this is not a folder" : "the folder does not exist") +
            "; give the folder of a cache");
  try {
    return action(arguments);
  } catch (const fs::filesystem_error& error) {
    return fail(kIo, error.path1().string(), error.code().message() + "; check the folder and its permissions");
  }
}

}  // namespace

Command add_cache_command(CLI::App& app) {
  CLI::App* const cache = app.add_subcommand("cache", "Count, prune or verify what a cache folder holds");
  cache->require_subcommand(1);
  const auto arguments = std::make_shared<CacheArguments>();
  if (const char* const folder = std::getenv("VPSBAKE_CACHE")) arguments->folder = folder;
  const auto add_action = [&](const char* name, const char* description) {
    CLI::App* const action = cache->add_subcommand(name, description);
    auto* const folder = action->add_option("--cache", arguments->folder, "The folder [default: VPSBAKE_CACHE]");
    folder->check(not_empty())->option_text("DIR")->required(arguments->folder.empty());
    action->add_flag("--json", arguments->json, "Print JSON");
    return action;
  };
  CLI::App* const stats = add_action("stats", "Print how much is in it, and when it was used");
  CLI::App* const pruned = add_action("prune", "Remove what was used least recently until the rest fits");
  add_text_option(
      *pruned, "--max-size", [=](const std::string& text) { arguments->max_bytes = parse_size(text); },
      "Size that may be left, such as 20GB")
      ->required()
      ->option_text("SIZE");
  pruned->add_flag("--dry-run", arguments->dry_run, "Print what would be removed, remove nothing");
  CLI::App* const verified = add_action("verify", "Compare all hashes of every entry");
  verified->add_flag("--remove", arguments->remove, "Remove what is damaged");
  cache->footer("Example: vpsbake cache prune --cache ~/.cache/vpsbake --max-size 20GB");
  return {cache, [=] {
            return run_cache(*arguments, stats->parsed() ? print_usage : pruned->parsed() ? prune : verify);
          }};
}

}  // namespace vps::cli
