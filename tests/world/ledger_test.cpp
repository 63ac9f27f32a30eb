// Every column of a burning sheet's tables against a value that this test works out by itself, from the fields of all
// ranks by persistent id.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "tests/io/files.h"
#include "tests/support/alone.h"
#include "tests/support/csv.h"
#include "tests/support/grid_mesh.h"
#include "tests/world/one_object.h"
#include "tests/world/tables.h"
#include "tests/world/whole.h"

namespace pellicle::ledger_test {
namespace {

constexpr double edge = 0.1;  // [m]
constexpr double h = 2e-3;    // [s]
constexpr int steps = 8;
const double never = HUGE_VAL;

/// A strip of seven cells with something of everything: it hangs by a corner, a hot ball burns its fifth cell away, it
/// cools, and a floor comes up from below.
Options burning_options() {
  Options options;
  options.dynamics = Dynamics::projection;
  options.sheet.thickness = edge / 2;
  options.sheet.perturbation = 0.02;
  options.force.gravity = {0.3, 0, -2};
  options.force.damping = 3;
  options.heat.diffusivity = 0.01;
  options.heat.burning_heat = 200;
  options.heat.operator_name = "umbrella";  // It makes heat.
  options.heat.convection = 60;
  options.heat.ambient_temperature = 280;
  options.heat.ksp_rtol = 1e-14;
  HeatSource& ball = options.heat.sources["ball"];
  ball.centre = {0.44, 0.05, 0};
  ball.velocity = {1, 0, 0};
  ball.radius = 0.2;
  ball.temperature = 2000;
  ball.rate = 600;
  ball.start_time = 0.5 * h;
  options.combustion.ignition_temperature = 900;
  options.combustion.mass_loss_rate = 1;
  options.ablation.loss_mass = 0.5;
  options.ablation.compact_fraction = 1;
  options.project.max_steps = 3;
  options.project.ksp_rtol = 1e-13;
  options.project.monitor = true;
  options.pins["hook"].vertices = {0};
  options.bodies["floor"].shape = "plane";
  options.bodies["floor"].point = {0, 0, -0.0065};
  options.bodies["floor"].velocity = {0, 0, 0.6};
  return options;
}

/// Runs the scene twice: in a world with its output, and step by step beside it.
class Tables : public ::testing::Test {
 protected:
  Tables() {
    const Whole start = whole();
    initial_heat_ = 1340 * start.mass.dot(start.temperature);
    initial_mass_ = start.shared([](const Whole::Cell&) { return 0.08 * edge * edge / 4; });
  }

  Whole whole() const { return {sheet_.sheet(), state_}; }

  /// Row of the present state; heat_in and heat_out are sums of all steps.
  TableRow row(const Whole& now, const AloneStep& step, const StageClock& written) const {
    TableRow row{{"time", state_.time},
                 {"step", state_.step},
                 {"time_step", state_.step == 0 ? 0 : h},
                 {"retries", state_.step % 3},
                 {"mass_left", now.mass.sum()},
                 {"mass_burnt", initial_mass_.sum() - now.mass.sum()},
                 {"pieces", now.pieces().size()},
                 {"heat_content", 1340 * now.mass.dot(now.temperature)},
                 {"heat_in", heat_in_},
                 {"heat_out", heat_out_},
                 {"heat_made", 1340 * now.mass.dot(now.temperature) - initial_heat_ - heat_in_ + heat_out_},
                 {"temperature_max", hottest(now)},
                 {"kinetic_energy", now.mass.dot(now.v.colwise().squaredNorm()) / 2},
                 {"momentum_x", now.mass.dot(now.v.row(0))},
                 {"momentum_y", now.mass.dot(now.v.row(1))},
                 {"momentum_z", now.mass.dot(now.v.row(2))},
                 {"gravity_work", gravity_work_},
                 {"damping_work", damping_work_},
                 {"pin_work", 0},
                 {"constraint_error", state_.step == 0 ? 0 : now.error(now.x)},
                 {"contacts", state_.step == 0 ? 0 : on_floor(now)},
                 {"heat_iterations", step.heat_iterations},
                 {"projection_iterations", step.motion_iterations},
                 {"newton_iterations", step.newton_iterations},
                 {"force_residual", step.force_residual}};
    for (std::size_t colour = 0; colour < 4; ++colour) {
      const std::vector<double> strains = now.strains(colour);
      row[std::string("strain_max_") + colour_names[colour]] = *std::max_element(strains.begin(), strains.end());
      row[std::string("strain_rms_") + colour_names[colour]] =
          std::sqrt(std::inner_product(strains.begin(), strains.end(), strains.begin(), 0.0) /
                    static_cast<double>(strains.size()));
    }
    add_strains(row, now);
    add_floor(row, now, step);
    add_seconds(row, written);
    return row;
  }

  /// The floor, which has no friction, and how near it is to what there is: no more than a tenth of an edge.
  void add_floor(TableRow& row, const Whole& now, const AloneStep& step) const {
    row["force_floor_x"] = row["force_floor_y"] = 0;
    row["force_floor_z"] = step.loads.empty() ? 0 : step.loads[0].force.z();
    if (state_.step > 0 && on_floor(now) > 0) {
      EXPECT_LT(row["force_floor_z"], 0) << "step " << state_.step;
    }
    double gap = 0.1 * edge;
    for (Eigen::Index i = 1; i < now.x.cols(); ++i) {  // The first one is pinned.
      if (now.mass[i] > 0) {
        gap = std::min(gap, now.x(2, i) - (0.6 * state_.time - 0.0065));
      }
    }
    row["gap_floor"] = state_.step > 0 ? gap : 0;
  }

  /// The largest strain of green and blue springs, where it is, and the mean of all.
  static void add_strains(TableRow& row, const Whole& now) {
    double largest = -1;
    double sum = 0;
    double count = 0;
    for (const Whole::Spring& spring : now.springs) {
      if (!spring.lives) {
        continue;
      }
      const double strain = std::abs((now.x.col(spring.a) - now.x.col(spring.b)).norm() / spring.target - 1);
      sum += strain;
      ++count;
      if ((spring.colour == 1 || spring.colour == 2) && strain > largest) {
        largest = strain;
        const Eigen::Vector3d middle = (now.x.col(spring.a) + now.x.col(spring.b)) / 2;
        row["largest_strain_id_1"] = std::min(spring.a, spring.b);
        row["largest_strain_id_2"] = std::max(spring.a, spring.b);
        row["largest_strain_x"] = middle[0];
        row["largest_strain_y"] = middle[1];
        row["largest_strain_z"] = middle[2];
      }
    }
    row["largest_strain"] = largest;
    row["mean_strain"] = sum / count;
  }

  /// Particles that the floor holds.
  double on_floor(const Whole& now) const {
    const double floor = 0.6 * state_.time - 0.0065;
    return static_cast<double>(((now.x.row(2).array() - floor).abs() < 1e-12).count());
  }

  /// Of what is drawn: of what has not burnt, and of where sides of triangles are cut between it and what has.
  double hottest(const Whole& now) const {
    double highest = 0;
    const auto level = [&](int i) { return now.mass[i] / initial_mass_[i] - options_.ablation.loss_mass; };
    for (const Whole::Cell& cell : now.cells) {
      for (std::size_t k = 0; k < 4; ++k) {
        const std::array<int, 3> corners{cell.corners[k], cell.corners[(k + 1) % 4], cell.lattice};
        for (std::size_t l = 0; l < 3 && cell.triangles[k]; ++l) {
          for (const auto& [from, to] :
               {std::pair(corners[l], corners[(l + 1) % 3]), std::pair(corners[(l + 1) % 3], corners[l])}) {
            if (level(from) >= 0) {
              const double t = level(to) < 0 ? level(from) / (level(from) - level(to)) : 0;
              highest =
                  std::max({highest, now.temperature[from], (1 - t) * now.temperature[from] + t * now.temperature[to]});
            }
          }
        }
      }
    }
    return highest;
  }

  /// Adds the works of a step: of the weights, and of the damping that is left of the change of velocity.
  void add_work(const Whole& before, const Whole& after) {
    const Eigen::Vector3d gravity(0.3, 0, -2);
    const double kept = std::exp(-3 * h);
    const double fraction = (1 - kept) / (3 * h);
    for (Eigen::Index i = 1; i < after.mass.size(); ++i) {  // The first one is pinned.
      const Eigen::Vector3d moved = after.x.col(i) - before.x.col(i);
      const Eigen::Vector3d change = moved / h - before.v.col(i);
      const Eigen::Vector3d undamped = (moved / h - kept * before.v.col(i)) / fraction;
      gravity_work_ += after.mass[i] * gravity.dot(moved);
      damping_work_ += after.mass[i] / h * (change - undamped).dot(moved);
    }
  }

  /// Adds the heat of a step: eq. 1, convection from both sides, and what leaves with the mass.
  void add_heat(const Whole& before, const Whole& after, double time) {
    const HeatSource& ball = options_.heat.sources.at("ball");
    const Eigen::Vector3d centre = ball.centre + time * ball.velocity;
    const Eigen::RowVectorXd area = before.shared([&](const Whole::Cell& cell) {
      const auto corner = [&](std::size_t k) -> Eigen::Vector3d { return before.x.col(cell.corners[k]); };
      return (corner(2) - corner(0)).cross(corner(3) - corner(1)).norm() / 2 / 4;
    });
    for (Eigen::Index i = 0; i < before.mass.size(); ++i) {
      const double capacity = 1340 * before.mass[i];
      if (capacity > 0) {
        const double fraction = 1 - (before.x.col(i) - centre).squaredNorm() / (0.2 * 0.2);
        const bool is_heated = fraction > 0 && time >= ball.start_time;
        double temperature = before.temperature[i];
        double rise =
            is_heated ? (1 - std::exp(-600 * h)) * fraction * fraction * std::max(2000 - temperature, 0.0) : 0;
        rise += -200 * before.mass_change[i] / initial_mass_[i];
        temperature += rise;
        heat_in_ += capacity * rise;
        heat_out_ += capacity * (temperature - 280) * (1 - std::exp(-2 * 60 * area[i] * h / capacity));
      }
      heat_out_ += 1340 * (before.mass[i] - after.mass[i]) * after.temperature[i];
    }
  }

  Options options_ = burning_options();
  Alone sheet_{grid_mesh(7, 1, edge), options_};
  State& state_ = sheet_.state();
  Eigen::RowVectorXd initial_mass_;
  double heat_in_ = 0;
  double heat_out_ = 0;
  double initial_heat_ = 0;
  double gravity_work_ = 0;
  double damping_work_ = 0;
};

TEST_F(Tables, AreOfStatesWhoseGhostsAreUpToDate) {
  for (int k = 1; k <= steps; ++k) {
    ASSERT_TRUE(sheet_.advance(h).converged);
    BurningFields& fields = sheet_.burning();
    for (Field* field : {&state_.position, &state_.velocity, &fields.temperature, &fields.mass, &fields.mass_change}) {
      const Eigen::MatrixXd values = field->values();
      field->update_ghosts();
      EXPECT_EQ(field->values(), values) << "step " << k;
    }
  }
}

TEST_F(Tables, HaveWhatTheStateSays) {
  const TestFolder folder;
  options_.output.directory = folder / "out";
  options_.output.name = "strip";
  OneObject run(grid_mesh(7, 1, edge), options_);
  const StageClock& clock = run.clock();

  std::vector<TableRow> history;
  std::vector<TableRow> pieces;
  std::vector<TableRow> projection;
  double split_time = never;
  double contacts = 0;
  const auto add_pieces = [&](const Whole& now) {
    const std::vector<double> masses = now.pieces();
    for (std::size_t piece = 0; piece < masses.size(); ++piece) {
      pieces.push_back({{"time", state_.time},
                        {"step", state_.step},
                        {"piece", static_cast<double>(piece)},
                        {"birth_time", piece == 0 ? 0 : split_time},
                        {"mass", masses[piece]}});
    }
  };
  const Whole start = whole();
  run.begin();
  add_pieces(start);
  history.push_back(row(start, {}, clock));
  for (int k = 1; k <= steps; ++k) {
    const Whole before = whole();
    const double time = state_.time;
    run.keep();
    ASSERT_TRUE(run.advance(h).converged);
    const AloneStep step = sheet_.advance(h);
    ASSERT_TRUE(step.converged) << step.reason;
    run.accept(run.time());
    testing::internal::CaptureStdout();  // The curves of Fig. 8 are printed, too.
    run.record(k % 3);
    testing::internal::GetCapturedStdout();

    const Whole after = whole();
    add_heat(before, after, time);
    add_work(before, after);
    history.push_back(row(after, step, clock));
    contacts += on_floor(after);
    if (after.pieces().size() > 1) {
      split_time = std::min(split_time, state_.time);
    }
    run.draw();
    add_pieces(after);

    // Before the first projection: moved by the external force alone (eq. 8 and 9), what is constrained excepted.
    Eigen::MatrixXd moved = before.x;
    for (Eigen::Index i = 0; i < moved.cols(); ++i) {
      if (i != 0 && after.mass[i] > 0) {
        moved.col(i) +=
            h * (std::exp(-3 * h) * before.v.col(i) + (1 - std::exp(-3 * h)) / 3 * Eigen::Vector3d(0.3, 0, -2));
      }
    }
    for (int sweep = 0; sweep <= 3; ++sweep) {
      for (int colour = sweep == 0 ? -1 : 0; colour < (sweep == 0 ? 0 : 4); ++colour) {
        auto& errors = projection.emplace_back();
        errors = {
            {"time", state_.time}, {"step", state_.step}, {"projection_step", sweep}, {"projected_colour", colour}};
        const bool is_last = sweep == 3 && colour == 3 && on_floor(after) == 0;
        if (sweep == 0 || is_last) {
          const Eigen::MatrixXd& x = sweep == 0 ? moved : after.x;
          errors["error_total"] = after.error(x);
          for (std::size_t c = 0; c < 4; ++c) {
            errors[std::string("error_") + colour_names[c]] = after.error(x, c);
          }
        } else {
          for (const char* name : {"error_red", "error_green", "error_blue", "error_yellow", "error_total"}) {
            errors[name] = never;
          }
        }
      }
    }
  }
  EXPECT_EQ(history.back().at("pieces"), 2) << "the strip does not part";
  EXPECT_EQ(history[1].at("pieces"), 1);
  EXPECT_EQ(history[1].at("contacts"), 0);
  EXPECT_GT(contacts, 0);
  EXPECT_GT(heat_out_, 0.01 * heat_in_);
  MPI_Barrier(PETSC_COMM_WORLD);

  const std::string out = options_.output.directory;
  expect_table(read_csv(out + "/history.csv"), history, 1e-14, {{"heat_made", 1e-12}});
  expect_table(read_csv(out + "/pieces.csv"), pieces, 1e-14);
  // Between the colours' projections this test does not know the positions: the rows there need not be as expected.
  auto errors = read_csv(out + "/projection.csv");
  for (auto& [name, column] : errors) {
    for (std::size_t k = 0; k < std::min(column.size(), projection.size()); ++k) {
      if (projection[k].at(name) == never) {
        EXPECT_GE(column[k], 0) << name;
        column[k] = projection[k].at(name) = 0;
      }
    }
  }
  expect_table(errors, projection, 1e-14);
}

}  // namespace
}  // namespace pellicle::ledger_test
