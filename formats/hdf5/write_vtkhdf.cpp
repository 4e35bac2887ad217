// SPDX-License-Identifier: GPL-3.0-or-later
// VTK File Formats, "VTKHDF", ImageData. Values lie on points, because VTK 9.1 and 9.2 misread cell data.
#include "formats/hdf5/write_vtkhdf.h"

#include "formats/hdf5/hdf5_handle.h"

namespace vps {
namespace {

using detail::Handle;
using detail::require;

// VTK compares the type without a terminating zero.
void write_type(hid_t group) {
  constexpr const char kType[] = "ImageData";
  const Handle type(H5Tcopy(H5T_C_S1), H5Tclose, "make an attribute");
  require(H5Tset_size(type, sizeof kType - 1), "make an attribute");
  require(H5Tset_strpad(type, H5T_STR_NULLPAD), "make an attribute");
  const Handle space(H5Screate(H5S_SCALAR), H5Sclose, "make an attribute");
  const Handle attribute(H5Acreate2(group, "Type", type, space, H5P_DEFAULT, H5P_DEFAULT), H5Aclose,
                         "make an attribute");
  require(H5Awrite(attribute, type, kType), "write an attribute");
}

void write_grid(hid_t file, const ImageGrid& grid) {
  detail::create_group(file, "/VTKHDF");
  detail::create_group(file, "/VTKHDF/PointData");
  const Handle group(H5Gopen2(file, "/VTKHDF", H5P_DEFAULT), H5Gclose, "open a group");
  write_type(group);
  const auto last = [&](std::size_t axis) { return static_cast<std::int32_t>(grid.points[axis] - 1); };
  detail::write_attribute(group, "Version", std::array<std::int32_t, 2>{1, 0});
  detail::write_attribute(group, "WholeExtent", std::array<std::int32_t, 6>{0, last(0), 0, last(1), 0, last(2)});
  detail::write_attribute(group, "Origin", grid.origin);
  detail::write_attribute(group, "Spacing", std::array<double, 3>{grid.spacing, grid.spacing, grid.spacing});
  detail::write_attribute(group, "Direction", std::array<double, 9>{1, 0, 0, 0, 1, 0, 0, 0, 1});
}

void write_array(hid_t file, const ImageGrid& grid, const ImageArray& array) {
  const hid_t type = array.element == ElementType::f32   ? H5T_IEEE_F32LE
                     : array.element == ElementType::i16 ? H5T_STD_I16LE
                                                         : H5T_STD_I8LE;
  const hsize_t shape[3] = {grid.points[2], grid.points[1], grid.points[0]};
  const Handle space(H5Screate_simple(3, shape, nullptr), H5Sclose, "set up a dataset");
  const Handle create(H5Pcreate(H5P_DATASET_CREATE), H5Pclose, "set up a dataset");
  require(H5Pset_obj_track_times(create, false), "set up a dataset");
  require(H5Pset_fill_time(create, H5D_FILL_TIME_NEVER), "set up a dataset");
  const std::string path = "/VTKHDF/PointData/" + array.name;
  const Handle dataset(H5Dcreate2(file, path.c_str(), type, space, H5P_DEFAULT, create, H5P_DEFAULT), H5Dclose,
                       "create a dataset");
  const hsize_t plane[3] = {1, shape[1], shape[2]};
  const Handle memory(H5Screate_simple(3, plane, nullptr), H5Sclose, "write a dataset");
  std::vector<std::byte> values(shape[1] * shape[2] * element_bytes(array.element));
  for (hsize_t z = 0; z < shape[0]; ++z) {
    array.plane(z, values.data());
    const hsize_t start[3] = {z, 0, 0};
    require(H5Sselect_hyperslab(space, H5S_SELECT_SET, start, nullptr, plane, nullptr), "write a dataset");
    require(H5Dwrite(dataset, type, memory, space, H5P_DEFAULT, values.data()), "write a dataset");
  }
}

}  // namespace

std::size_t write_vtkhdf(const std::filesystem::path& path, const ImageGrid& grid,
                         const std::vector<ImageArray>& arrays) {
  const std::lock_guard lock(detail::one_at_a_time);
  const detail::SilentErrors silent;
  detail::MemoryFile memory;
  Handle file = detail::create_file(memory, 0);
  write_grid(file, grid);
  for (const ImageArray& array : arrays) write_array(file, grid, array);
  memory.finish(file);
  write_whole(path, memory.bytes());
  return memory.bytes().size();
}

}  // namespace vps
