// SPDX-License-Identifier: GPL-3.0-or-later
// assimp passes over what it does not know, also where the file says that it is required.
#include "formats/mesh/gltf.h"

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <nlohmann/json.hpp>

#include "formats/mesh/raw_mesh.h"

namespace vps {
namespace {

using Json = nlohmann::json;

// Extensions that change how a mesh looks, not its shape, begin with one of these.
bool is_of_looks(std::string_view extension) {
  constexpr std::string_view kBegins[] = {"KHR_materials_", "KHR_texture_", "EXT_texture_",    "MSFT_texture_",
                                          "KHR_lights_",    "EXT_lights_",  "KHR_binary_glTF", "KHR_xmp"};
  return std::any_of(std::begin(kBegins), std::end(kBegins), [&](auto begin) { return extension.starts_with(begin); });
}

// The members of the file that check_gltf needs: a file may hold all of its geometry as text elsewhere.
Json parse_members(std::string_view text) {
  const auto keep = [](int depth, Json::parse_event_t event, const Json& value) {
    constexpr std::string_view kKept[] = {"extensionsRequired", "extensionsUsed", "nodes", "meshes", "skins"};
    if (depth != 1 || event != Json::parse_event_t::key) return true;
    return std::find(std::begin(kKept), std::end(kKept), value.get_ref<const std::string&>()) != std::end(kKept);
  };
  return Json::parse(text.begin(), text.end(), keep, false);
}

// Calls visit(item) for each object of a list, or of a map as glTF 1 has it.
template <class Visit>
void for_each_object(const Json& file, const char* name, Visit visit) {
  const auto list = file.find(name);
  if (list == file.end() || !list->is_structured()) return;
  for (const Json& item : *list) {
    if (item.is_object()) visit(item);
  }
}

bool has_weights(const Json& item) {
  const auto weights = item.find("weights");
  return weights != item.end() && weights->is_array() &&
         std::any_of(weights->begin(), weights->end(), [](const Json& w) { return w.is_number() && w != 0; });
}

}  // namespace

// A glb file starts with its magic, version and length (3 u32), then size and type (2 u32) of the first chunk, which is
// the JSON; in version 1 the same place holds the same size.
std::string_view gltf_json(std::string_view file) {
  constexpr std::size_t kJson = 20;
  if (!file.starts_with("glTF") || file.size() < kJson) return file;
  std::uint32_t size = 0;
  std::memcpy(&size, file.data() + 12, sizeof size);
  return file.substr(kJson, size);
}

std::string check_gltf(std::string_view file) {
  const Json json = parse_members(gltf_json(file));
  if (!json.is_object()) return {};
  const auto for_each_name = [&](const char* list, auto visit) {
    for (const Json& name : json.value(list, Json::array())) {
      if (name.is_string()) visit(name.get_ref<const std::string&>());
    }
  };
  for_each_name("extensionsRequired", [](const std::string& name) {
    if (!is_of_looks(name)) throw ReadError("the file needs the glTF extension " + name + ", which is not read");
  });
  bool skins = false, morphs = false, instances = false;
  for_each_name("extensionsUsed", [&](const std::string& name) { instances |= name == "EXT_mesh_gpu_instancing"; });
  for_each_object(json, "nodes", [&](const Json& node) {
    skins |= node.contains("skin");
    morphs |= has_weights(node);
  });
  for_each_object(json, "meshes", [&](const Json& mesh) { morphs |= has_weights(mesh); });

  // assimp crashes on what glTF 2 allows.
  for_each_object(json, "skins", [](const Json& skin) {
    if (!skin.contains("inverseBindMatrices"))
      throw ReadError("a skin without inverse bind matrices, which is not read");
  });

  std::string left_out;
  const auto add = [&](bool is_there, const char* what) {
    if (is_there) left_out += (left_out.empty() ? "" : ", ") + std::string(what);
  };
  add(skins, "skins");
  add(morphs, "weights of morph targets");
  add(instances, "instances (EXT_mesh_gpu_instancing)");
  return left_out.empty() ? left_out : "not read, so shapes are as they were modelled: " + left_out;
}

}  // namespace vps
