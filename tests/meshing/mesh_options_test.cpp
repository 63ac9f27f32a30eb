#include "meshing/mesh_options.h"

#include <gtest/gtest.h>

#include <set>

#include "base/error.h"
#include "meshing/closed_shapes.h"
#include "meshing/generators.h"
#include "meshing/mesh_check.h"
#include "options/options.h"
#include "tests/meshing/mesh_writers.h"
#include "tests/meshing/scratch_file.h"

namespace pellicle {
namespace {

constexpr double quarter_turn = 3.14159265358979323846 / 2;

TEST(MakeMesh, GeneratesEachShape) {
  MeshOptions options;
  options.cells = {6, 5};
  EXPECT_EQ(make_mesh(options).faces, rectangle_mesh({6, 5}, {1, 1}).faces);
  options.shape = "torus";
  EXPECT_EQ(make_mesh(options).points, torus_mesh({6, 5}, 0.5, 0.2).points);
  options.shape = "roof";
  options.size = {2, 1};
  EXPECT_EQ(make_mesh(options).points, roof_mesh({6, 5}, {2, 1}, options.arch).points);
  options.shape = "square";
  EXPECT_EQ(make_mesh(options).points, square_mesh({6, 5}, {2, 1}).points);
  options.shape = "shirt";
  options.cells = {9, 8};
  EXPECT_EQ(make_mesh(options).points, shirt_mesh({9, 8}, {2, 1}).points);
  options.shape = "disc";
  EXPECT_EQ(make_mesh(options).points, disc_mesh(options.rings, options.radius).points);
  options.shape = "icosphere";
  options.level = 2;
  EXPECT_EQ(make_mesh(options).points, icosphere_mesh(2, options.radius).points);
  options.shape = "ellipsoid";
  EXPECT_EQ(make_mesh(options).points, ellipsoid_mesh(2, options.semi_axes).points);
  options.shape = "tube";
  options.vertices = 500;
  EXPECT_EQ(make_mesh(options).points, tube_mesh(options.length, options.radius, 500).points);
  options.shape = "blobs";
  options.blobs["ball"].radius = 0.1;
  EXPECT_EQ(make_mesh(options).points, blobs_mesh(options.blobs, 500).points);
}

TEST(MakeMesh, FileReplacesTheShape) {
  const ScratchFile file("torus.off");
  write_mesh(torus_mesh({7, 5}, 0.5, 0.2), file.path());
  MeshOptions options;
  EXPECT_EQ(options.name(), "rectangle");
  options.file = file.path();
  EXPECT_EQ(options.name(), file.path());
  EXPECT_EQ(make_mesh(options).faces.size(), 35U);
  options.file.clear();
  options.shape = "file";
  EXPECT_EQ(message_of<Error>([&options] { make_mesh(options); }),
            "mesh.shape: 'file', but mesh.file is empty, expected the name of a mesh file");
}

TEST(MakeMesh, ScalesThenTurnsThenShifts) {
  MeshOptions options;
  options.cells = {1, 1};
  options.scale = 2;
  options.rotation = {quarter_turn, 0, quarter_turn};  // the sheet stands up, then turns round z
  options.shift = {10, 20, 30};
  // (-0.5, -0.5, 0) -> (-1, -1, 0) -> (-1, 0, -1) -> (0, -1, -1)
  EXPECT_TRUE(make_mesh(options).points[0].isApprox(Eigen::Vector3d(10, 19, 29)));
  SurfaceMesh mesh = make_mesh(options);
  EXPECT_NEAR(check_and_repair(mesh, "it").area, 4, 1e-13);
}

TEST(MeshOptions, AreDeclared) {
  MeshOptions options;
  OptionTable table;
  describe(table, options);
  table.find_key("mesh.rotation")->assign({WrittenValue::Kind::list, {{"90 deg", "0", "0.5 rad"}}});
  table.find_key("mesh.size")->assign({WrittenValue::Kind::list, {{"300 mm", "20 cm"}}});
  table.find_name("mesh_file")->assign({WrittenValue::Kind::scalar, {{"teddy.off"}}});
  EXPECT_DOUBLE_EQ(options.rotation.x(), quarter_turn);
  EXPECT_DOUBLE_EQ(options.rotation.z(), 0.5);
  EXPECT_EQ(options.size, (std::vector<double>{0.3, 0.2}));
  EXPECT_EQ(options.name(), "teddy.off");
  table.find_name("mesh_volume")->assign({WrittenValue::Kind::scalar, {{"0.002 m^3"}}});
  EXPECT_DOUBLE_EQ(options.volume.value(), 2e-3);
  table.find_name("mesh_merge")->assign({WrittenValue::Kind::scalar, {{"false"}}});
  EXPECT_FALSE(options.merge);
  EXPECT_THROW(table.find_key("mesh.cells")->assign({WrittenValue::Kind::list, {{"4", "0"}}}), Error);
  EXPECT_THROW(table.find_key("mesh.scale")->assign({WrittenValue::Kind::scalar, {{"0"}}}), Error);
  EXPECT_THROW(table.find_key("mesh.shape")->assign({WrittenValue::Kind::scalar, {{"dics"}}}), Error);
}

}  // namespace
}  // namespace pellicle
