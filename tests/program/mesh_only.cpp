// -mesh_only: a mesh is read or generated, checked, described and written.

#include <fmt/format.h>
#include <vtkIdList.h>

#include <Eigen/Geometry>
#include <cmath>
#include <numeric>

#include "tests/support/frames.h"
#include "tests/support/program.h"
#include "tests/support/shared_folder.h"

namespace pellicle {
namespace {

class MeshOnlyTest : public ProgramTest {
 protected:
  /// Runs with -mesh_only and expects the words in what it prints. @returns the frame.
  vtkSmartPointer<vtkPolyData> write_mesh(int ranks, const Arguments& options, const std::vector<std::string>& words) {
    const CommandResult told =
        succeed(ranks, Arguments{"-mesh_only", "-output_directory", "out", "-output_name", "mesh"} + options);
    EXPECT_EQ(told.errors, "") << told;
    for (const std::string& word : words) {
      EXPECT_NE(told.output.find(word), std::string::npos) << word << " is not in:\n" << told;
    }
    EXPECT_NE(told.output.find("\nranks: " + std::to_string(ranks) + "; partition: edge cut "), std::string::npos)
        << told;
    const auto frames = read_pvd(folder() / "out" / "mesh.pvd");
    EXPECT_EQ(frames.size(), 1U);
    drawn_ranks_ = read_frame(frames[0].first, frames[0].second).ranks;
    return read_pvtp(frames[0].second);
  }

  vtkSmartPointer<vtkPolyData> last_frame(const std::string& output) const {
    return read_pvtp(read_pvd(folder() / output / "run.pvd").back().second);
  }

  static std::vector<double> cell_values(vtkPolyData* mesh, const char* name) {
    vtkDataArray* array = mesh->GetCellData()->GetArray(name);
    EXPECT_NE(array, nullptr) << name;
    std::vector<double> values;
    for (vtkIdType cell = 0; array != nullptr && cell < mesh->GetNumberOfCells(); ++cell) {
      values.push_back(array->GetTuple1(cell));
    }
    return values;
  }

  static std::set<double> different(const std::vector<double>& values) { return {values.begin(), values.end()}; }

  std::set<int> drawn_ranks_;
};

TEST_F(MeshOnlyTest, GeneratedQuads) {
  for (const int ranks : {1, 3}) {
    const auto mesh = write_mesh(ranks, {"-mesh_cells", "8,4", "-mesh_size", "4,1"},
                                 {"45 points", "32 quads", "quality: ", "scaled_jacobian mean 1, smallest 1"});
    EXPECT_EQ(mesh->GetNumberOfCells(), 4 * 32) << "four triangles a cell";
    EXPECT_EQ(different(cell_values(mesh, "cell_id")).size(), 32U);
    for (const double value : cell_values(mesh, "area")) {
      EXPECT_NEAR(value, 0.125, 1e-12) << "of the quad, not of the triangle";
    }
    for (const double value : cell_values(mesh, "smallest_angle")) {
      EXPECT_NEAR(value, 90, 1e-9);
    }
    EXPECT_EQ(drawn_ranks_.size(), static_cast<std::size_t>(ranks));
  }
}

// The worst cell is the first of the mesh, then the last, so that it is not on rank 0 both times.
TEST_F(MeshOnlyTest, TheQualityIsThatOfAllRanks) {
  for (const int short_side : {0, 12}) {  // of a row of 12 cells
    std::string mesh;
    for (int i = 0; i <= 12; ++i) {
      const double height = i == short_side ? 0.3 : 1;
      mesh += fmt::format("v {} 0 0\nv {} {} 0\n", i, i, height);
    }
    for (int i = 0; i < 12; ++i) {
      mesh += fmt::format("f {} {} {} {}\n", 2 * i + 1, 2 * i + 3, 2 * i + 4, 2 * i + 2);
    }
    write("row.obj", mesh);
    std::set<std::string> qualities;
    for (const int ranks : {1, 3}) {
      const std::string told =
          succeed(ranks, {"-mesh_only", "-output_directory", "out", "-mesh_file", (folder() / "row.obj").string()})
              .output;
      const std::size_t first = told.find("quality: ");
      ASSERT_NE(first, std::string::npos) << told;
      qualities.insert(told.substr(first, told.find('\n', first) - first));
    }
    EXPECT_EQ(qualities.size(), 1U) << *qualities.begin() << "\n" << *qualities.rbegin();
  }
}

TEST_F(MeshOnlyTest, OptionsOfSolversOfADeckAreNotWarnedOf) {
  write_mesh(1, {write("scene.yaml", "elastic: {pc_type: cholesky}\nmesh: {cells: [2, 2]}\n")}, {"4 quads"});
}

TEST_F(MeshOnlyTest, GeneratedTriangles) {
  for (const int ranks : {1, 3}) {
    const auto mesh =
        write_mesh(ranks, {"-mesh_shape", "icosphere", "-mesh_level", "3", "-mesh_radius", "0.1", "-chain", "inflate"},
                   {"642 points", "1280 triangles", "closed", "quality: radius_ratio mean 1.0"});
    ASSERT_EQ(mesh->GetNumberOfCells(), 1280);
    EXPECT_EQ(different(cell_values(mesh, "cell_id")).size(), 1280U);
    const std::vector<double> area = cell_values(mesh, "area");
    const double sum = std::accumulate(area.begin(), area.end(), 0.0);
    EXPECT_NEAR(sum, 4 * M_PI * 0.01, 0.01 * 4 * M_PI * 0.01);
    vtkNew<vtkIdList> corners;
    for (const vtkIdType cell : {vtkIdType{0}, vtkIdType{700}}) {
      mesh->GetCellPoints(cell, corners);
      Eigen::Matrix3d triangle;
      for (int i = 0; i < 3; ++i) {
        triangle.col(i) = Eigen::Map<const Eigen::Vector3d>(mesh->GetPoint(corners->GetId(i)));
      }
      const Eigen::Vector3d normal = (triangle.col(1) - triangle.col(0)).cross(triangle.col(2) - triangle.col(0));
      EXPECT_NEAR(area[cell], normal.norm() / 2, 1e-9);
      EXPECT_GT(normal.dot(triangle.rowwise().sum()), 0) << "outward";
    }
    for (const char* field : {"radius_ratio", "aspect_ratio"}) {
      for (const double value : cell_values(mesh, field)) {
        EXPECT_GE(value, 1 - 1e-9) << field;
        EXPECT_LT(value, 1.3) << field;
      }
    }
    EXPECT_EQ(drawn_ranks_.size(), static_cast<std::size_t>(ranks));
  }
}

TEST_F(MeshOnlyTest, QuadsOfTheInflatingChainAreSplit) {
  const auto mesh = write_mesh(2, {"-mesh_cells", "4,4", "-chain", "inflate"}, {"16 quads"});
  EXPECT_EQ(mesh->GetNumberOfCells(), 32);
}

// The file with the partition stands for the mesh: the same run, to the last digit on as many ranks.
TEST_F(MeshOnlyTest, ARunReadsTheMeshWithItsPartition) {
  const Arguments options{"-time_step", "2 ms", "-time_end", "6 ms", "-output_name", "run"};
  for (const Arguments& mesh : {Arguments{"-mesh_cells", "9,7"},
                                Arguments{"-mesh_shape", "icosphere", "-mesh_level", "2", "-chain", "inflate"}}) {
    const Arguments chain(mesh.begin() + (mesh.size() > 2 ? 4 : 2), mesh.end());
    write_mesh(3, mesh, {"mesh.mesh.h5"});
    succeed(3, mesh + options + Arguments{"-output_directory", "whole"});
    for (const int ranks : {3, 2}) {
      succeed(ranks, chain + options + Arguments{"-mesh_file", "out/mesh.mesh.h5", "-output_directory", "parts"});
      const std::vector<vtkSmartPointer<vtkPolyData>> frames{last_frame("whole"), last_frame("parts")};
      EXPECT_EQ(frames[0]->GetNumberOfCells(), frames[1]->GetNumberOfCells());
      if (ranks == 3) {
        ASSERT_EQ(frames[0]->GetNumberOfPoints(), frames[1]->GetNumberOfPoints());
        double point[3];
        for (vtkIdType i = 0; i < frames[0]->GetNumberOfPoints(); ++i) {
          frames[0]->GetPoint(i, point);
          EXPECT_EQ(Eigen::Vector3d(point), Eigen::Vector3d(frames[1]->GetPoint(i)));
        }
      }
    }
  }
}

TEST_F(MeshOnlyTest, ARunThatReadsTheMeshOfItsFolderLeavesItThere) {
  write_mesh(1, {"-mesh_cells", "4,4"}, {});
  const std::string before = text_of(folder() / "out" / "mesh.mesh.h5");
  succeed(1, {"-mesh_file", "out/mesh.mesh.h5", "-time_max_steps", "1", "-output_directory", "out", "-output_name",
              "mesh"});
  EXPECT_EQ(text_of(folder() / "out" / "mesh.mesh.h5"), before);
  EXPECT_FALSE(before.empty());
}

TEST_F(MeshOnlyTest, AMeshWithAPartitionMustFitTheRun) {
  write_mesh(2, {"-mesh_cells", "4,4"}, {});
  const Arguments file{"-mesh_file", "out/mesh.mesh.h5"};
  EXPECT_NE(pellicle(2, file + Arguments{"-chain", "inflate"}).errors.find("16 quads; expected triangles"),
            std::string::npos);
  write_mesh(2, {"-mesh_shape", "icosphere", "-mesh_level", "1", "-chain", "inflate"}, {});
  EXPECT_NE(pellicle(2, file).errors.find("80 triangles; a burning sheet needs quads"), std::string::npos);
  EXPECT_NE(pellicle(2, file + Arguments{"-mesh_scale", "2"}).errors.find("mesh_scale"), std::string::npos);
  write("no.h5", "this is no file of HDF5");
  EXPECT_NE(pellicle(2, {"-mesh_file", "no.h5"}).errors.find("no.h5: is no whole file of HDF5"), std::string::npos);
}

TEST_F(MeshOnlyTest, FieldsChosenForTheRunDoNotMatter) {
  const std::string deck =
      write("deck.yaml", "mesh: {cells: [4, 4]}\noutput: {fields: [temperature], springs: true}\n");
  const auto mesh = write_mesh(1, {deck}, {});
  EXPECT_NE(mesh->GetCellData()->GetArray("area"), nullptr);
  EXPECT_FALSE(std::filesystem::exists(folder() / "out" / "mesh_springs.pvd"));
}

TEST_F(MeshOnlyTest, RealMeshes) {
  const std::filesystem::path meshes = shared_folder() / "meshes";
  if (!std::filesystem::exists(meshes)) {
    GTEST_SKIP() << meshes << " is not there";
  }
  const auto mesh = write_mesh(3, {"-mesh_file", std::filesystem::canonical(meshes / "teddy.off").string()},
                               {"teddy.off: 12543 points", "25082 triangles", "closed"});
  EXPECT_EQ(mesh->GetNumberOfCells(), 25082);
  EXPECT_EQ(drawn_ranks_.size(), 3U);
}

TEST_F(MeshOnlyTest, AShellInsideAnotherIsSaidUnlessAChamberIsInsideAnother) {
  // Two octahedra, of which the smaller one is the second.
  const std::string faces =
      "f -6 -4 -2\nf -4 -5 -2\nf -5 -3 -2\nf -3 -6 -2\nf -4 -6 -1\nf -5 -4 -1\nf -3 -5 -1\nf -6 -3 -1\n";
  write("shells.obj", "v 2 0 0\nv -2 0 0\nv 0 2 0\nv 0 -2 0\nv 0 0 2\nv 0 0 -2\n" + faces +
                          "v 1 0 0\nv -1 0 0\nv 0 1 0\nv 0 -1 0\nv 0 0 1\nv 0 0 -1\n" + faces);
  const Arguments options{"-mesh_file", "shells.obj", "-chain", "inflate"};
  const std::string said =
      "warning: a closed piece (of vertex 6) lies inside another (of vertex 0): the volume is the sum";
  write_mesh(2, options, {"2 pieces, closed, encloses 12 m^3", said});
  const std::string deck = write("deck.yaml",
                                 "chambers:\n  outer: {law: isothermal, vertex: 0}\n"
                                 "  inner: {law: isothermal, vertex: 6, inside: outer}\n");
  const CommandResult result = succeed(1, Arguments{deck, "-mesh_only", "-output_directory", "named"} + options);
  EXPECT_EQ(result.output.find("lies inside"), std::string::npos) << result;
}

TEST_F(MeshOnlyTest, FaultyMeshesAreRefusedBeforeAnythingIsWritten) {
  // Two squares at one vertex.
  write("bow_tie.obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv -1 0 0\nv -1 -1 0\nv 0 -1 0\nf 1 2 3 4\nf 1 5 6 7\n");
  for (const int ranks : {1, 3}) {
    const CommandResult result = pellicle(ranks, {"-mesh_only", "-mesh_file", "bow_tie.obj"});
    EXPECT_EQ(result.exit_code, 1) << result;
    ASSERT_EQ(result.error_lines().size(), 1U) << result;
    EXPECT_NE(result.error_lines()[0].find("bow_tie.obj: 1 non-manifold vertex (0)"), std::string::npos) << result;
    EXPECT_FALSE(std::filesystem::exists(folder() / "output"));
  }
}

}  // namespace
}  // namespace pellicle
