// SPDX-License-Identifier: GPL-3.0-or-later
/// @file The commands of vpsbake: each adds its options to the command line, in a file of its name.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "cli/terminal/options.h"

namespace vps::cli {

/// Runs a command on a file, and turns what it throws into one line on stderr and an exit code.
/// @param file  named in the line where the error names no file
[[nodiscard]] int guarded(const std::string& file, const std::function<int()>& work);

/// `vpsbake MESH`: bakes one mesh into one asset. @return the exit code of the program
[[nodiscard]] int run_bake(const BakeArguments& arguments);

/// `vpsbake batch`: bakes folders of meshes into folders of assets. `run` and `merge` each do a part of it.
[[nodiscard]] Command add_batch_command(CLI::App& app);
[[nodiscard]] Command add_run_command(CLI::App& app);
[[nodiscard]] Command add_merge_command(CLI::App& app);
/// `vpsbake plan`: writes bakes as lines of a file, for other machines.
[[nodiscard]] Command add_plan_command(CLI::App& app);
/// `vpsbake explain`: why an asset was baked or not, and whether it would be now.
[[nodiscard]] Command add_explain_command(CLI::App& app);

/// `vpsbake cache stats|prune|verify`: maintains the folder of `--cache`.
[[nodiscard]] Command add_cache_command(CLI::App& app);
/// `vpsbake check MESH`: what is wrong with a mesh. Exits with 0 when the mesh would bake, with 3 when not.
[[nodiscard]] Command add_check_command(CLI::App& app);
/// `vpsbake compare A B`: whether two assets are the same, and if not, by how much they differ.
[[nodiscard]] Command add_compare_command(CLI::App& app);
/// `vpsbake export ASSET --to FORMAT`: writes an asset for other programs.
[[nodiscard]] Command add_export_command(CLI::App& app);
/// `vpsbake info FILE`: prints what an asset holds.
[[nodiscard]] Command add_info_command(CLI::App& app);
/// `vpsbake scene SCENE`: plans a scene, and bakes only what its bodies need.
[[nodiscard]] Command add_scene_command(CLI::App& app);
/// `vpsbake slice ASSET`: a picture of the field in a plane normal to an axis.
[[nodiscard]] Command add_slice_command(CLI::App& app);
/// `vpsbake validate FILE...`: checks assets, against their mesh too.
[[nodiscard]] Command add_validate_command(CLI::App& app);
/// `vpsbake view ASSET`: a page that shows what an asset holds.
[[nodiscard]] Command add_view_command(CLI::App& app);

/// The three below; none in a program that was built without them.
[[nodiscard]] std::vector<Command> add_lab_commands(CLI::App& app);
/// `vpsbake recommend MESH`: finds the setting to bake with. Exits with 3 when no setting meets the limits.
[[nodiscard]] Command add_recommend_command(CLI::App& app);
/// `vpsbake report MESH...`: error against run time, size and bake time, of vpsbake and of other libraries.
[[nodiscard]] Command add_report_command(CLI::App& app);
/// `vpsbake stress ASSET...`: stability cases in Bullet and in a penalty loop, each with a limit and a verdict.
[[nodiscard]] Command add_stress_command(CLI::App& app);

/// `vpsbake help [COMMAND]`, the same as --help, and `vpsbake version`.
[[nodiscard]] Command add_help_command(CLI::App& app);
[[nodiscard]] Command add_version_command(CLI::App& app);

/// `vpsbake help-files --into DIR`: writes manual pages and completions in the layout of share/: man/man1/NAME.1 for
/// each command, bash-completion/completions/vpsbake and zsh/site-functions/_vpsbake. They cover all commands that
/// `app` has when it runs. The build uses it; --help does not list it.
[[nodiscard]] Command add_help_files_command(CLI::App& app);

}  // namespace vps::cli
