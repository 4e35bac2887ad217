// SPDX-License-Identifier: GPL-3.0-or-later
// `vpsbake export`: each format is read back with its own program and compared with the runtime's results.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>

#include "cli/tools/export/export.h"
#include "cli/tools/stored_field.h"
#include "formats/mesh/mesh_import.h"
#include "runtime/vps_runtime.h"
#include "tests/cli/program.h"
#include "tests/cli/schema.h"
#include "tests/support/comma_locale.h"
#include "tests/support/oracle.h"
#include "tests/support/random.h"

#ifdef VPS_TEST_BULLET
#include <BulletCollision/CollisionShapes/btSdfCollisionShape.h>
#include <btBulletDynamicsCommon.h>
#endif

namespace vps::test {
namespace {

using Json = nlohmann::json;

bool python_has(const std::string& module) {
  return std::system(("/usr/bin/python3 -c 'import " + module + "' >/dev/null 2>&1").c_str()) == 0;
}

// A gear-like sample with all fields.
class Export : public ::testing::Test {
 protected:
  void SetUp() override {
    static const std::string asset = file_baked(folder_, sample("nut") + " --voxel 0.7mm --fields layers,scaled,real");
    write_file(folder_ / "a.vps.hdf", asset);
    ASSERT_EQ(Asset::open((folder_ / "a.vps.hdf").c_str(), asset_), Status::ok);
    ASSERT_EQ(asset_.voxelmap(map_), Status::ok);
    ASSERT_EQ(asset_.pointshell(shell_), Status::ok);
  }
  std::string exported(const std::string& options, const std::string& file) {
    const Outcome run = vpsbake(folder_, "export a.vps.hdf -o " + file + " --to " + options);
    EXPECT_EQ(run.code, 0) << run.err;
    return read_file(folder_ / file);
  }
  // Runs Python in the folder.
  [[nodiscard]] bool python(const std::string& script) const {
    write_file(folder_ / "script.py", script);
    return std::system(("cd " + folder_.path().string() + " && /usr/bin/python3 script.py").c_str()) == 0;
  }
  [[nodiscard]] Vec3 random_point(Random& random) const {
    float p[3];
    for (int axis = 0; axis < 3; ++axis) {
      p[axis] = float(random.between(double(map_.bounds_min[axis] - map_.band_outer),
                                     double(map_.bounds_max[axis] + map_.band_outer)));
    }
    return {p[0], p[1], p[2]};
  }

  TemporaryFolder folder_;
  Asset asset_;
  VoxelmapView map_;
  PointshellView shell_;
};

TEST_F(Export, VtkReadsTheGridWithTheRuntimesValues) {
  if (!python_has("vtk")) GTEST_SKIP() << "needs python3-vtk9";
  const std::string once = exported("vtkhdf", "a.hdf");
  EXPECT_EQ(once, exported("vtkhdf", "b.hdf"));
  ASSERT_TRUE(python(R"(
import vtk
from vtk.util.numpy_support import vtk_to_numpy
reader = vtk.vtkHDFReader()
assert reader.CanReadFile("a.hdf")
reader.SetFileName("a.hdf")
reader.Update()
grid = reader.GetOutput()
with open("grid.txt", "w") as out:
    print(*grid.GetDimensions(), *grid.GetOrigin(), *grid.GetSpacing(), file=out)
for name in ("penetration", "stored", "layer"):
    vtk_to_numpy(grid.GetPointData().GetArray(name)).tofile(name)
)"));
  std::istringstream facts(read_file(folder_ / "grid.txt"));
  std::uint64_t dims[3];
  double origin[3], spacing[3];
  for (auto& x : dims) facts >> x;
  for (auto& x : origin) facts >> x;
  for (auto& x : spacing) facts >> x;
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_EQ(dims[axis], map_.dims[axis]);
    EXPECT_NEAR(spacing[axis], 0.0007, 1e-12);
  }
  const std::string values = read_file(folder_ / "penetration"), stored = read_file(folder_ / "stored"),
                    layer = read_file(folder_ / "layer");
  const std::size_t points = dims[0] * dims[1] * dims[2];
  ASSERT_EQ(values.size(), points * sizeof(float));
  ASSERT_EQ(stored.size(), points);
  ASSERT_EQ(layer.size(), points * sizeof(std::int16_t));
  std::size_t in_band = 0;
  for (std::size_t n = 0; n < points; ++n) {
    const std::size_t index[3] = {n % dims[0], n / dims[0] % dims[1], n / dims[0] / dims[1]};
    float p[3];
    for (int axis = 0; axis < 3; ++axis) p[axis] = float(origin[axis] + spacing[axis] * double(index[axis]));
    const Vec3 place{p[0], p[1], p[2]};
    float v = 0;
    std::int16_t l = 0;
    std::memcpy(&v, values.data() + n * sizeof v, sizeof v);
    std::memcpy(&l, layer.data() + n * sizeof l, sizeof l);
    ASSERT_NEAR(v, penetration(map_, place, {}), 1e-7F) << n;
    ASSERT_EQ(stored[n] != 0, std::isfinite(cli::stored_penetration(map_, place))) << n;
    in_band += stored[n] != 0 ? 1 : 0;
    // Layers at voxel centres: centres of surface voxels are within half a diagonal of the surface.
    if (l == 0 && stored[n] != 0) {
      ASSERT_LE(std::abs(v), 0.87F * 0.0007F + map_.error) << n;
    }
    if (std::abs(int{l}) < 100 && l != 0 && std::abs(v) > map_.error) {
      ASSERT_EQ(l > 0, v > 0) << n;
    }
  }
  EXPECT_GT(in_band, 1000U);
}

TEST_F(Export, PlyHoldsTheRuntimesPointsAndTheirNodes) {
  const std::string text = exported("ply", "a.ply");
  constexpr std::size_t kStride = 7 * sizeof(float) + 2 * sizeof(std::uint32_t);
  const std::string end = "end_header\n";
  const std::size_t header = text.find(end) + end.size();
  EXPECT_NE(text.find("element vertex " + std::to_string(shell_.points) + "\n"), std::string::npos);
  ASSERT_EQ(text.size(), header + shell_.points * kStride);
  double area = 0;
  std::map<std::uint32_t, int> segments;
  for (std::uint32_t i = 0; i < shell_.points; ++i) {
    float x[7];
    std::uint32_t nodes[2];
    std::memcpy(x, text.data() + header + i * kStride, sizeof x);
    std::memcpy(nodes, text.data() + header + i * kStride + sizeof x, sizeof nodes);
    const Vec3 p = point_position(shell_, i), n = point_inward_normal(shell_, i);
    EXPECT_EQ(x[0], p.x);
    EXPECT_EQ(x[1], p.y);
    EXPECT_EQ(x[2], p.z);
    EXPECT_EQ(x[3], -n.x);
    EXPECT_EQ(x[4], -n.y);
    EXPECT_EQ(x[5], -n.z);
    area += double(x[6]);
    for (const std::uint32_t node : nodes) {
      ASSERT_LT(node, shell_.nodes);
      const Vec3 centre = sphere_centre(shell_, node);
      const double d[3] = {double(p.x - centre.x), double(p.y - centre.y), double(p.z - centre.z)};
      EXPECT_LE(std::hypot(d[0], d[1], d[2]), double(sphere_radius(shell_, node)) * (1 + 1e-6));
    }
    ++segments[nodes[1]];
    const IndexRange children = children_of(shell_, nodes[0]);
    EXPECT_TRUE(i >= children.begin && i < children.end) << i;
  }
  EXPECT_NEAR(area, asset_.info().surface_area, 1e-5 * asset_.info().surface_area);
  EXPECT_GT(segments.size(), 3U);
}

TEST_F(Export, ObjIsClosedAndOnTheMeshsSurface) {
  std::istringstream text(exported("obj --field real", "a.obj"));
  TriangleMesh mesh;
  std::string word;
  while (text >> word) {
    if (word == "v") {
      auto& p = mesh.vertices.emplace_back();
      text >> p[0] >> p[1] >> p[2];
    } else if (word == "f") {
      auto& t = mesh.triangles.emplace_back();
      text >> t[0] >> t[1] >> t[2];
      for (auto& i : t) --i;
    } else {
      std::getline(text, word);
    }
  }
  ASSERT_GT(mesh.triangles.size(), 1000U);
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> balance;
  for (const auto& t : mesh.triangles) {
    for (std::size_t i = 0; i < 3; ++i) {
      const std::uint32_t a = t[i], b = t[(i + 1) % 3];
      balance[{std::min(a, b), std::max(a, b)}] += a < b ? 1 : -1;
    }
  }
  for (const auto& [edge, count] : balance) EXPECT_EQ(count, 0);
  const double volume = [&] {
    double sum = 0;
    for (const auto& [a, b, c] : mesh.triangles) {
      const auto &p = mesh.vertices[a], &q = mesh.vertices[b], &r = mesh.vertices[c];
      sum += (p[0] * (q[1] * r[2] - q[2] * r[1]) + p[1] * (q[2] * r[0] - q[0] * r[2]) +
              p[2] * (q[0] * r[1] - q[1] * r[0])) /
             6;
    }
    return sum;
  }();
  EXPECT_NEAR(volume, asset_.info().volume, 0.05 * asset_.info().volume);  // positive: wound outward
  // Vertices lie on V = 0, except where a cell cuts off an edge.
  const Oracle oracle(import_mesh(sample("nut"), {}));
  int off = 0;
  for (const auto& p : mesh.vertices) off += oracle.distance(p) > double(map_.error) + 0.05 * 0.0007 ? 1 : 0;
  EXPECT_LE(off, int(mesh.vertices.size() / 50));
}

TEST_F(Export, JsonHoldsTheRuntimesNumbers) {
  const Json j = Json::parse(exported("json", "a.json"));
  EXPECT_EQ(j["points"]["positions"].size(), shell_.points);
  for (std::uint32_t i = 0; i < shell_.points; ++i) {
    const Vec3 p = point_position(shell_, i), n = point_inward_normal(shell_, i);
    EXPECT_EQ(float(j["points"]["positions"][i][0]), p.x);
    EXPECT_EQ(float(j["points"]["positions"][i][2]), p.z);
    EXPECT_EQ(float(j["points"]["inward_normals"][i][1]), n.y);
    EXPECT_EQ(float(j["points"]["areas"][i]), point_area(shell_, i));
  }
  ASSERT_EQ(j["tree"]["radii"].size(), shell_.nodes);
  for (std::uint32_t node = 0; node < shell_.nodes; ++node) {
    EXPECT_EQ(float(j["tree"]["radii"][node]), sphere_radius(shell_, node));
    const auto [begin, end] = children_of(shell_, node);
    EXPECT_EQ(j["tree"]["children"][node], Json::array({begin, end - begin}));
  }
  EXPECT_EQ(j["tree"]["level_offsets"].size(), shell_.levels + 1);
  VPS_SCHEMA_CHECK_OR_SKIP();
  EXPECT_TRUE(follows_schema(folder_ / "a.json", "asset.schema.json"));
}

TEST_F(Export, ALocaleWithADecimalCommaDoesNotChangeJson) {
  const std::string text = cli::to_json_text("a.vps.hdf", asset_);
  const CommaLocale comma;
  if (!comma.is_set()) GTEST_SKIP() << "needs Debian's locales";
  EXPECT_TRUE(cli::to_json_text("a.vps.hdf", asset_) == text);
}

TEST_F(Export, ThePythonExampleReadsTheSameNumbers) {
  if (!python_has("h5py")) GTEST_SKIP() << "needs h5py (Debian's python3-h5py)";
  exported("json", "a.json");
  VoxelmapView scaled;
  ASSERT_EQ(asset_.voxelmap(scaled, Field::scaled), Status::ok);
  Random random(3);
  Json places = Json::array();
  for (int i = 0; i < 400; ++i) {
    const Vec3 p = random_point(random);
    const float of_scaled = cli::stored_penetration(scaled, p), of_real = cli::stored_penetration(map_, p);
    const bool stored = std::isfinite(of_real);
    places.push_back({{"at", {p.x, p.y, p.z}},
                      {"scaled", stored ? Json(of_scaled) : Json(nullptr)},
                      {"real", stored ? Json(of_real) : Json(nullptr)}});
  }
  write_file(folder_ / "places.json", places.dump());
  const std::string example = std::string(VPS_DOCS) + "/examples/read_asset.py";
  EXPECT_TRUE(python("import json, sys\nsys.dont_write_bytecode = True\nsys.path.insert(0, '" + std::string(VPS_DOCS) +
                     "/examples')" + R"(
import h5py, numpy as np
from read_asset import penetration, read_points
theirs = json.load(open("a.json"))["points"]
with h5py.File("a.vps.hdf") as f:
    positions, normals, areas = read_points(f)
    assert abs(positions - np.array(theirs["positions"])).max() < 1e-9
    assert abs(normals - np.array(theirs["inward_normals"])).max() < 1e-6
    assert abs(areas / np.array(theirs["areas"]) - 1).max() < 1e-6
    stored = 0
    for place in json.load(open("places.json")):
        for field in ("scaled", "real"):
            v = penetration(f, place["at"], field)
            assert (v is None) == (place[field] is None), place
            if v is not None:
                assert abs(v - place[field]) < 2e-8, (v, place)
                stored += 1
    assert stored > 100, stored
)"));
  EXPECT_EQ(std::system(("/usr/bin/python3 " + example + " " + (folder_ / "a.vps.hdf").string() + " 0.008 0 0.005 >" +
                         (folder_ / "printed").string())
                            .c_str()),
            0);
  const std::string printed = read_file(folder_ / "printed");
  EXPECT_NE(printed.find("voxel_size                   0.0007\n"), std::string::npos) << printed;
  EXPECT_NE(printed.find("V of real at "), std::string::npos) << printed;
}

#ifdef VPS_TEST_BULLET
// [vx]
struct CdfErrors {
  double rms, worst;
};
class ExportCdf : public Export, public ::testing::WithParamInterface<std::pair<const char*, CdfErrors>> {};

TEST_P(ExportCdf, BulletReadsItWithTheRuntimesDistances) {
  const auto& [step, allowed] = GetParam();
  const std::string cdf = exported(std::string("cdf ") + step, "a.cdf");
  btSdfCollisionShape shape;
  ASSERT_TRUE(shape.initializeSDF(cdf.data(), int(cdf.size())));
  Random random(5);
  int inside_band = 0, outside = 0;
  double squares = 0, worst = 0;
  for (int i = 0; i < 20000; ++i) {
    const Vec3 p = random_point(random);
    const float v = cli::stored_penetration(map_, p);
    btScalar distance = 0;
    btVector3 gradient;
    const bool found = shape.queryPoint({p.x, p.y, p.z}, distance, gradient);
    ASSERT_TRUE(found || v < -map_.band_outer + 0.87F * map_.voxel_size) << v;
    outside += found ? 0 : 1;
    // Near the band's ends samples may be clamped.
    const bool exact = v < map_.band_inner - 0.87F * map_.voxel_size && v > 0.87F * map_.voxel_size - map_.band_outer;
    if (!exact) {
      EXPECT_TRUE(!found || (v < 0) == (distance > 0)) << v << " " << distance;
      continue;
    }
    ++inside_band;
    const double off = std::abs(double(distance) + double(v));  // negative inside
    worst = std::max(worst, off);
    squares += off * off;
  }
  EXPECT_GT(inside_band, 3000);
  EXPECT_GT(outside, 300);
  EXPECT_LT(std::sqrt(squares / inside_band), allowed.rms * 0.0007);
  EXPECT_LT(worst, allowed.worst * 0.0007);
}
// The largest errors lie where faces meet within a cell.
INSTANTIATE_TEST_SUITE_P(Steps, ExportCdf,
                         ::testing::Values(std::pair{"--step 1.05mm", CdfErrors{0.06, 0.8}},
                                           std::pair{"", CdfErrors{0.03, 0.25}},
                                           std::pair{"--step 0.35mm", CdfErrors{0.01, 0.1}}));

TEST(ExportToBullet, ASphereComesToRestOnTheCdf) {
  const TemporaryFolder folder;
  ASSERT_EQ(vpsbake(folder, sample("cube") + " --scale 10 --voxel 50mm -o a.vps.hdf").code, 0);
  ASSERT_EQ(vpsbake(folder, "export a.vps.hdf --to cdf --reach 25cm").code, 0);
  Asset asset;
  ASSERT_EQ(Asset::open((folder / "a.vps.hdf").c_str(), asset), Status::ok);
  const std::string cdf = read_file(folder / "a.cdf");
  btSdfCollisionShape ground;
  ASSERT_TRUE(ground.initializeSDF(cdf.data(), int(cdf.size())));
  btDefaultCollisionConfiguration configuration;
  btCollisionDispatcher dispatcher(&configuration);
  btDbvtBroadphase broadphase;
  btSequentialImpulseConstraintSolver solver;
  btDiscreteDynamicsWorld world(&dispatcher, &broadphase, &solver, &configuration);
  world.setGravity({0, 0, -10});
  const double top = asset.info().bounds_max[2];
  const auto middle = [&](std::size_t axis) {
    return btScalar((asset.info().bounds_min[axis] + asset.info().bounds_max[axis]) / 2);
  };
  btRigidBody fixed(btRigidBody::btRigidBodyConstructionInfo(0, nullptr, &ground));
  btSphereShape ball(0.2F);
  btVector3 inertia;
  ball.calculateLocalInertia(1, inertia);
  btRigidBody body(btRigidBody::btRigidBodyConstructionInfo(1, nullptr, &ball, inertia));
  btTransform start = btTransform::getIdentity();
  start.setOrigin({middle(0), middle(1), btScalar(top + 0.3)});
  body.setWorldTransform(start);
  world.addRigidBody(&fixed);
  world.addRigidBody(&body);
  for (int step = 0; step < 480; ++step) world.stepSimulation(1 / 240.F, 0);
  EXPECT_NEAR(double(body.getWorldTransform().getOrigin().z()), top + 0.2, 0.02);
  world.removeRigidBody(&body);
  world.removeRigidBody(&fixed);
}
#endif

TEST_F(Export, WhatCannotBeExportedIsRefusedAndNothingForeignIsOverwritten) {
  ASSERT_EQ(vpsbake(folder_, sample("cube") + " --voxel 5mm --parts pointshell -o points.vps.hdf").code, 0);
  ASSERT_EQ(vpsbake(folder_, sample("cube") + " --voxel 5mm --parts voxelmap --fields layers -o layers.vps.hdf").code,
            0);
  ASSERT_EQ(vpsbake(folder_, sample("cube") + " --voxel 1mm --parts voxelmap -o fine.vps.hdf").code, 0);
  for (const char* const format : {"vtkhdf", "cdf", "obj"})
    expect_refusal(folder_, std::string("export points.vps.hdf --to ") + format, 3, "it has no voxelmap");
  expect_refusal(folder_, "export layers.vps.hdf --to ply", 3, "it has no pointshell");
  expect_refusal(folder_, "export layers.vps.hdf --to cdf", 3, "layers are too coarse");
  expect_refusal(folder_, "export layers.vps.hdf --to obj --field real", 3, "no field real");
  expect_refusal(folder_, "export a.vps.hdf --to obj --reach 1mm", 1, "--reach is for");
  expect_refusal(folder_, "export fine.vps.hdf --to cdf --step 0.25mm --reach 10mm", 3, "too many for this format");
  expect_refusal(folder_, "export a.vps.hdf --to obj --step 0.1mm", 3, "a quarter of a voxel");
  expect_refusal(folder_, "export fine.vps.hdf --to vtkhdf --step 0.25mm", 3, "choose --step");
  expect_refusal(folder_, "export a.vps.hdf --to obj --step 1m", 3, "choose a smaller --step");
  expect_refusal(folder_, "export a.vps.hdf --to ply --step 1mm", 1, "--step is for");
  expect_refusal(folder_, "export a.vps.hdf --to stl", 1, "--to");
  expect_refusal(folder_, "export a.vps.hdf --to vtkhdf -o -", 1, "does not go to standard output");
  write_file(folder_ / "mesh.ply", "ply\nformat ascii 1.0\n");
  expect_refusal(folder_, "export a.vps.hdf --to ply -o mesh.ply", 2, "the file exists");
  write_file(folder_ / "mesh.obj", "v 0 0 0\n");
  expect_refusal(folder_, "export a.vps.hdf --to obj -o mesh.obj", 2, "the file exists");
  write_file(folder_ / "climate.cdf", "CDF\x01" + std::string(600, 'x'));
  expect_refusal(folder_, "export a.vps.hdf --to cdf -o climate.cdf", 2, "the file exists");
  std::filesystem::copy_file(folder_ / "a.vps.hdf", folder_ / "data.h5");
  expect_refusal(folder_, "export a.vps.hdf --to vtkhdf -o data.h5", 2, "the file exists and is not a VTKHDF file");
  for (const char* const format : {"vtkhdf", "json", "cdf"})
    expect_refusal(folder_, std::string("export a.vps.hdf -o a.vps.hdf --to ") + format, 2, "the file exists");
}

TEST_F(Export, OutputsGoBesideTheAssetAndMayBeWrittenAgain) {
  for (int again = 0; again < 2; ++again) {
    for (const char* const format : {"vtkhdf", "ply", "cdf", "obj", "json"})
      EXPECT_EQ(vpsbake(folder_, std::string("export a.vps.hdf --to ") + format).code, 0) << format;
  }
  for (const char* const name : {"a.vtk.hdf", "a_points.ply", "a.cdf", "a_field.obj", "a.json"})
    EXPECT_TRUE(std::filesystem::exists(folder_ / name)) << name;
}

}  // namespace
}  // namespace vps::test
