#include "io/frame_writer.h"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <vtkCellData.h>
#include <vtkDataArray.h>
#include <vtkDataSetAttributes.h>
#include <vtkIdList.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPolyData.h>
#include <vtkXMLPPolyDataReader.h>

#include <Eigen/Geometry>
#include <csignal>
#include <map>
#include <set>

#include "tests/io/files.h"
#include "tests/io/strip.h"
#include "tests/support/run_folder.h"

namespace pellicle {
namespace {

constexpr PetscInt cell_count = 10;

/// What the tests draw: formulas of the position and the persistent id.
struct Scene {
  explicit Scene(const Sheet& sheet)
      : surface(drawing_of(sheet, whole_surface(sheet))),
        springs(drawing_of_springs(sheet, ActiveSet(sheet))),
        positions(sheet.rest) {
    for (Eigen::Index i = 0; i < positions.cols(); ++i) {
      const double id = sheet.persistent_id[i];
      temperature.push_back(300 + id);
      velocity.insert(velocity.end(), {positions(0, i), 2 * positions(1, i), sheet.is_lattice[i] ? 99.0 : 0.0});
    }
    for (const Colour colour : all_colours) {
      for (PetscInt i = 0; i < sheet.of(colour).owned(); ++i) {
        strain.push_back(0.01 * (sheet.persistent_id[static_cast<std::size_t>(sheet.of(colour).ends[i][0])] + 1));
      }
    }
  }
  Frame frame(double time, int step) const {
    Frame frame;
    frame.time = time;
    frame.step = step;
    frame.surface = &surface;
    frame.positions = positions.data();
    frame.particle_fields = {{"temperature", 1, temperature.data()}, {"velocity", 3, velocity.data()}};
    frame.spring_fields = {{"strain", 1, strain.data()}};
    return frame;
  }

  Drawing surface;
  Drawing springs;
  Eigen::Matrix3Xd positions;
  std::vector<double> temperature;
  std::vector<double> velocity;
  std::vector<double> strain;
};

OutputOptions options_for(const std::string& directory) {
  OutputOptions options;
  options.directory = directory;
  options.name = "strip";
  return options;
}

/// A writer with a folder of its own.
class RunWriter : private RunFolder, public FrameWriter {
 public:
  explicit RunWriter(const OutputOptions& options) : RunFolder(options), FrameWriter(output, options) {}

  void write(const Frame& frame) {
    require_chosen_fields(field_names(frame));
    FrameWriter::write(0, frame);
    complete(frame.time, frame.step);
  }
};

vtkSmartPointer<vtkPolyData> read_frame(const std::string& path) {
  vtkNew<vtkXMLPPolyDataReader> reader;
  reader->SetFileName(path.c_str());
  reader->Update();
  return reader->GetOutput();
}

/// The strip as a membrane: two triangles a cell, 2 c and 2 c + 1 of cell c, and on a rank with cells a ghost besides.
Membrane make_triangle_strip(PetscInt cells, int empty) {
  const Sheet strip = make_strip(MPI_COMM_WORLD, cells, empty);
  Membrane membrane;
  static_cast<Surface&>(membrane) = strip;
  membrane.triangles_per_element = 1;
  membrane.triangles.clear();
  membrane.element_id.clear();
  for (std::size_t cell = 0; cell < strip.cells.size(); ++cell) {
    const auto& [a, b, c, d] = strip.cells[cell];
    const PetscInt id = strip.persistent_id[strip.lattice[cell]] - strip.first_lattice_id;
    membrane.triangles.insert(membrane.triangles.end(), {{a, b, c}, {a, c, d}});
    membrane.element_id.insert(membrane.element_id.end(), {2 * id, 2 * id + 1});
  }
  membrane.elements.comm = MPI_COMM_WORLD;
  membrane.elements.owned = static_cast<PetscInt>(membrane.triangles.size());
  membrane.elements.global = 2 * cells;
  if (membrane.elements.owned > 0) {
    membrane.triangles.push_back(membrane.triangles.front());
    membrane.element_id.push_back(-1);
    membrane.elements.ghost_global.push_back(0);
  }
  return membrane;
}

class FrameWriterOnRanks : public testing::TestWithParam<int> {};

// Parameter: the rank without cells.
TEST_P(FrameWriterOnRanks, DrawsEachCellAndCountsEachPointOnce) {
  const TestFolder folder;
  int ranks = 1;
  MPI_Comm_size(MPI_COMM_WORLD, &ranks);
  const Sheet sheet = make_strip(MPI_COMM_WORLD, cell_count, GetParam());
  const Scene scene(sheet);
  RunWriter(options_for(folder / "out")).write(scene.frame(0, 0));
  if (folder.rank() != 0) {
    return;
  }
  const auto drawn = read_frame(folder / "out/strip_000000.pvtp");
  ASSERT_EQ(drawn->GetNumberOfCells(), 4 * cell_count);
  vtkDataArray* ids = drawn->GetPointData()->GetArray("vertex_id");
  vtkDataArray* ghost = drawn->GetPointData()->GetArray("vtkGhostType");
  vtkDataArray* temperature = drawn->GetPointData()->GetArray("temperature");
  vtkDataArray* velocity = drawn->GetPointData()->GetArray("velocity");
  vtkDataArray* uv = drawn->GetPointData()->GetTCoords();
  ASSERT_TRUE(ids && ghost && temperature && velocity && uv);
  // ParaView's writer of PLY crashes on another type.
  EXPECT_STREQ(uv->GetName(), "TCoords");
  EXPECT_EQ(uv->GetDataType(), VTK_FLOAT);
  std::multiset<long> counted;
  for (vtkIdType point = 0; point < drawn->GetNumberOfPoints(); ++point) {
    const long id = static_cast<long>(ids->GetComponent(point, 0));
    const bool centre = id >= sheet.first_lattice_id;
    const double x =
        centre ? static_cast<double>(id - sheet.first_lattice_id) + 0.5 : static_cast<double>(id - id % 2) / 2;
    const double y = centre ? 0.5 : static_cast<double>(id % 2);
    EXPECT_DOUBLE_EQ(drawn->GetPoint(point)[0], x);
    EXPECT_DOUBLE_EQ(drawn->GetPoint(point)[1], y);
    EXPECT_DOUBLE_EQ(drawn->GetPoint(point)[2], 0)
        << "a virtual centre lies between the corners, not at the lattice point";
    EXPECT_DOUBLE_EQ(temperature->GetComponent(point, 0), centre ? 300 + 2 * x + 0.5 : 300.0 + static_cast<double>(id))
        << "a virtual centre has the mean of its corners";
    EXPECT_DOUBLE_EQ(velocity->GetComponent(point, 0), x);
    EXPECT_DOUBLE_EQ(velocity->GetComponent(point, 1), 2 * y);
    EXPECT_DOUBLE_EQ(velocity->GetComponent(point, 2), 0);
    EXPECT_FLOAT_EQ(static_cast<float>(uv->GetComponent(point, 0)), static_cast<float>(x / cell_count));
    EXPECT_DOUBLE_EQ(uv->GetComponent(point, 1), y);
    if (ghost->GetComponent(point, 0) == 0) {
      counted.insert(id);
    } else {
      EXPECT_EQ(ghost->GetComponent(point, 0), vtkDataSetAttributes::DUPLICATEPOINT);
    }
  }
  std::multiset<long> every_point_once;
  for (long id = 0; id < sheet.first_lattice_id + cell_count; ++id) {
    every_point_once.insert(id);
  }
  EXPECT_EQ(counted, every_point_once);

  vtkDataArray* rank = drawn->GetCellData()->GetArray("rank");
  vtkDataArray* cell_id = drawn->GetCellData()->GetArray("cell_id");
  ASSERT_TRUE(rank && cell_id);
  std::map<long, double> area;
  std::set<int> drawing_ranks;
  vtkNew<vtkIdList> corners;
  for (vtkIdType cell = 0; cell < drawn->GetNumberOfCells(); ++cell) {
    drawn->GetCellPoints(cell, corners);
    ASSERT_EQ(corners->GetNumberOfIds(), 3);
    Eigen::Matrix3d triangle;
    for (int i = 0; i < 3; ++i) {
      triangle.col(i) = Eigen::Map<const Eigen::Vector3d>(drawn->GetPoint(corners->GetId(i)));
    }
    // The signed area: a triangle that faces down would count negative.
    const Eigen::Vector3d normal = (triangle.col(1) - triangle.col(0)).cross(triangle.col(2) - triangle.col(0));
    area[static_cast<long>(cell_id->GetComponent(cell, 0))] += normal.z() / 2;
    drawing_ranks.insert(static_cast<int>(rank->GetComponent(cell, 0)));
  }
  ASSERT_EQ(area.size(), static_cast<std::size_t>(cell_count));
  for (const auto& [id, sum] : area) {
    EXPECT_NEAR(sum, 1, 1e-12) << "cell " << id;
  }
  EXPECT_EQ(drawing_ranks.size(),
            static_cast<std::size_t>(ranks > 1 && GetParam() >= 0 && GetParam() < ranks ? ranks - 1 : ranks));
  EXPECT_EQ(drawing_ranks.count(GetParam()), ranks > 1 ? 0U : drawing_ranks.count(GetParam()));
}

TEST_P(FrameWriterOnRanks, DrawsTheTrianglesOfAMembrane) {
  const TestFolder folder;
  const Membrane membrane = make_triangle_strip(cell_count, GetParam());
  std::vector<double> height;  // of the particles
  for (const PetscInt id : membrane.persistent_id) {
    height.push_back(100.0 + id);
  }
  std::vector<double> stress;  // of the elements
  for (const PetscInt id : membrane.element_id) {
    stress.insert(stress.end(), {1.0 * id, 2.0 * id});
  }
  Frame frame;
  const Drawing surface = drawing_of(membrane, whole_surface(membrane));
  frame.surface = &surface;
  frame.positions = membrane.rest.data();
  frame.particle_fields = {{"height", 1, height.data()}};
  frame.cell_fields = {{"stress", 2, stress.data()}};
  RunWriter(options_for(folder / "out")).write(frame);
  if (folder.rank() != 0) {
    return;
  }
  const auto drawn = read_frame(folder / "out/strip_000000.pvtp");
  ASSERT_EQ(drawn->GetNumberOfCells(), 2 * cell_count);
  vtkDataArray* ids = drawn->GetPointData()->GetArray("vertex_id");
  vtkDataArray* ghost = drawn->GetPointData()->GetArray("vtkGhostType");
  vtkDataArray* drawn_height = drawn->GetPointData()->GetArray("height");
  vtkDataArray* uv = drawn->GetPointData()->GetTCoords();
  ASSERT_TRUE(ids && ghost && drawn_height && uv);
  EXPECT_EQ(uv->GetDataType(), VTK_FLOAT);
  std::multiset<long> counted;
  for (vtkIdType point = 0; point < drawn->GetNumberOfPoints(); ++point) {
    const long id = static_cast<long>(ids->GetComponent(point, 0));
    const long column = id / 2;
    EXPECT_DOUBLE_EQ(drawn->GetPoint(point)[0], static_cast<double>(column));
    EXPECT_DOUBLE_EQ(drawn->GetPoint(point)[1], static_cast<double>(id % 2));
    EXPECT_DOUBLE_EQ(drawn_height->GetComponent(point, 0), 100.0 + static_cast<double>(id));
    EXPECT_FLOAT_EQ(static_cast<float>(uv->GetComponent(point, 0)), static_cast<float>(column) / cell_count);
    if (ghost->GetComponent(point, 0) == 0) {
      counted.insert(id);
    }
  }
  std::multiset<long> every_vertex_once;
  for (long id = 0; id < 2 * (cell_count + 1); ++id) {
    every_vertex_once.insert(id);
  }
  EXPECT_EQ(counted, every_vertex_once);

  vtkDataArray* rank = drawn->GetCellData()->GetArray("rank");
  vtkDataArray* cell_id = drawn->GetCellData()->GetArray("cell_id");
  vtkDataArray* drawn_stress = drawn->GetCellData()->GetArray("stress");
  ASSERT_TRUE(rank && cell_id && drawn_stress);
  std::set<long> drawn_ids;
  vtkNew<vtkIdList> corners;
  for (vtkIdType cell = 0; cell < drawn->GetNumberOfCells(); ++cell) {
    const long id = static_cast<long>(cell_id->GetComponent(cell, 0));
    drawn_ids.insert(id);
    EXPECT_DOUBLE_EQ(drawn_stress->GetComponent(cell, 0), static_cast<double>(id));
    EXPECT_DOUBLE_EQ(drawn_stress->GetComponent(cell, 1), 2 * static_cast<double>(id));
    drawn->GetCellPoints(cell, corners);
    std::vector<long> round;
    for (vtkIdType i = 0; i < corners->GetNumberOfIds(); ++i) {
      round.push_back(static_cast<long>(ids->GetComponent(corners->GetId(i), 0)));
    }
    const long first = id - id % 2;  // vertex of the strip's cell
    EXPECT_EQ(round, id % 2 == 0 ? (std::vector<long>{first, first + 2, first + 3})
                                 : (std::vector<long>{first, first + 3, first + 1}));
  }
  EXPECT_EQ(drawn_ids.size(), static_cast<std::size_t>(2 * cell_count)) << "each owned element once, no ghosts";
}

INSTANTIATE_TEST_SUITE_P(EmptyRank, FrameWriterOnRanks, testing::Values(-1, 0, 1));

TEST(FrameWriter, PvdNamesEveryFrameAndItsTime) {
  const TestFolder folder;
  const Sheet sheet = make_strip(MPI_COMM_WORLD, cell_count);
  Scene scene(sheet);
  RunWriter writer(options_for(folder / "deep/out"));
  writer.write(scene.frame(0, 0));
  const std::string first = folder.rank() == 0 ? file_text(folder / "deep/out/strip.pvd") : "";
  scene.positions.row(2).setConstant(0.25);
  writer.write(scene.frame(0.1, 7));
  if (folder.rank() != 0) {
    return;
  }
  EXPECT_NE(first.find("<DataSet timestep=\"0\" part=\"0\" file=\"strip_000000.pvtp\"/>"), std::string::npos);
  EXPECT_NE(first.find("</VTKFile>"), std::string::npos) << "complete after one frame";
  const std::string both = file_text(folder / "deep/out/strip.pvd");
  EXPECT_NE(both.find("timestep=\"0.10000000000000001\" part=\"0\" file=\"strip_000001.pvtp\""), std::string::npos);
  EXPECT_TRUE(std::filesystem::is_empty(folder / "deep/out/run.part"));
  EXPECT_DOUBLE_EQ(read_frame(folder / "deep/out/strip_000000.pvtp")->GetPoint(0)[2], 0);
  EXPECT_DOUBLE_EQ(read_frame(folder / "deep/out/strip_000001.pvtp")->GetPoint(0)[2], 0.25);
}

TEST(FrameWriter, PiecesAreCompressedWithLz4) {
  const TestFolder folder;
  const PetscInt cells = 4000;
  const Sheet sheet = make_strip(MPI_COMM_WORLD, cells);
  Scene scene(sheet);
  RunWriter(options_for(folder / "out")).write(scene.frame(0, 0));
  if (folder.rank() != 0) {
    return;
  }
  const std::string piece = folder / "out/strip_000000/strip_000000_0.vtp";
  EXPECT_NE(file_text(piece).substr(0, 400).find("compressor=\"vtkLZ4DataCompressor\""), std::string::npos);
  EXPECT_NE(file_text(piece).find("<AppendedData>"), std::string::npos);
  std::uintmax_t size = 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder / "out/strip_000000")) {
    size += entry.file_size();
  }
  // A point has 3 + 1 + 3 + 2 doubles, an id and a mark; a triangle three ids, an offset, a rank and an id.
  const double raw = 3.0 * cells * (9 * 8 + 8 + 1) + 4.0 * cells * (4 * 8 + 4 + 8);
  EXPECT_LT(static_cast<double>(size), 0.7 * raw);
}

TEST(FrameWriter, WritesTheChosenFieldsOnly) {
  const TestFolder folder;
  const Sheet sheet = make_strip(MPI_COMM_WORLD, cell_count);
  const Scene scene(sheet);
  OutputOptions options = options_for(folder / "out");
  options.fields = {"velocity"};
  RunWriter(options).write(scene.frame(0, 0));
  if (folder.rank() != 0) {
    return;
  }
  const auto drawn = read_frame(folder / "out/strip_000000.pvtp");
  EXPECT_NE(drawn->GetPointData()->GetArray("velocity"), nullptr);
  EXPECT_NE(drawn->GetPointData()->GetArray("vertex_id"), nullptr);
  EXPECT_EQ(drawn->GetPointData()->GetArray("temperature"), nullptr);
}

TEST(FrameWriter, CellFieldsOfASheetAreThoseOfTheTriangles) {
  const TestFolder folder;
  const Sheet sheet = make_strip(MPI_COMM_WORLD, cell_count);
  const Scene scene(sheet);
  std::vector<double> id;
  std::vector<double> other(sheet.cells.size());
  for (const PetscInt lattice : sheet.lattice) {
    id.push_back(sheet.persistent_id[lattice] - sheet.first_lattice_id);
  }
  Frame frame = scene.frame(0, 0);
  frame.cell_fields = {{"id", 1, id.data()}, {"other", 1, other.data()}};
  OutputOptions options = options_for(folder / "out");
  options.fields = {"id", "temperature"};
  RunWriter(options).write(frame);
  if (folder.rank() != 0) {
    return;
  }
  const auto drawn = read_frame(folder / "out/strip_000000.pvtp");
  EXPECT_NE(drawn->GetPointData()->GetArray("temperature"), nullptr);
  EXPECT_EQ(drawn->GetPointData()->GetArray("velocity"), nullptr);
  EXPECT_EQ(drawn->GetCellData()->GetArray("other"), nullptr);
  vtkDataArray* drawn_id = drawn->GetCellData()->GetArray("id");
  vtkDataArray* cell_id = drawn->GetCellData()->GetArray("cell_id");
  ASSERT_TRUE(drawn_id && cell_id);
  for (vtkIdType cell = 0; cell < drawn->GetNumberOfCells(); ++cell) {
    EXPECT_EQ(drawn_id->GetComponent(cell, 0), cell_id->GetComponent(cell, 0));
  }
}

TEST(FrameWriter, RefusesAnUnknownFieldBeforeWritingAnything) {
  const TestFolder folder;
  const Sheet sheet = make_strip(MPI_COMM_WORLD, cell_count);
  const Scene scene(sheet);
  OutputOptions options = options_for(folder / "out");
  options.fields = {"temprature"};
  RunWriter writer(options);
  EXPECT_EQ(error_text([&] { writer.write(scene.frame(0, 0)); }),
            "output.fields: no field 'temprature' in this run: expected some of temperature, velocity");
  EXPECT_FALSE(std::filesystem::exists(folder / "out"));
}

TEST(FrameWriter, WritesOwnedSpringsAsLines) {
  const TestFolder folder;
  const Sheet sheet = make_strip(MPI_COMM_WORLD, cell_count, 1);
  const Scene scene(sheet);
  Frame frame = scene.frame(0.5, 1);
  frame.springs = &scene.springs;
  frame.spring_ends = frame.particle_fields;
  RunWriter(options_for(folder / "out")).write(frame);
  if (folder.rank() != 0) {
    return;
  }
  EXPECT_NE(file_text(folder / "out/strip_springs.pvd")
                .find("timestep=\"0.5\" part=\"0\" file=\"strip_springs_000000.pvtp\""),
            std::string::npos);
  const auto drawn = read_frame(folder / "out/strip_springs_000000.pvtp");
  ASSERT_EQ(drawn->GetNumberOfLines(), 2 * cell_count);
  vtkDataArray* ids = drawn->GetPointData()->GetArray("vertex_id");
  vtkDataArray* colour = drawn->GetCellData()->GetArray("colour");
  vtkDataArray* strain = drawn->GetCellData()->GetArray("strain");
  vtkDataArray* temperature = drawn->GetPointData()->GetArray("temperature");
  ASSERT_TRUE(ids && colour && strain && temperature);
  std::set<std::pair<int, long>> lines;  // colour and first end
  vtkNew<vtkIdList> ends;
  for (vtkIdType line = 0; line < drawn->GetNumberOfCells(); ++line) {
    drawn->GetCellPoints(line, ends);
    const long id = static_cast<long>(ids->GetComponent(ends->GetId(0), 0));
    EXPECT_DOUBLE_EQ(temperature->GetComponent(ends->GetId(1), 0), 300 + ids->GetComponent(ends->GetId(1), 0));
    const auto colour_of_line = static_cast<Colour>(static_cast<int>(colour->GetComponent(line, 0)));
    lines.emplace(static_cast<int>(colour_of_line), id);
    EXPECT_DOUBLE_EQ(strain->GetComponent(line, 0), 0.01 * static_cast<double>(id + 1));
    // Red ends at the lattice point itself, blue at the next corner along x.
    const double* end = drawn->GetPoint(ends->GetId(1));
    EXPECT_DOUBLE_EQ(end[2], colour_of_line == Colour::red ? 0.1 : 0);
    EXPECT_DOUBLE_EQ(end[0], static_cast<double>(id - id % 2) / 2 + (colour_of_line == Colour::red ? 0.5 : 1));
  }
  EXPECT_EQ(lines.size(), 2U * cell_count);
}

TEST(FrameWriter, DrawsLivingSpringsOnly) {
  const TestFolder folder;
  const Sheet sheet = make_strip(MPI_COMM_WORLD, cell_count, 1);
  Scene scene(sheet);
  ActiveSet active(sheet);
  for (PetscInt i = 0; i < sheet.of(Colour::red).owned(); ++i) {
    const auto cell = sheet.persistent_id[sheet.lattice[i]] - sheet.first_lattice_id;
    active.springs[static_cast<std::size_t>(Colour::red)][i] = cell % 3 == 0;
  }
  scene.springs = drawing_of_springs(sheet, active);
  Frame frame = scene.frame(0, 0);
  frame.springs = &scene.springs;
  RunWriter(options_for(folder / "out")).write(frame);
  if (folder.rank() != 0) {
    return;
  }
  const auto drawn = read_frame(folder / "out/strip_springs_000000.pvtp");
  ASSERT_EQ(drawn->GetNumberOfLines(), 4 + cell_count) << "red springs of cells 0, 3, 6 and 9, and all blue ones";
  vtkNew<vtkIdList> ends;
  for (vtkIdType line = 0; line < drawn->GetNumberOfCells(); ++line) {
    drawn->GetCellPoints(line, ends);
    EXPECT_DOUBLE_EQ(drawn->GetCellData()->GetArray("strain")->GetComponent(line, 0),
                     0.01 * (drawn->GetPointData()->GetArray("vertex_id")->GetComponent(ends->GetId(0), 0) + 1));
  }
}

// A point that is cut: a quarter of the way from corner 0 to the virtual centre of cell 0.
TEST(FrameWriter, CutPointHasTheWeightedMean) {
  const TestFolder folder;
  const Sheet sheet = make_strip(MPI_COMM_WORLD, cell_count);
  Scene scene(sheet);
  DrawnSurface surface;
  if (folder.rank() == 0) {
    DrawnPoint cut;
    cut.particles = sheet.cells[0];
    cut.weights = {0.8125, 0.0625, 0.0625, 0.0625};
    cut.id = -7;
    cut.lattice = sheet.lattice[0];
    cut.centre_share = 0.25;
    surface.points.assign(3, cut);
    surface.triangles.push_back({0, 1, 2});
    surface.elements.push_back(0);
  }
  Sheet seam = sheet;
  if (folder.rank() == 0) {  // Corner 0 lies beyond a seam, the centre on this side.
    seam.uv.col(sheet.cells[0][0]) << 4, 8;
    seam.uv.col(sheet.lattice[0]) << 16, 32;
  }
  scene.surface = drawing_of(seam, surface);
  RunWriter(options_for(folder / "out")).write(scene.frame(0, 0));
  if (folder.rank() != 0) {
    return;
  }
  const auto drawn = read_frame(folder / "out/strip_000000.pvtp");
  ASSERT_EQ(drawn->GetNumberOfPoints(), 3);
  EXPECT_EQ(drawn->GetPointData()->GetArray("vertex_id")->GetComponent(1, 0), -7);
  EXPECT_DOUBLE_EQ(drawn->GetPoint(1)[0], 0.125);
  EXPECT_DOUBLE_EQ(drawn->GetPoint(1)[1], 0.125);
  EXPECT_DOUBLE_EQ(drawn->GetPointData()->GetArray("temperature")->GetComponent(1, 0), 300 + 0.25 * 1.5);
  EXPECT_DOUBLE_EQ(drawn->GetPointData()->GetTCoords()->GetComponent(1, 0), 0.75 * 4 + 0.25 * 16);
  EXPECT_DOUBLE_EQ(drawn->GetPointData()->GetTCoords()->GetComponent(1, 1), 0.75 * 8 + 0.25 * 32);
}

TEST(FrameWriter, NothingLeftIsAFrameToo) {
  const TestFolder folder;
  const Sheet sheet = make_strip(MPI_COMM_WORLD, cell_count);
  Scene scene(sheet);
  RunWriter writer(options_for(folder / "out"));
  writer.write(scene.frame(0, 0));
  scene.surface = drawing_of(sheet, DrawnSurface());
  writer.write(scene.frame(0.5, 1));
  if (folder.rank() != 0) {
    return;
  }
  EXPECT_NE(file_text(folder / "out/strip.pvd").find("file=\"strip_000001.pvtp\""), std::string::npos);
  const auto drawn = read_frame(folder / "out/strip_000001.pvtp");
  EXPECT_EQ(drawn->GetNumberOfPoints(), 0);
  EXPECT_EQ(drawn->GetNumberOfCells(), 0);
  EXPECT_NE(file_text(folder / "out/strip_000001.pvtp").find("Name=\"temperature\""), std::string::npos)
      << "a reader still finds the names of the fields";
}

TEST(FrameWriter, NamesMayHaveDotsBlanksAndPercentSigns) {
  const TestFolder folder;
  const Sheet sheet = make_strip(MPI_COMM_WORLD, cell_count);
  const Scene scene(sheet);
  const auto points_of = [&folder](const std::string& name, const std::string& frame) {
    return read_frame(folder / (name + "/" + name + frame + ".pvtp"))->GetNumberOfPoints();
  };
  for (const std::string& name : {std::string("plain"), std::string("h0.25"), std::string("a..b.c."),
                                  std::string("50 %d of gr\xC3\xB6\xC3\x9F"
                                              "e.pvtp")}) {
    OutputOptions options = options_for(folder / name);
    options.name = name;
    RunFolder run(options);
    FrameWriter writer(run.output, options, {{"cloth", "objects.cloth"}}, {{"ball", "bodies.ball"}});
    Frame frame = scene.frame(0, 0);
    frame.springs = &scene.springs;
    writer.write(0, frame);
    writer.write_body(0, {Sphere{1}, {}}, 0);
    writer.complete(0, 0);
    FrameWriter failed = writer.of_failed_state();
    failed.write(0, frame);
    failed.complete(0, 0);
    if (folder.rank() == 0) {
      for (const char* of : {"_cloth_000000", "_springs_cloth_000000", "_bodies_ball_000000", "_failed_cloth_000000",
                             "_failed_springs_cloth_000000"}) {
        EXPECT_GT(points_of(name, of), 0) << name << of;
        EXPECT_EQ(points_of(name, of), points_of("plain", of)) << name << of;
      }
      EXPECT_TRUE(std::filesystem::is_empty(folder / (name + "/run.part"))) << name;
    }
  }
}

TEST(FrameWriter, ReplacesTheFramesOfAnOlderRunAndNothingElse) {
  const TestFolder folder;
  const Sheet sheet = make_strip(MPI_COMM_WORLD, cell_count);
  const Scene scene(sheet);
  const OutputOptions options = options_for(folder / "out");
  {
    RunWriter older(options);
    Frame frame = scene.frame(0, 0);
    frame.springs = &scene.springs;
    older.write(frame);
    frame.step = 1;
    older.write(frame);
  }
  if (folder.rank() == 0) {
    write_file(folder / "out/strip_000001.png", "a picture");
    write_file(folder / "out/strip2_000001.pvtp", "another run's");
    write_file(folder / "out/strip_000001/note.txt", "not ours");
    std::filesystem::create_directories(folder / "out/strip_000007");
    write_file(folder / "out/strip_000007/mine.vtp", "not ours");
  }
  MPI_Barrier(MPI_COMM_WORLD);
  RunWriter newer(options);
  EXPECT_TRUE(std::filesystem::exists(folder / "out/strip_000001.pvtp")) << "a writer alone removes nothing";
  MPI_Barrier(MPI_COMM_WORLD);
  newer.write(scene.frame(0, 0));
  if (folder.rank() != 0) {
    return;
  }
  std::set<std::string> files;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder / "out")) {
    files.insert(entry.path().filename().string());
  }
  EXPECT_EQ(files.count("strip_000000.pvtp"), 1U);
  EXPECT_EQ(files.count("strip_000001.pvtp") + files.count("strip_000001_0.vtp"), 0U);
  EXPECT_EQ(files.count("strip_springs.pvd") + files.count("strip_springs_000000.pvtp"), 0U);
  EXPECT_EQ(files.count("strip_springs_000000"), 0U) << "an emptied folder goes";
  EXPECT_EQ(files.count("strip_000001.png") + files.count("strip2_000001.pvtp") + files.count("note.txt") +
                files.count("mine.vtp"),
            4U);
}

TEST(FrameWriter, FramesAreDueByStepsOrByTime) {
  const TestFolder folder;
  const Sheet sheet = make_strip(MPI_COMM_WORLD, cell_count);
  const Scene scene(sheet);
  const auto steps_drawn = [&](const OutputOptions& options) {
    RunWriter writer(options);
    std::vector<int> drawn;
    for (int step = 0; step <= 10; ++step) {
      if (writer.due(0.1 * step, step)) {
        writer.write(scene.frame(0.1 * step, step));
        drawn.push_back(step);
      }
    }
    return drawn;
  };
  OutputOptions options = options_for(folder / "out");
  options.interval_steps = 4;
  EXPECT_EQ(steps_drawn(options), (std::vector<int>{0, 4, 8}));
  options.interval_time = 0.3;  // 0.1 * 3 is a little more than 0.3, 0.1 * 6 and 0.1 * 9 are not.
  EXPECT_EQ(steps_drawn(options), (std::vector<int>{0, 3, 6, 9}));
  options.interval_time = 0.25;
  EXPECT_EQ(steps_drawn(options), (std::vector<int>{0, 3, 5, 8, 10}));
  options.interval_time = 0.01;
  EXPECT_EQ(steps_drawn(options).size(), 11U);
}

TEST(FrameWriter, TellsTheTimeOfTheNextFrame) {
  OutputOptions options = options_for("unused");
  EXPECT_EQ(RunWriter(options).next_time(0.3), std::nullopt) << "frames by steps";
  options.interval_time = 0.1;
  const RunWriter writer(options);
  EXPECT_DOUBLE_EQ(*writer.next_time(0), 0.1);
  EXPECT_DOUBLE_EQ(*writer.next_time(0.25), 0.3);
  EXPECT_DOUBLE_EQ(*writer.next_time(0.1 * 3), 0.4) << "a little more than 0.3";
  EXPECT_DOUBLE_EQ(*writer.next_time(0.3), 0.4) << "a little less than three times 0.1";
}

TEST(FrameWriter, DirectoryThatCannotBeMadeIsOneErrorOnAllRanks) {
  const TestFolder folder;
  const Sheet sheet = make_strip(MPI_COMM_WORLD, cell_count);
  const Scene scene(sheet);
  if (folder.rank() == 0) {
    write_file(folder / "file", "in the way");
  }
  MPI_Barrier(MPI_COMM_WORLD);
  RunWriter writer(options_for(folder / "file/out"));
  EXPECT_EQ(error_text([&] { writer.write(scene.frame(0, 0)); }),
            "output.directory: " + (folder / "file/out") + " cannot be used: Not a directory");
}

TEST(FrameWriter, FailedWriteIsOneErrorOnAllRanks) {
  const TestFolder folder;
  const Sheet sheet = make_strip(MPI_COMM_WORLD, 4000);
  const Scene scene(sheet);
  RunWriter writer(options_for(folder / "out"));
  writer.write(scene.frame(0, 0));
  int ranks = 1;
  MPI_Comm_size(MPI_COMM_WORLD, &ranks);
  // The last rank may write no more than a kilobyte to a file: to VTK, a full disk.
  rlimit before{};
  getrlimit(RLIMIT_FSIZE, &before);
  if (folder.rank() == ranks - 1) {
    std::signal(SIGXFSZ, SIG_IGN);
    rlimit small = before;
    small.rlim_cur = 1024;
    setrlimit(RLIMIT_FSIZE, &small);
  }
  const std::string message = error_text([&] { writer.write(scene.frame(0.1, 1)); });
  setrlimit(RLIMIT_FSIZE, &before);
  EXPECT_EQ(message.find((folder / "out/strip_000001.pvtp") + ": cannot be written: "), 0U) << message;
  EXPECT_EQ(message.find('\n'), std::string::npos);
  if (folder.rank() == 0) {
    EXPECT_EQ(file_text(folder / "out/strip.pvd").find("strip_000001"), std::string::npos);
  }
}

TEST(OutputOptions, NamesFollowTheDeck) {
  OutputOptions options;
  options.name_after("input/roof.yaml");
  EXPECT_EQ(options.name, "roof");
  EXPECT_EQ(options.directory, "output/roof");
  OutputOptions given;
  given.name = "a";
  given.directory = "b";
  given.name_after("input/roof.yaml");
  EXPECT_EQ(given.name + given.directory, "ab");
  given.name = "a/b";
  EXPECT_EQ(error_text([&] { given.validate(); }),
            "output.name: 'a/b' cannot be the name of a file: expected letters, digits, '_', '-' or '.'");
  for (const std::string& name :
       {std::string(".."), std::string("."), std::string("a\nb"), std::string("a\x7F"), std::string("-a"),
        std::string(" "), std::string("a "), std::string("a\\b"), std::string("a&b"), std::string("\xC3"),
        std::string("\xFF"), std::string(201, 'a')}) {
    given.name = name;
    EXPECT_EQ(error_text([&] { given.validate(); }).find("output.name: '"), 0U) << name;
  }
  for (const std::string& name : {std::string("hot ball_2.1"), std::string("gr\xC3\xB6\xC3\x9F"
                                                                           "e")}) {
    given.name = name;
    EXPECT_EQ(error_text([&] { given.validate(); }), "no Error") << name;
  }
  given.directory = "a\nb";
  EXPECT_EQ(error_text([&] { given.validate(); }).find("output.directory: 'a\\x0Ab'"), 0U);
}

}  // namespace
}  // namespace pellicle
