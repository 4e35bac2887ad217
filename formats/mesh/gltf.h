// SPDX-License-Identifier: GPL-3.0-or-later
/// @file What a glTF file says beside its meshes.
#pragma once

#include <string>
#include <string_view>

namespace vps {

/// The JSON of a glb file, or the whole of a gltf file.
[[nodiscard]] std::string_view gltf_json(std::string_view file);

/// Names what changes shapes and is not read: skins, morph targets with weights, instances of EXT_mesh_gpu_instancing.
/// @return one line, empty when there is nothing of it or the JSON cannot be parsed
/// @throw ReadError (raw_mesh.h) where the file requires an extension that is not read, such as compressed meshes
[[nodiscard]] std::string check_gltf(std::string_view file);

}  // namespace vps
