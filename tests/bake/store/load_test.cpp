// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <cstring>
#include <thread>

#include "bake/store/vps_store.h"
#include "tests/support/baked.h"
#include "tests/support/shapes.h"
#include "tests/support/temporary_folder.h"
#ifdef VPS_WITH_BULLET
#include <BulletCollision/CollisionShapes/btTriangleIndexVertexArray.h>

#include "bake/store/vps_load_bullet.h"
#endif

namespace vps::test {

using namespace bake;
namespace {

namespace fs = std::filesystem;

// Counts the bakes that run with these settings.
struct CountedSettings : BakeSettings {
  CountedSettings() {
    options.resolution = 10;
    options.progress = [this](const char* stage, double) { bakes += std::strcmp(stage, "check") == 0 ? 1 : 0; };
  }
  CountedSettings(const CountedSettings&) = delete;
  CountedSettings& operator=(const CountedSettings&) = delete;
  int bakes = 0;
};

std::string bytes_of(const StoredAsset& loaded) {
  EXPECT_TRUE(loaded.asset != nullptr && loaded.asset->is_open());
  const auto bytes = loaded.asset->bytes();
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

// All sections but the record, which says how the mesh came.
std::string content_of(const StoredAsset& loaded) {
  const std::string bytes = bytes_of(loaded);
  const Directory& directory = loaded.asset->directory();
  std::string content;
  for (std::uint32_t i = 0; i < directory.section_count; ++i) {
    const Section& section = directory.sections[i];
    if (section.kind != SectionKind::record) content += bytes.substr(section.offset, section.bytes);
  }
  return content;
}

fs::path sample_mesh(const char* name) {
  return fs::path(VPS_SAMPLE_MESHES) / name;
}

// The result of a bake without a cache.
std::string fresh(const TriangleMesh& mesh, const BakeOptions& options) {
  StoredAsset stored;
  stored.asset = baked(mesh, options);
  return content_of(stored);
}

TEST(Load, TheSecondTimeNothingIsBaked) {
  const TemporaryFolder folder;
  CountedSettings settings;
  const StoredAsset first = load_or_bake(sample_mesh("hole.obj"), settings, folder / "cache");
  EXPECT_TRUE(first.baked);
  EXPECT_EQ(settings.bakes, 1);
  const StoredAsset second = load_or_bake(sample_mesh("hole.obj"), settings, folder / "cache");
  EXPECT_FALSE(second.baked);
  EXPECT_EQ(settings.bakes, 1);
  EXPECT_EQ(first.warning + second.warning, "");
  EXPECT_EQ(bytes_of(second), bytes_of(first));
  EXPECT_EQ(content_of(first), fresh(import_mesh(sample_mesh("hole.obj")), settings.options));
  EXPECT_EQ(second.report.notes, first.report.notes);
  EXPECT_EQ(second.report.plan.dims, first.report.plan.dims);
}

TEST(Load, WithoutACacheTheAssetLivesAndNoFileIsLeft) {
  const TemporaryFolder folder;
  const std::string before = fs::temp_directory_path();
  ::setenv("TMPDIR", folder.path().c_str(), 1);
  CountedSettings settings;
  const StoredAsset loaded = load_or_bake(sample_mesh("cube.obj"), settings);
  ::setenv("TMPDIR", before.c_str(), 1);
  EXPECT_TRUE(folder.names().empty());
  EXPECT_TRUE(loaded.baked);
  EXPECT_EQ(loaded.warning, "");
  EXPECT_EQ(loaded.asset->verify(), Status::ok);
  EXPECT_EQ(content_of(loaded), fresh(import_mesh(sample_mesh("cube.obj")), settings.options));
}

TEST(Load, ACacheThatCannotBeUsedCostsAWarningOnly) {
  const TemporaryFolder folder;
  write_file(folder / "file", "");
  CountedSettings settings;
  const StoredAsset loaded = load_or_bake(sample_mesh("cube.obj"), settings, folder / "file");
  EXPECT_NE(loaded.warning, "");
  EXPECT_EQ(content_of(loaded), fresh(import_mesh(sample_mesh("cube.obj")), settings.options));
}

TEST(Load, ADamagedEntryIsBakedAgain) {
  const TemporaryFolder folder;
  CountedSettings settings;
  const std::string whole = bytes_of(load_or_bake(sample_mesh("cube.obj"), settings, folder.path()));
  const std::string key = cache_key(*bake_record(sample_mesh("cube.obj"), settings)).digits;
  const std::string entry = key.substr(0, 2) + "/" + key + ".vps.hdf";
  write_file(folder / entry, whole.substr(0, whole.size() / 2));
  const StoredAsset again = load_or_bake(sample_mesh("cube.obj"), settings, folder.path());
  EXPECT_TRUE(again.baked);
  EXPECT_EQ(bytes_of(again), whole);
  EXPECT_EQ(read_file(folder / entry), whole);
}

TEST(Load, AMeshInMemoryIsBakedOnce) {
  const TemporaryFolder folder;
  CountedSettings settings;
  TriangleMesh mesh = make_box({0.05, 0.04, 0.03});
  EXPECT_EQ(content_of(load_or_bake(mesh, settings, folder.path())), fresh(mesh, settings.options));
  const int bakes = settings.bakes;
  EXPECT_FALSE(load_or_bake(mesh, settings, folder.path()).baked);
  EXPECT_EQ(settings.bakes, bakes);
  mesh.vertices[0][0] -= 0.001;
  EXPECT_TRUE(load_or_bake(mesh, settings, folder.path()).baked);
  EXPECT_TRUE(load_or_bake(mesh, settings).baked);
}

TEST(Load, AMeshThatDoesNotStopChangingIsRefused) {
  const TemporaryFolder folder;
  // A tetrahedron and a second, unused buffer whose bytes differ each time it is read.
  const float corners[4][3] = {{0, 0, 0}, {0.1F, 0, 0}, {0, 0.1F, 0}, {0, 0, 0.1F}};
  const std::uint16_t faces[4][3] = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {0, 3, 2}};
  write_file(folder / "mesh.bin", std::string(reinterpret_cast<const char*>(corners), sizeof corners) +
                                      std::string(reinterpret_cast<const char*>(faces), sizeof faces));
  const fs::path restless = "/proc/sys/kernel/random/uuid";
  if (!fs::exists(restless)) GTEST_SKIP() << "needs " << restless;
  fs::create_symlink(restless, folder / "restless.bin");
  const auto mesh_with = [](const std::string& more_buffers) {
    return R"({"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
      "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
      "accessors": [{"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3"},
                    {"bufferView": 1, "componentType": 5123, "count": 12, "type": "SCALAR"}],
      "bufferViews": [{"buffer": 0, "byteLength": 48}, {"buffer": 0, "byteOffset": 48, "byteLength": 24}],
      "buffers": [{"uri": "mesh.bin", "byteLength": 72})" +
           more_buffers + "]}";
  };
  write_file(folder / "still.gltf", mesh_with(""));
  write_file(folder / "restless.gltf", mesh_with(R"(, {"uri": "restless.bin", "byteLength": 1})"));
  CountedSettings settings;
  const StoredAsset still = load_or_bake(folder / "still.gltf", settings, folder / "still");
  EXPECT_EQ(still.warning, "");
  EXPECT_FALSE(load_or_bake(folder / "still.gltf", settings, folder / "still").baked);
  try {
    static_cast<void>(load_or_bake(folder / "restless.gltf", settings, folder / "cache"));
    ADD_FAILURE() << "it was baked";
  } catch (const LoadError& error) {
    EXPECT_EQ(error.stage, "import");
    EXPECT_NE(std::string(error.what()).find("changes while it is read"), std::string::npos) << error.what();
  }
  EXPECT_FALSE(fs::exists(folder / "cache"));
}

TEST(Load, AMeshThatIsWrittenWhileItIsReadIsReadAgain) {
  const TemporaryFolder folder;
  const auto write = [&](const char* sample) { write_file(folder / "mesh.obj", read_file(sample_mesh(sample))); };
  write("cube.obj");
  BakeSettings settings;
  settings.options.resolution = 10;
  std::vector<std::string> stages;
  settings.options.progress = [&](const char* stage, double) {
    stages.emplace_back(stage);
    if (stages.back() == "import") write("hole.obj");  // after it was hashed
  };
  const AssetCache cache(folder / "cache");
  const StoredAsset stored = bake_stored(folder / "mesh.obj", settings, &cache);
  ASSERT_TRUE(stored.baked);
  EXPECT_EQ(stored.warning, "");
  EXPECT_EQ(stored.key, cache_key(*bake_record(sample_mesh("hole.obj"), settings)));
  EXPECT_EQ(stages.front(), "import");
  EXPECT_EQ(stages.back(), "store");
  const StoredAsset loaded = load_or_bake(sample_mesh("hole.obj"), settings, folder / "cache");
  EXPECT_FALSE(loaded.baked);
  EXPECT_EQ(content_of(loaded), fresh(import_mesh(sample_mesh("hole.obj")), settings.options));
}

TEST(Load, CallsComeInOrderAndMayEndTheBake) {
  const TemporaryFolder folder;
  const AssetCache cache(folder / "cache");
  BakeSettings settings;
  settings.options.resolution = 10;
  std::string order;
  settings.options.planned = [&](const BakePlan& plan) { order += plan.voxels > 0 ? "planned " : "empty plan "; };
  const auto refusing = [] { throw WriteError("no"); };
  EXPECT_THROW(static_cast<void>(bake_stored(sample_mesh("cube.obj"), settings, &cache, refusing)), WriteError);
  EXPECT_EQ(order, "");
  EXPECT_FALSE(fs::exists(folder / "cache"));
  const auto noting = [&] { order += "imported "; };
  const StoredAsset first = bake_stored(sample_mesh("cube.obj"), settings, &cache, noting);
  EXPECT_EQ(order, "imported planned ");
  EXPECT_EQ(first.times.front().stage + " " + first.times.back().stage, "cache store");
  const StoredAsset second = bake_stored(sample_mesh("cube.obj"), settings, &cache, noting);
  EXPECT_EQ(order, "imported planned ");  // nothing was baked
  EXPECT_TRUE(!second.baked && second.asset->is_open());
  EXPECT_EQ(second.key, first.key);
  settings.max_error = first.report.plan.voxel_size;  // bakes of the search are not told
  static_cast<void>(bake_stored(sample_mesh("cube.obj"), settings, nullptr));
  EXPECT_EQ(order, "imported planned planned ");
}

TEST(Load, ErrorsNameStageFileAndReason) {
  const TemporaryFolder folder;
  const auto expect_error = [&](const fs::path& mesh, double voxel_size, const char* stage, const char* reason) {
    BakeSettings settings;
    settings.options.voxel_size = voxel_size;
    try {
      static_cast<void>(load_or_bake(mesh, settings, folder / "cache"));
      ADD_FAILURE() << mesh;
    } catch (const LoadError& error) {
      EXPECT_EQ(error.stage, stage);
      EXPECT_EQ(error.file, mesh.string());
      EXPECT_NE(std::string(error.what()).find(reason), std::string::npos) << error.what();
    }
  };
  expect_error(folder / "absent.obj", 0.01, "import", "does not exist");
  expect_error(sample_mesh("cube.obj"), 10, "plan", "larger than the mesh");
  write_file(folder / "open.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n");
  expect_error(folder / "open.off", 0.1, "check", "the mesh is open");
  EXPECT_THROW(static_cast<void>(load_or_bake(TriangleMesh{}, {}, {})), LoadError);
  EXPECT_FALSE(fs::exists(folder / "cache"));
}

TEST(Load, ManyThreadsMayLoadTheSameAndOtherMeshes) {
  const TemporaryFolder folder;
  BakeSettings settings;
  settings.options.resolution = 10;
  std::vector<std::string> bytes(8);
  std::vector<std::thread> threads;
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    threads.emplace_back([&, i] {
      const TriangleMesh mesh = make_box({0.05, 0.04, i % 2 == 0 ? 0.03 : 0.02});
      bytes[i] = bytes_of(load_or_bake(mesh, settings, i < 4 ? folder.path() : fs::path()));
    });
  }
  for (std::thread& thread : threads) thread.join();
  for (std::size_t i = 2; i < bytes.size(); ++i) EXPECT_EQ(bytes[i], bytes[i % 2]);
  EXPECT_NE(bytes[0], bytes[1]);
  int files = 0;
  for (const auto& entry : fs::recursive_directory_iterator(folder.path())) files += entry.is_regular_file() ? 1 : 0;
  EXPECT_EQ(files, 4);
}

#ifdef VPS_WITH_BULLET
TEST(Load, BulletsMeshesAreTheirTriangles) {
  // Two parts; the second has 16-bit indices and another stride.
  const TriangleMesh mesh = make_box({0.05, 0.04, 0.03});
  std::vector<btScalar> positions;
  for (const auto& p : mesh.vertices) {
    for (const double x : p) positions.push_back(btScalar(2 * x));
    positions.push_back(btScalar(99));  // padding
  }
  std::vector<int> first;
  std::vector<unsigned short> second;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    for (const std::uint32_t corner : mesh.triangles[t]) {
      t < 5 ? first.push_back(int(corner)) : second.push_back(static_cast<unsigned short>(corner));
    }
  }
  btTriangleIndexVertexArray array;
  const auto add = [&](const void* indices, std::size_t count, std::size_t stride, PHY_ScalarType type) {
    btIndexedMesh part;
    part.m_numTriangles = int(count / 3);
    part.m_triangleIndexBase = static_cast<const unsigned char*>(indices);
    part.m_triangleIndexStride = int(3 * stride);
    part.m_numVertices = int(mesh.vertices.size());
    part.m_vertexBase = reinterpret_cast<const unsigned char*>(positions.data());
    part.m_vertexStride = 4 * sizeof(btScalar);
    array.addIndexedMesh(part, type);
  };
  add(first.data(), first.size(), sizeof(int), PHY_INTEGER);
  add(second.data(), second.size(), sizeof(unsigned short), PHY_SHORT);
  array.setScaling({btScalar(0.5), btScalar(0.5), btScalar(0.5)});

  const TriangleMesh got = bullet::triangles_of(array);
  ASSERT_EQ(got.triangles.size(), mesh.triangles.size());
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    for (std::size_t k = 0; k < 3; ++k) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        EXPECT_EQ(got.vertices[got.triangles[t][k]][axis], double(btScalar(mesh.vertices[mesh.triangles[t][k]][axis])));
      }
    }
  }
  BakeSettings settings;
  settings.options.resolution = 10;
  const StoredAsset loaded = load_or_bake(got, settings);
  EXPECT_EQ(loaded.report.repair, Repair::none);
  EXPECT_EQ(loaded.asset->info().vertices, 8U);
}
#endif

}  // namespace
}  // namespace vps::test
