#include "meshing/blobs.h"

#include <gtest/gtest.h>
#include <mpi.h>
#include <yaml-cpp/yaml.h>

#include <cmath>
#include <fstream>

#include "base/error.h"
#include "geometry/pi.h"
#include "meshing/mesh_options.h"
#include "options/deck.h"
#include "options/options.h"
#include "tests/meshing/scratch_file.h"

namespace pellicle {
namespace {

using Objects = std::map<std::string, BlobOptions>;

BlobOptions ball(const Eigen::Vector3d& centre, double radius, double blend = 5e-3) {
  BlobOptions options;
  options.centre = centre;
  options.radius = radius;
  options.blend = blend;
  return options;
}

BlobOptions box(const Eigen::Vector3d& centre, const Eigen::Vector3d& size, double blend = 5e-3) {
  BlobOptions options = ball(centre, 1, blend);
  options.shape = "box";
  options.size = size;
  return options;
}

BlobOptions cut(BlobOptions options) {
  options.operation = "subtract";
  return options;
}

/// A closed mesh of one piece with as many points as asked, which needs no repair.
MeshReport report_of(SurfaceMesh mesh, int vertices, int genus) {
  MeshReport report = check_and_repair(mesh, "blobs");
  EXPECT_EQ(report.merged_points + report.removed_points + report.removed_faces + report.flipped_faces, 0);
  EXPECT_EQ(report.intersections.pairs, 0);
  EXPECT_EQ(report.components, 1);
  EXPECT_EQ(report.boundary_edges, 0);
  EXPECT_EQ(report.points, vertices);
  EXPECT_EQ(report.faces, 2 * vertices - 4 + 4 * genus);
  EXPECT_EQ(report.euler_characteristic(), 2 - 2 * genus);
  int regular = 0;
  for (const auto& [valence, count] : report.valence) {
    regular += valence >= 5 && valence <= 7 ? count : 0;
  }
  EXPECT_GT(regular, 0.98 * vertices);
  return report;
}

TEST(Blobs, AreWhatTheSolidsAreFarFromEachOther) {
  const Blobs blobs({{"left", ball({-1, 0, 0}, 0.3)}, {"right", box({1, 0, 0}, {0.4, 0.4, 0.4})}});
  EXPECT_NEAR(blobs({-1.4, 0, 0}), 0.1, 1e-12);
  EXPECT_NEAR(blobs({-1, 0.2, 0}), -0.1, 1e-12);
  EXPECT_NEAR(blobs({1, 0, 0.5}), 0.3, 1e-12);
}

TEST(Blobs, MeetInAFilletOfTheBlend) {
  // Two planes z = 0 and x = 0 of boxes: the fillet leaves their corner as far as a circle of radius `blend`.
  const double blend = 0.02;
  const Objects corner{{"floor", box({0, 0, -1}, {4, 4, 2}, blend)}, {"wall", box({-1, 0, 0}, {2, 4, 4}, blend)}};
  const double aside = (std::sqrt(2.0) - 1) * blend / std::sqrt(2.0);
  EXPECT_NEAR(Blobs(corner)({aside, 0, aside}), 0, 1e-12);
  const Blobs notch({{"block", box({0, 0, 0}, {4, 4, 4})}, {"groove", cut(box({2, 0, 2}, {2, 4, 2}, blend))}});
  EXPECT_NEAR(notch({1 - aside, 0, 2 - aside}), 0, 1e-12);  // the edge that is left is rounded likewise
}

TEST(Blobs, DoNotDependOnNames) {
  const BlobOptions one = ball({0, 0, 0}, 0.1, 0.02);
  const BlobOptions two = ball({0.1, 0, 0}, 0.08, 0.05);
  const BlobOptions three = box({0, 0.1, 0}, {0.1, 0.1, 0.1}, 0.01);
  const Blobs forward({{"a", one}, {"b", two}, {"c", three}});
  const Blobs backward({{"c", one}, {"b", two}, {"a", three}});
  for (const Eigen::Vector3d& point : {Eigen::Vector3d(0.05, 0.06, 0), Eigen::Vector3d(0.2, -0.1, 0.3)}) {
    EXPECT_NEAR(forward(point), backward(point), 1e-15);
  }
}

TEST(Blobs, ReliefHasItsHeightAndNumberOfWaves) {
  BlobOptions column;
  column.shape = "cylinder";
  column.end = {0, 0, 1};
  column.radius = 0.1;
  const auto value = [&column](double angle, double z) {
    return Blobs({{"it", column}})(Eigen::Vector3d(0.1 * std::cos(angle), 0.1 * std::sin(angle), z));
  };
  column.relief = 2e-3;
  column.pitch = 0.1;
  EXPECT_NEAR(value(0.3, 0.2), -2e-3, 1e-12);
  EXPECT_NEAR(value(0.3, 0.25), 2e-3, 1e-12);
  column.flutes = 6;
  EXPECT_NEAR(value(pi / 6, 0.2), -value(0, 0.2), 1e-12);
  EXPECT_NEAR(value(pi / 3, 0.2), value(0, 0.2), 1e-12);
  EXPECT_LT(value(0, 0.2), -1e-3);
}

TEST(BlobsMesh, OfABallIsAGoodSphere) {
  const int vertices = 1000;
  const SurfaceMesh mesh = blobs_mesh({{"ball", ball({0.1, 0.2, 0.3}, 0.05)}}, vertices);
  const MeshReport report = report_of(mesh, vertices, 0);
  for (const Eigen::Vector3d& point : mesh.points) {
    EXPECT_NEAR((point - Eigen::Vector3d(0.1, 0.2, 0.3)).norm(), 0.05, 1e-9);
  }
  EXPECT_GT(report.smallest_angle, 35 * pi / 180);
  EXPECT_NEAR(report.volume / (4 * pi / 3 * 1.25e-4), 1, 1e-2);
  // Texture coordinates: x to the right and z up, in the box round the ball.
  for (std::size_t f = 0; f < mesh.faces.size(); ++f) {
    const Eigen::Vector3d& point = mesh.points[mesh.faces[f][0]];
    EXPECT_NEAR(mesh.uv[f][0].x(), 0.5 + (point.x() - 0.1) / 0.1, 0.01);
    EXPECT_NEAR(mesh.uv[f][0].y(), 0.5 + (point.z() - 0.3) / 0.1, 0.01);
  }
}

TEST(BlobsMesh, IsTheSameEveryTime) {
  const Objects pear{{"a", ball({0, 0, 0}, 0.05)}, {"b", ball({0, 0, 0.05}, 0.03)}};
  const SurfaceMesh first = blobs_mesh(pear, 600);
  const SurfaceMesh second = blobs_mesh(pear, 600);
  EXPECT_EQ(first.points, second.points);
  EXPECT_EQ(first.faces, second.faces);
}

TEST(BlobsMesh, OfATorusHasGenusOne) {
  BlobOptions ring = ball({0, 0, 0}, 0.05);
  ring.shape = "torus";
  ring.tube_radius = 0.02;
  ring.rotation = {pi / 2, 0, 0};
  const MeshReport report = report_of(blobs_mesh({{"ring", ring}}, 1500), 1500, 1);
  EXPECT_GT(report.smallest_angle, 30 * pi / 180);
  EXPECT_NEAR(report.volume / (2 * pi * pi * 0.05 * 4e-4), 1, 2e-2);
}

struct DeckShape {
  const char* deck;
  int vertices;
  int genus;
};

/// The mesh options of a deck in input/.
MeshOptions options_of(const std::string& deck) {
  const std::string path = std::string(PELLICLE_SOURCE_DIR) + "/input/" + deck + ".yaml";
  YAML::Node mesh;
  mesh["mesh"] = YAML::LoadFile(path)["mesh"];
  MeshOptions options;
  OptionTable table;
  describe(table, options);
  std::vector<PetscOption> petsc;
  read_deck({path, YAML::Dump(mesh)}, table, petsc);
  return options;
}

class DeckShapesTest : public testing::TestWithParam<DeckShape> {};

/// The shapes of the balloon paper's Table 1, with its counts.
TEST_P(DeckShapesTest, HasTheCountsOfTable1) {
  int rank = 0;
  MPI_Comm_rank(MPI_COMM_WORLD, &rank);
  if (rank != 0) {
    return;  // nothing is collective, and one rank is enough
  }
  const auto [deck, vertices, genus] = GetParam();
  const MeshOptions options = options_of(deck);
  const CheckedMesh checked = make_checked_mesh(options);
  const MeshReport report = report_of(checked.mesh, vertices, genus);
  EXPECT_GT(report.smallest_angle, 28 * pi / 180);
  EXPECT_LT(report.longest_edge, 4 * report.shortest_edge);
  EXPECT_NEAR(report.volume, 5.2e-4, 1e-9);
}

INSTANTIATE_TEST_SUITE_P(Input, DeckShapesTest,
                         testing::Values(DeckShape{"teddy", 11090, 0}, DeckShape{"bird", 7849, 0},
                                         DeckShape{"holes", 5884, 3}, DeckShape{"vase", 14599, 0},
                                         DeckShape{"cube_cylinder", 15505, 0}),
                         [](const auto& shape) { return std::string(shape.param.deck); });

std::string message_for(const Objects& objects, int vertices = 500) {
  std::string message = message_of<Error>([&] { blobs_mesh(objects, vertices); });
  EXPECT_EQ(message.find('\n'), std::string::npos);
  return message;
}

TEST(BlobsMesh, BadObjectsAreErrorsInOneLine) {
  const BlobOptions good = ball({0, 0, 0}, 0.05);
  EXPECT_EQ(message_for({}), "mesh.blobs: no object that adds, expected at least one, such as {ball: {shape: sphere}}");
  EXPECT_EQ(message_for({{"hole", cut(good)}}), message_for({}));
  EXPECT_EQ(message_for({{"ball", good}, {"hole", cut(ball({0, 0, 0}, 0.1))}}),
            "mesh.blobs: nothing is left inside, expected solids that have a surface");
  EXPECT_EQ(message_for({{"ball", good}, {"hole", cut(ball({1, 0, 0}, 0.1))}}),
            "mesh.blobs.hole: there is nothing to subtract it from, expected a solid that cuts the others");

  BlobOptions bad = good;
  bad.shape = "capsule";
  bad.end = bad.centre;
  EXPECT_EQ(message_for({{"arm", bad}}), "mesh.blobs.arm.end: the same as centre, expected another point");
  bad.end = {0, 0, 0.01};
  bad.end_radius = 0.01;
  EXPECT_EQ(message_for({{"arm", bad}}),
            "mesh.blobs.arm.end_radius: 0.01 m given, expected one end that is not inside the other");
  bad.shape = "cylinder";
  bad.round = 0.02;
  EXPECT_EQ(message_for({{"rod", bad}}), "mesh.blobs.rod.round: 0.02 m given, expected at most half of its thickness");
  bad.shape = "torus";
  bad.tube_radius = 0.02;
  EXPECT_EQ(message_for({{"ring", bad}}, 6),  // the fewest points of a torus are 7
            "mesh.vertices: 6 are too few for mesh.blobs, expected more, or a larger blend and round");
  bad.tube_radius = 0.06;
  EXPECT_EQ(message_for({{"ring", bad}}), "mesh.blobs.ring.tube_radius: 0.06 m given, expected less than the radius");
}

TEST(BlobOptions, AreDeclared) {
  MeshOptions options;
  OptionTable table;
  describe(table, options);
  std::vector<PetscOption> petsc;
  const auto read = [&](const std::string& object) {
    read_deck({"deck.yaml", "mesh: {shape: blobs, blobs: {head: " + object + "}}"}, table, petsc);
  };
  read("{shape: capsule, centre: [1 cm, 0, 0], radius: 3 mm, end_radius: 2 mm, operation: subtract, blend: 1 mm}");
  const BlobOptions& head = options.blobs.at("head");
  EXPECT_EQ(head.shape, BlobShape::capsule);
  EXPECT_EQ(head.operation, BlobOperation::subtract);
  EXPECT_DOUBLE_EQ(head.centre.x(), 0.01);
  EXPECT_DOUBLE_EQ(head.radius, 3e-3);
  EXPECT_DOUBLE_EQ(head.end_radius.value(), 2e-3);
  EXPECT_DOUBLE_EQ(head.blend, 1e-3);
  for (const char* bad : {"{shape: ball}", "{blend: 0}", "{radius: -1}", "{colour: red}", "{size: [1, 0, 1]}"}) {
    EXPECT_THROW(read(bad), Error) << bad;
  }
}

}  // namespace
}  // namespace pellicle
