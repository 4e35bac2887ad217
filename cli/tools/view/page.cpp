// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/tools/view/page.h"

#include <stdexcept>

namespace vps::cli {
namespace {

void replace_mark(std::string& page, std::string_view mark, std::string_view text) {
  const std::size_t at = page.find(mark);
  if (at == std::string::npos) throw std::logic_error("a page without " + std::string(mark));
  page.replace(at, mark.size(), text);
}

// Escapes every <: a script ends at the first end tag, even inside a JSON text.
std::string without_tags(std::string json) {
  for (std::size_t at = json.find('<'); at != std::string::npos; at = json.find('<', at))
    json.replace(at, 1, "\\u003c");
  return json;
}

}  // namespace

std::string make_page(std::string_view page, std::span<const Embedded> libraries, const nlohmann::ordered_json& data) {
  // The file of three.js has no copyright notice.
  std::string scripts =
      "<!-- Libraries: Chart.js, (c) Chart.js Contributors, and three.js, (c) three.js authors; MIT License -->\n";
  for (const Embedded& library : libraries) {
    scripts += "<script>";
    scripts += library.text();
    scripts += "</script>\n";
  }
  std::string out(page);
  replace_mark(out, "<!-- data -->",
               R"(<script type="application/json" id="data">)" +
                   without_tags(data.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace)) +
                   "</script>");
  replace_mark(out, "<!-- libraries -->", scripts);
  return out;
}

std::string make_view_page(const Embedded& page, const nlohmann::ordered_json& data) {
  std::string styled(page.text());
  replace_mark(styled, "<!-- style -->", "<style>" + std::string(kView3dStyle.text()) + "</style>");
  const Embedded libraries[] = {kThree, kOrbitControls, kView3d};
  return make_page(styled, libraries, data);
}

std::string_view page_beginning(const Embedded& page) {
  return page.text().substr(0, page.text().find("</title>"));
}

}  // namespace vps::cli
