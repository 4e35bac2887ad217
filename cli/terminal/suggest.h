// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Errors for mistyped commands and options, with the name that was likely meant.
#pragma once

#include <CLI/CLI.hpp>
#include <span>
#include <string>

namespace vps::cli {

/// Whether the word is close to the name of a command of `app`.
[[nodiscard]] bool is_like_a_command(const CLI::App& app, const std::string& word);

/// "there is no command 'chek'; did you mean check?", or what to run where no name is close.
[[nodiscard]] std::string unknown_command(const CLI::App& app, const std::string& word);

/// The same for the first word that `app` left over, which may be an option.
/// @param app  the command that was given
[[nodiscard]] std::string unexpected_word(const CLI::App& app, const std::string& word);

/// "there is no option -voxel; did you mean --voxel?" for the first word that is an option's long name behind one dash:
/// CLI11 would read it as letters, here as -v -o xel. Empty: none is.
[[nodiscard]] std::string one_dash(const CLI::App& app, std::span<char* const> words);

/// What CLI11 says of an option that is repeated or lacks its value, in the words of the other messages.
[[nodiscard]] std::string in_plain_words(const std::string& reason);

}  // namespace vps::cli
