// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Pages that need only a browser and no network: a template of cli/tools/view/pages with libraries and data
/// inlined.
#pragma once

#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <string_view>

#include "cli/tools/view/embedded.h"

namespace vps::cli {

/// Puts the libraries where the template says `<!-- libraries -->`, each in a script of its own, and the data where it
/// says `<!-- data -->`, as a script of type application/json with the id "data".
/// @param data  any text in it is safe in a page; bytes that are not UTF-8 are replaced
[[nodiscard]] std::string make_page(std::string_view page, std::span<const Embedded> libraries,
                                    const nlohmann::ordered_json& data);

/// The same for pages with a three-dimensional view, with their libraries, and their style where the template says
/// `<!-- style -->`.
[[nodiscard]] std::string make_view_page(const Embedded& page, const nlohmann::ordered_json& data);

/// The first bytes of a template's pages, to the end of its title: no other template begins with them. So a page does
/// not replace one of another command, though their default names may be the same, such as gear.html.
[[nodiscard]] std::string_view page_beginning(const Embedded& page);

}  // namespace vps::cli
