// A sheet that burns away, falls into pieces and tears, as a user sees it: frames, history and console.

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numeric>
#include <regex>
#include <set>

#include "tests/support/burning_scene.h"
#include "tests/support/frames.h"
#include "tests/support/program.h"
#include "tests/support/tearing_scene.h"

namespace pellicle {
namespace {

// The scene: 20 x 20 cells of 5 cm on 1 m^2, 1 kg.
constexpr int cells = 20;                 ///< along each edge
constexpr long cut_id_stride = 1L << 31;  ///< of the ids of cut points
constexpr double step = 2e-3;             // [s]

/// The scene with a fire that takes a third of the sheet away, compacted time and again.
const Arguments fire = burning_away + Arguments{"-output_interval_steps", "4", "-ablation_compact_fraction", "0.05"};

/// A deck in which the whole sheet is hot.
const std::string hot_deck = R"(
mesh: {shape: rectangle, cells: [10, 10], size: [1 m, 1 m]}
sheet: {thickness: 5 cm, areal_density: 1 kg/m^2, perturbation: 0.01}
time: {step: 2 ms, end: 1 s}
heat: {initial_temperature: 900 K}
combustion: {mass_loss_rate: 0.1, mass_loss_texture: )" PELLICLE_SOURCE_DIR R"(/input/textures/clouds.png}
ablation: {loss_mass: 0.5}
output: {directory: out, name: scene, interval_steps: 5}
)";

/// A frame with all that its ranks wrote, points of several ranks as often as they drew them.
struct Surface {
  explicit Surface(const std::filesystem::path& path) : data(read_pvtp(path)) {
    vtkDataArray* const ids = data->GetPointData()->GetArray("vertex_id");
    for (vtkIdType point = 0; point < data->GetNumberOfPoints(); ++point) {
      vertex_id.push_back(std::lround(ids->GetTuple1(point)));
    }
    for (vtkIdType cell = 0; cell < data->GetNumberOfCells(); ++cell) {
      vtkIdType count = 0;
      const vtkIdType* points = nullptr;
      data->GetCellPoints(cell, count, points);
      if (count != 3) {
        throw std::runtime_error(path.string() + ": not a triangle");
      }
      triangles.push_back({points[0], points[1], points[2]});
    }
  }
  double value(const char* field, vtkIdType point, int component = 0) const {
    return data->GetPointData()->GetArray(field)->GetComponent(point, component);
  }
  double cell_value(const char* field, std::size_t cell) const {
    return data->GetCellData()->GetArray(field)->GetTuple1(static_cast<vtkIdType>(cell));
  }
  std::array<double, 2> uv(vtkIdType point) const { return {value("TCoords", point, 0), value("TCoords", point, 1)}; }

  vtkSmartPointer<vtkPolyData> data;
  std::vector<long> vertex_id;                      ///< of each point
  std::vector<std::array<vtkIdType, 3>> triangles;  ///< point numbers
};

/// Of texture coordinates, which frames have as float.
constexpr double uv_rounding = 1e-7;

/// Undeformed place of an uncut point of the scene as uv, from its id: corners row by row, then centres.
std::array<double, 2> uv_of(long id) {
  constexpr long corners = (cells + 1) * (cells + 1);
  if (id < corners) {
    const long row = id / (cells + 1);
    const long column = id % (cells + 1);
    return {static_cast<double>(column) / cells, static_cast<double>(row) / cells};
  }
  const long row = (id - corners) / cells;
  const long column = (id - corners) % cells;
  return {(static_cast<double>(column) + 0.5) / cells, (static_cast<double>(row) + 0.5) / cells};
}

class AblationTest : public ProgramTest {
 protected:
  CommandResult run(int ranks, const std::string& deck, const Arguments& options = {}) {
    return succeed(ranks, Arguments{write("scene.yaml", deck)} + options);
  }
  std::vector<std::pair<double, std::filesystem::path>> frames() const { return read_pvd(folder() / "out/scene.pvd"); }
  std::map<std::string, std::vector<double>> history() const { return read_csv(folder() / "out" / "history.csv"); }

  /// Expects that no mass and no heat is lost in any row.
  void expect_closed_balances() const {
    const auto table = history();
    const double mass = table.at("mass_left").front();
    const double heat = table.at("heat_content").front();
    for (std::size_t row = 0; row < table.at("step").size(); ++row) {
      EXPECT_NEAR(table.at("mass_left")[row] + table.at("mass_burnt")[row], mass, 1e-12 * mass) << row;
      EXPECT_NEAR(table.at("heat_content")[row], heat + table.at("heat_in")[row] - table.at("heat_out")[row],
                  1e-9 * table.at("heat_in")[row])
          << row;
    }
  }
};

TEST_F(AblationTest, TheDrawnSurfaceIsWatertight) {
  run(3, burning_scene, fire);
  long cut_edges = 0;
  for (const auto& [time, path] : frames()) {
    const Surface surface(path);
    std::map<long, vtkIdType> first;  // point of each id
    std::map<long, int> counted;      // how many ranks count it
    for (vtkIdType point = 0; point < surface.data->GetNumberOfPoints(); ++point) {
      const long id = surface.vertex_id[point];
      const vtkIdType same = first.try_emplace(id, point).first->second;
      for (int component = 0; component < 3; ++component) {
        EXPECT_EQ(surface.data->GetPoint(point)[component], surface.data->GetPoint(same)[component]) << id;
      }
      counted[id] += surface.value(vtkDataSetAttributes::GhostArrayName(), point) == 0 ? 1 : 0;
    }
    for (const auto& [id, count] : counted) {
      EXPECT_EQ(count, 1) << "point " << id << " at " << time << " s";
    }
    std::map<std::pair<long, long>, int> edges;  // in the direction of a triangle
    for (const auto& triangle : surface.triangles) {
      for (std::size_t k = 0; k < 3; ++k) {
        ++edges[{surface.vertex_id[triangle[k]], surface.vertex_id[triangle[(k + 1) % 3]]}];
      }
    }
    for (const auto& [edge, count] : edges) {
      EXPECT_EQ(count, 1) << "two triangles on the same side of " << edge.first << "," << edge.second;
      if (edges.count({edge.second, edge.first}) > 0) {
        continue;
      }
      const bool is_cut = edge.first < 0 && edge.second < 0;
      cut_edges += is_cut ? 1 : 0;
      const auto a = surface.uv(first.at(edge.first));
      const auto b = surface.uv(first.at(edge.second));
      bool is_outline = false;
      for (std::size_t k = 0; k < 2; ++k) {
        for (const double end : {0.0, 1.0}) {
          is_outline = is_outline || (std::abs(a[k] - end) < 1e-12 && std::abs(b[k] - end) < 1e-12);
        }
      }
      EXPECT_TRUE(is_cut || is_outline) << "gap at " << edge.first << "," << edge.second << " at " << time << " s";
    }
  }
  EXPECT_GT(cut_edges, 100);
}

TEST_F(AblationTest, IdsFollowTheSamePointThroughCompaction) {
  const CommandResult told = run(2, burning_scene, fire + Arguments{"-output_monitor", "1000"});
  EXPECT_NE(told.output.find("cells are gone"), std::string::npos) << told;
  std::map<long, double> burn_times;
  long burnt_cells = 0;
  for (const auto& [time, path] : frames()) {
    const Surface surface(path);
    for (vtkIdType point = 0; point < surface.data->GetNumberOfPoints(); ++point) {
      const long id = surface.vertex_id[point];
      const std::array<double, 2> found = surface.uv(point);
      if (id >= 0) {
        EXPECT_FLOAT_EQ(found[0], uv_of(id)[0]) << id;  // frames have them as float
        EXPECT_FLOAT_EQ(found[1], uv_of(id)[1]) << id;
        continue;
      }
      // A cut point lies between the two points that its id names, and has all fields from there.
      const auto a = uv_of((-id - 1) / cut_id_stride);
      const auto b = uv_of((-id - 1) % cut_id_stride);
      const double length = std::hypot(b[0] - a[0], b[1] - a[1]);
      EXPECT_NEAR(std::hypot(found[0] - a[0], found[1] - a[1]) + std::hypot(b[0] - found[0], b[1] - found[1]), length,
                  2 * uv_rounding)
          << id;
      EXPECT_LT(length, 1.001 / cells) << id;
    }
    std::set<long> cut_cells;
    for (std::size_t t = 0; t < surface.triangles.size(); ++t) {
      const long cell = std::lround(surface.cell_value("cell_id", t));
      const long row = cell / cells;
      const long column = cell % cells;
      for (const vtkIdType point : surface.triangles[t]) {
        EXPECT_LE(std::abs(surface.uv(point)[0] * cells - static_cast<double>(column) - 0.5), 0.5 + cells * uv_rounding)
            << cell;
        EXPECT_LE(std::abs(surface.uv(point)[1] * cells - static_cast<double>(row) - 0.5), 0.5 + cells * uv_rounding)
            << cell;
        if (surface.vertex_id[point] < 0) {
          cut_cells.insert(cell);
        }
      }
      const double burn_time = surface.cell_value("burn_time", t);
      const auto [known, is_new] = burn_times.try_emplace(cell, burn_time);
      if (!is_new && known->second >= 0) {
        EXPECT_EQ(burn_time, known->second) << cell;
      }
      known->second = burn_time;
      if (burn_time >= 0) {
        ++burnt_cells;
        EXPECT_LE(burn_time, time + 1e-12) << cell;
        EXPECT_NEAR(burn_time / step, std::round(burn_time / step), 1e-6) << "at the end of a step";
        EXPECT_GT(burn_time, step / 2);
      }
    }
    for (const long cell : cut_cells) {
      EXPECT_GE(burn_times.at(cell), 0) << "cell " << cell << " is cut at " << time << " s";
    }
  }
  EXPECT_GT(burnt_cells, 50);
}

TEST_F(AblationTest, BalancesStayClosed) {
  for (const auto& [ranks, fraction] : {std::pair(3, "0.02"), std::pair(1, "1")}) {
    run(ranks, burning_scene, fire + Arguments{"-heat_convection", "10", "-ablation_compact_fraction", fraction});
    expect_closed_balances();
    EXPECT_GT(history().at("mass_burnt").back(), 0.2);
  }
}

// What burns, is cut and falls apart: all that is there is drawn, also at the edges.
TEST_F(AblationTest, FramesHoldTheMassAndTheHeat) {
  run(2, burning_scene, fire + Arguments{"-combustion_corner_factor", "0.8"});
  const auto table = history();
  ASSERT_LT(table.at("mass_left").back(), 0.8);
  std::size_t row = 0;
  for (const auto& [time, path] : frames()) {
    while (table.at("time")[row] < time - 1e-9) {
      ++row;
    }
    const double mass = table.at("mass_left")[row];
    const double heat = table.at("heat_content")[row];
    const DrawnFrame frame = read_frame(time, path);
    EXPECT_NEAR(frame.integrals.at("areal_density"), mass, 1e-9 * mass) << time;
    EXPECT_NEAR(frame.integrals.at("heat_density"), heat, 1e-9 * heat) << time;
  }
}

/// Initial mass of a particle of the scene, of 1 kg, by its id [kg].
double initial_mass(long id) {
  const auto [u, v] = uv_of(id);
  constexpr double of_cell = 1.0 / (cells * cells);
  if (id >= (cells + 1) * (cells + 1)) {
    return of_cell / 2;
  }
  const auto sides = [](double place) { return place == 0 || place == 1 ? 1 : 2; };
  return of_cell / 8 * sides(u) * sides(v);
}

/// Columns of the history, as the frames' fields have them.
class FramedRow {
 public:
  FramedRow(const std::filesystem::path& surface, const std::filesystem::path& springs) {
    const DrawnFrame drawn = read_frame(0, surface);
    values["mass_left"] = drawn.integrals.at("areal_density");
    values["mass_burnt"] = 1 - values["mass_left"];
    values["heat_content"] = drawn.integrals.at("heat_density");
    values["temperature_max"] = range_of(drawn.points.at("temperature")).second;
    std::set<double> pieces;
    for (const auto& [cell, ids] : drawn.cell_values.at("piece")) {
      pieces.insert(ids.begin(), ids.end());
    }
    values["pieces"] = static_cast<double>(pieces.size());
    const vtkSmartPointer<vtkPolyData> lines = read_pvtp(springs);
    add_motion(lines);
    add_strains(lines);
  }

  std::map<std::string, double> values;

 private:
  void add_motion(vtkPolyData* lines) {
    vtkPointData* ends = lines->GetPointData();
    for (vtkIdType end = 0; end < lines->GetNumberOfPoints(); ++end) {
      if (ends->GetArray(vtkDataSetAttributes::GhostArrayName())->GetTuple1(end) != 0) {
        continue;
      }
      const double mass = initial_mass(std::lround(ends->GetArray("vertex_id")->GetTuple1(end))) *
                          ends->GetArray("mass_ratio")->GetTuple1(end);
      for (int k = 0; k < 3; ++k) {
        const double velocity = ends->GetArray("velocity")->GetComponent(end, k);
        values["kinetic_energy"] += mass / 2 * velocity * velocity;
        values[std::string("momentum_") + "xyz"[k]] += mass * velocity;
      }
    }
  }

  void add_strains(vtkPolyData* lines) {
    const std::array<std::string, 4> colours{"red", "green", "blue", "yellow"};
    std::array<double, 4> squares{};
    std::array<double, 4> counts{};
    double sum = 0;
    double constraints = 0;
    values["largest_strain"] = -1;
    const auto of_cell = [&](const char* field, vtkIdType cell) {
      return lines->GetCellData()->GetArray(field)->GetTuple1(cell);
    };
    for (vtkIdType cell = 0; cell < lines->GetNumberOfCells(); ++cell) {
      const auto colour = static_cast<std::size_t>(of_cell("colour", cell));
      const double strain = of_cell("strain", cell);
      double& largest = values["strain_max_" + colours[colour]];
      largest = std::max(largest, std::abs(strain));
      squares[colour] += strain * strain;
      ++counts[colour];
      sum += std::abs(strain);
      constraints += std::pow(of_cell("target_length", cell) * (std::pow(1 + strain, 2) - 1), 2);
      if ((colour == 1 || colour == 2) && std::abs(strain) > values["largest_strain"]) {
        values["largest_strain"] = std::abs(strain);
        vtkIdType count = 0;
        const vtkIdType* ends = nullptr;
        lines->GetCellPoints(cell, count, ends);
        for (int k = 0; k < 3; ++k) {
          values[std::string("largest_strain_") + "xyz"[k]] =
              (lines->GetPoint(ends[0])[k] + lines->GetPoint(ends[1])[k]) / 2;
        }
        const auto id = [&](int end) { return lines->GetPointData()->GetArray("vertex_id")->GetTuple1(ends[end]); };
        values["largest_strain_id_1"] = std::min(id(0), id(1));
        values["largest_strain_id_2"] = std::max(id(0), id(1));
      }
    }
    for (std::size_t colour = 0; colour < 4; ++colour) {
      values["strain_rms_" + colours[colour]] = std::sqrt(squares[colour] / std::max(1.0, counts[colour]));
    }
    values["mean_strain"] = sum / std::accumulate(counts.begin(), counts.end(), 0.0);
    values["constraint_error"] = std::sqrt(constraints);
  }
};

TEST_F(AblationTest, HistoryIsWhatFramesShow) {
  const std::string elastic_scene =
      burning_scene.substr(0, burning_scene.find(tight_projection)) + "output: {directory: out, name: scene}\n";
  const Arguments each_step{"-output_interval_steps", "1", "-output_springs"};
  for (const auto& [dynamics, ranks] : {std::pair("elastic", 1), std::pair("projection", 2)}) {
    const bool is_elastic = std::string(dynamics) == "elastic";
    const Arguments options = fire + each_step;
    run(ranks, is_elastic ? elastic_scene : burning_scene,
        is_elastic
            ? Arguments(options.begin(), std::find(options.begin(), options.end(), "-project_max_steps")) + each_step
            : options);
    const auto table = history();
    const auto surfaces = frames();
    const auto springs = read_pvd(folder() / "out/scene_springs.pvd");
    ASSERT_EQ(surfaces.size(), table.at("step").size());
    ASSERT_EQ(springs.size(), surfaces.size());
    ASSERT_LT(table.at("mass_left").back(), 0.8) << "it burns";
    ASSERT_LT(read_pvtp(springs.back().second)->GetNumberOfCells(),
              read_pvtp(springs.front().second)->GetNumberOfCells())
        << "springs are cut";
    for (std::size_t row = 0; row < surfaces.size(); ++row) {
      const FramedRow framed(surfaces[row].second, springs[row].second);
      EXPECT_NEAR(table.at("time")[row], surfaces[row].first, 1e-12);
      for (const auto& [column, value] : framed.values) {
        const bool differs = is_elastic && column == "mean_strain";  // of what has stiffness
        const bool is_of_step = column == "constraint_error" && row == 0;
        if (!differs && !is_of_step) {
          EXPECT_NEAR(table.at(column)[row], value, 1e-9 * std::max(1.0, std::abs(value)))
              << dynamics << " " << column << " in row " << row;
        }
      }
    }
  }
}

TEST_F(AblationTest, MassRatioIsThatOfBothLayers) {
  // Of one layer half of the mass is lost, of the other none.
  run(2, R"(
mesh: {shape: rectangle, cells: [6, 5], size: [0.6 m, 0.5 m]}
sheet: {thickness: 2 cm, areal_density: 2 kg/m^2}
time: {step: 2 ms, end: 8 ms}
heat: {initial_temperature: 600 K, diffusivity: 0, burning_heat: 0}
combustion: {ignition_temperature: 500 K, mass_loss_rate: 1, corner_factor: 1, lattice_factor: 0, min_mass: 0.5}
output: {directory: out, name: scene, interval_steps: 4}
)");
  EXPECT_NEAR(history().at("mass_left").back(), 0.6 * 0.75, 1e-12);
  const DrawnFrame frame = last_frame(folder() / "out/scene.pvd");
  const auto [low, high] = range_of(frame.points.at("mass_ratio"));
  EXPECT_NEAR(low, 0.75, 1e-12);
  EXPECT_NEAR(high, 0.75, 1e-12);
  EXPECT_NEAR(frame.integrals.at("areal_density"), 0.6 * 0.75, 1e-12);
}

TEST_F(AblationTest, EverythingBurnsAway) {
  for (const int ranks : {1, 3}) {
    for (const char* fraction : {"0.2", "1"}) {
      const CommandResult told = run(ranks, hot_deck, {"-ablation_compact_fraction", fraction});
      EXPECT_EQ(told.errors, "");
      const auto table = history();
      EXPECT_LT(table.at("time").back(), 0.5) << "long before its end";
      std::smatch ended;
      ASSERT_TRUE(std::regex_search(told.output, ended, std::regex("\nended at (\\S+) s: the sheet has burnt away\n")))
          << told;
      EXPECT_NEAR(std::stod(ended[1]), table.at("time").back(), 1e-6);
      EXPECT_EQ(table.at("mass_left").back(), 0);
      EXPECT_EQ(table.at("pieces").back(), 0);
      EXPECT_NEAR(table.at("mass_burnt").back(), table.at("mass_left").front(), 1e-12);
      EXPECT_NEAR(table.at("mass_left").front(), 1, 1e-12);
      expect_closed_balances();
      for (const auto& [name, values] : table) {
        EXPECT_TRUE(std::isfinite(values.back())) << name;
      }
      ASSERT_GT(frames().size(), 2U);
      EXPECT_NEAR(frames().back().first, table.at("time").back(), 1e-12);
      const DrawnFrame last = last_frame(folder() / "out" / "scene.pvd");
      EXPECT_EQ(last.cells, 0);
      for (const char* field : {"vertex_id", "temperature", "mass_ratio"}) {
        EXPECT_EQ(last.point_fields.count(field), 1U) << "an empty frame has its fields too";
      }
      EXPECT_GT(read_frame(0, frames()[frames().size() - 2].second).cells, 0);
    }
  }
}

TEST_F(AblationTest, AHotSphereCutsASheetInTwo) {
  constexpr int n = 40;  // cells along each edge
  const Arguments deck{std::string(PELLICLE_SOURCE_DIR) + "/input/hot_sphere_c.yaml"};
  succeed(2, deck + Arguments{"-mesh_cells", "40,40", "-sheet_thickness", "12.5 mm", "-output_directory", "out",
                              "-output_name", "scene", "-time_step", "4 ms", "-time_end", "1.6 s",
                              "-output_interval_time", "50 ms", "-output_springs"});
  const auto table = history();
  const auto& pieces = table.at("pieces");
  ASSERT_EQ(pieces.back(), 2);
  EXPECT_EQ(pieces.front(), 1);
  const auto two = static_cast<std::size_t>(std::find(pieces.begin(), pieces.end(), 2) - pieces.begin());
  const double separation = table.at("time")[two];
  const double mass = table.at("mass_left").front();
  for (std::size_t row = 0; row < pieces.size(); ++row) {
    EXPECT_NEAR(table.at("mass_left")[row] + table.at("mass_burnt")[row], mass, 1e-12 * mass) << row;
  }

  // The rows of the pieces: one that was there at first, and one that was born when they separated.
  const auto births = read_csv(folder() / "out" / "pieces.csv");
  std::map<double, double> sums;  // of the pieces' masses at each time
  std::map<long, double> masses;  // of the last frame
  for (std::size_t row = 0; row < births.at("time").size(); ++row) {
    sums[births.at("time")[row]] += births.at("mass")[row];
    if (births.at("time")[row] == births.at("time").back()) {
      masses[std::lround(births.at("piece")[row])] = births.at("mass")[row];
    }
  }
  for (std::size_t row = 0; row < pieces.size(); ++row) {
    const auto sum = sums.find(table.at("time")[row]);
    if (sum != sums.end()) {
      EXPECT_NEAR(sum->second, table.at("mass_left")[row], 1e-12 * mass) << row;
    }
  }
  ASSERT_EQ(masses.size(), 2U);
  ASSERT_EQ(masses.begin()->first, 0) << "the larger part keeps its id";

  // The same masses from the springs that are drawn: of 1 kg/m^2 half of a cell's mass is its lattice point's, and an
  // eighth each of its corners'.
  const vtkSmartPointer<vtkPolyData> springs =
      read_pvtp(read_pvd(folder() / "out" / "scene_springs.pvd").back().second);
  std::map<long, long> root;  // of each particle, by id
  std::map<long, double> ratio;
  const auto root_of = [&root](long id) {
    while (root.at(id) != id) {
      id = root[id] = root.at(root.at(id));
    }
    return id;
  };
  const auto id_of = [&](vtkIdType point) {
    return std::lround(springs->GetPointData()->GetArray("vertex_id")->GetTuple1(point));
  };
  for (vtkIdType point = 0; point < springs->GetNumberOfPoints(); ++point) {
    root[id_of(point)] = id_of(point);
    ratio[id_of(point)] = springs->GetPointData()->GetArray("mass_ratio")->GetTuple1(point);
  }
  for (vtkIdType line = 0; line < springs->GetNumberOfCells(); ++line) {
    vtkIdType count = 0;
    const vtkIdType* points = nullptr;
    springs->GetCellPoints(line, count, points);
    root[root_of(id_of(points[0]))] = root_of(id_of(points[1]));
  }
  std::map<long, double> found;  // by the root
  constexpr long corners = (n + 1) * (n + 1);
  constexpr double cell_mass = 1.0 / (n * n);
  for (const auto& [id, fraction] : ratio) {
    double initial = cell_mass / 2;
    if (id < corners) {
      const auto cells_along = [](long k) { return k == 0 || k == n ? 1 : 2; };
      initial = cell_mass / 8 * cells_along(id % (n + 1)) * cells_along(id / (n + 1));
    }
    found[root_of(id)] += initial * fraction;
  }
  ASSERT_EQ(found.size(), 2U);
  std::array<double, 2> found_masses{found.begin()->second, found.rbegin()->second};
  std::array<double, 2> told_masses{masses.begin()->second, masses.rbegin()->second};
  std::sort(found_masses.begin(), found_masses.end());
  std::sort(told_masses.begin(), told_masses.end());
  EXPECT_NEAR(found_masses[0], told_masses[0], 1e-12 * mass);
  EXPECT_NEAR(found_masses[1], told_masses[1], 1e-12 * mass);
  EXPECT_GT(told_masses[0], 0.1) << "a good part of the sheet, no crumb";

  // What the frames show: the lower part moves on its own, by gravity of 1 m/s^2 and damping of 2/s alone. Upwards at
  // first, for the sheet shrank; then it falls.
  std::map<double, double> speeds;  // mean upward one of the lower part by time
  for (const auto& [time, path] : frames()) {
    const Surface surface(path);
    std::map<long, std::array<double, 3>> sum;  // upward speed, v, how many
    for (std::size_t t = 0; t < surface.triangles.size(); ++t) {
      const long piece = std::lround(surface.cell_value("piece", t));
      EXPECT_NEAR(surface.cell_value("piece_birth_time", t), piece == 0 ? 0 : separation, 1e-9);
      for (const vtkIdType point : surface.triangles[t]) {
        sum[piece][0] += surface.value("velocity", point, 2);
        sum[piece][1] += surface.uv(point)[1];
        sum[piece][2] += 1;
      }
    }
    EXPECT_EQ(sum.size(), time < separation - 1e-9 ? 1U : 2U) << time;
    if (sum.size() == 2) {
      const auto v = [&sum](long piece) { return sum.at(piece)[1] / sum.at(piece)[2]; };
      const long lower = v(0) < v(masses.rbegin()->first) ? 0 : masses.rbegin()->first;
      EXPECT_LT(v(lower), 0.3);
      speeds[time] = sum.at(lower)[0] / sum.at(lower)[2];
    }
  }
  ASSERT_GE(speeds.size(), 10U);
  const auto [begin, speed] = *std::next(speeds.begin(), 2);  // when its burning edge has come to rest
  for (auto later = std::next(speeds.begin(), 3); later != speeds.end(); ++later) {
    const double terminal = -1.0 / 2;
    EXPECT_NEAR(later->second, terminal + (speed - terminal) * std::exp(-2 * (later->first - begin)), 0.02)
        << later->first;
  }
  EXPECT_LT(speeds.rbegin()->second, -0.2) << "it falls";
}

TEST_F(AblationTest, TearingIsReproducibleByItsSeed) {
  const auto torn = [&](int ranks, const Arguments& options) {
    run(ranks, tearing_scene, options);
    return last_frame(folder() / "out" / "scene.pvd");
  };
  const auto ids = [](const DrawnFrame& frame) {
    std::set<long> result;
    for (const auto& point : frame.points.at("vertex_id")) {
      result.insert(point.first);
    }
    return result;
  };
  const DrawnFrame first = torn(1, {});
  const auto table = history();
  EXPECT_EQ(first.cells, 4 * 8 * 16) << "nothing is lost";
  EXPECT_GE(table.at("pieces").back(), 2) << "it comes apart";
  EXPECT_GT(table.at("cracked_sides").back(), 8);
  EXPECT_NEAR(table.at("crack_length").back(), 0.05 * table.at("cracked_sides").back(), 1e-9);
  EXPECT_EQ(table.at("mass_burnt").back(), 0);
  EXPECT_NEAR(table.at("mass_left").back(), table.at("mass_left").front(), 1e-14);
  EXPECT_GT(ids(first).size(), 9 * 17U + 8 * 16U + 8) << "corners have doubled";
  expect_closed_balances();
  const DrawnFrame again = torn(1, {});
  expect_same_remains(first, again, 0, "a second time");
  expect_same_remains(first, torn(3, {}), 1e-4, "on 3 ranks");
  EXPECT_NE(ids(first), ids(torn(1, {"-ablation_seed", "7"}))) << "another seed";

  const std::string::size_type strength = tearing_scene.find("ablation:");
  const std::string without =
      tearing_scene.substr(0, strength) + tearing_scene.substr(tearing_scene.find('\n', strength) + 1);
  run(1, without);
  EXPECT_EQ(ids(last_frame(folder() / "out" / "scene.pvd")).size(), 9 * 17U + 8 * 16U)
      << "nothing tears unless asked for";
}

TEST_F(AblationTest, TearingGoesOnFromACheckpointToTheLastBit) {
  for (const int ranks : {1, 2}) {
    const std::string printed = run(ranks, tearing_scene, {"-verify_restart", "15"}).output;
    EXPECT_NE(printed.find("fields are the same"), std::string::npos) << printed;
    EXPECT_GT(history().at("cracked_sides").back(), 8);
  }
}

}  // namespace
}  // namespace pellicle
