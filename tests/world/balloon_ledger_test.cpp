// Every column of a balloon's history against a value that this test works out by itself, from the mesh and from the
// positions and velocities of all ranks by persistent id.

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <tuple>
#include <utility>

#include "meshing/closed_shapes.h"
#include "run/world_output.h"
#include "tests/io/files.h"
#include "tests/support/balls.h"
#include "tests/support/csv.h"
#include "tests/support/run_folder.h"
#include "tests/world/one_object.h"
#include "tests/world/static_balloon.h"
#include "tests/world/tables.h"

namespace pellicle::balloon_ledger_test {
namespace {

constexpr double h = 4e-3;  // [s]
constexpr double ambient = 9e4;
constexpr double density = 1200;
constexpr double damping = 10;  // [1/s]

/// A ball of thin wall beside a small one of thick wall.
SurfaceMesh two_balls() { return joined(icosphere_mesh(1, 0.05), icosphere_mesh(0, 0.03), {0.2, 0, 0}); }

constexpr double thickness_of(bool is_small) { return is_small ? 5e-4 : 3e-4; }

Options options_of(const std::string& rule) {
  Options options;
  options.force.gravity = {1, 2, -9.81};
  options.gas.ambient_pressure = ambient;
  options.wall.thickness = thickness_of(false);
  options.wall.density = density;
  options.wall.thickness_rule = rule;
  options.wall.bending = "none";  // of which this test has no formula
  options.wall.material.law = rule == "fixed" ? "st_venant_kirchhoff" : "neo_hookean";
  options.wall.material.mu = 4e5;
  options.wall.material.lambda = 1e5;
  RegionOptions& small = options.wall.regions["small"];
  small.box = {0.1, -1, -1, 1, 1, 1};
  small.thickness = thickness_of(true);
  ChamberOptions& big = options.chambers["big"];
  big.vertex = 0;
  big.law = "isothermal";
  big.amount_ratio = {{0, 1.01}, {4 * h, 1.31}};
  big.temperature = {{0, 310}};
  ChamberOptions& other = options.chambers["small"];
  other.law = "adiabatic";
  other.amount_ratio = {{0, 1.02}, {4 * h, 1.62}};
  other.temperature = {{0, 280}};
  options.prism.mass_damping = damping;
  options.prism.newton = "fixed";
  options.prism.max_iterations = 1;
  options.prism.ksp_rtol = 1e-12;
  return options;
}

/// Values of all ranks by the mesh's numbers of the points, (3 x points). Collective.
Eigen::Matrix3Xd by_point(const Membrane& membrane, const Eigen::Matrix3Xd& values, std::size_t points) {
  Eigen::Matrix3Xd all = Eigen::Matrix3Xd::Zero(3, static_cast<Eigen::Index>(points));
  for (PetscInt i = 0; i < membrane.particles.owned; ++i) {
    all.col(membrane.persistent_id[i]) = values.col(i);
  }
  MPI_Allreduce(MPI_IN_PLACE, all.data(), static_cast<int>(all.size()), MPI_DOUBLE, MPI_SUM, membrane.comm());
  return all;
}

class BalloonTable : public ::testing::TestWithParam<std::string> {
 protected:
  BalloonTable()
      : mesh_(two_balls()),
        options_(options_of(GetParam())),
        balloons_(mesh_, options_),
        rest_(by_point(membrane_, membrane_.rest, mesh_.points.size())) {
    for (const auto& face : mesh_.faces) {
      for (const int point : face) {
        mass_[point] += density * thickness_of(is_small(face)) * area(rest_, face).norm() / 3;
      }
    }
  }

  bool is_small(const std::vector<int>& face) const { return rest_(0, face[0]) > 0.1; }

  static Eigen::Vector3d corner(const Eigen::Matrix3Xd& x, const std::vector<int>& face, std::size_t k) {
    return x.col(face[k]);
  }

  static Eigen::Vector3d area(const Eigen::Matrix3Xd& x, const std::vector<int>& face) {
    return (corner(x, face, 1) - corner(x, face, 0)).cross(corner(x, face, 2) - corner(x, face, 0)) / 2;
  }

  /// Trace and determinant of the in-plane right Cauchy-Green tensor of a face.
  Eigen::Vector2d stretch(const Eigen::Matrix3Xd& x, const std::vector<int>& face) const {
    const auto metric = [&](const Eigen::Matrix3Xd& places) {
      Eigen::Matrix<double, 3, 2> edges;
      edges << corner(places, face, 1) - corner(places, face, 0), corner(places, face, 2) - corner(places, face, 0);
      return Eigen::Matrix2d(edges.transpose() * edges);
    };
    const Eigen::Matrix2d c = metric(rest_).inverse() * metric(x);
    return {c.trace(), c.determinant()};
  }

  /// Thickness of a face at positions, by the rule.
  double thickness(const Eigen::Matrix3Xd& x, const std::vector<int>& face) const {
    const double ratio = GetParam() == "fixed" ? 1 : area(rest_, face).norm() / area(x, face).norm();
    return thickness_of(is_small(face)) * ratio;
  }

  double energy_density(const Eigen::Matrix3Xd& x, const std::vector<int>& face) const {
    const Eigen::Vector2d c = stretch(x, face);
    if (GetParam() == "fixed") {  // mu E:E + lambda/2 (tr E)^2 with E = (C - 1)/2, nothing across the wall
      const double trace = (c[0] - 2) / 2;
      const double squares = (c[0] * c[0] - 2 * c[1] - 2 * c[0] + 2) / 4;
      return 4e5 * squares + 1e5 / 2 * trace * trace;
    }
    return 4e5 / 2 * (c[0] + 1 / c[1] - 3);  // mu/2 (I1 - 3)
  }

  double volume(const Eigen::Matrix3Xd& x, bool small) const {
    double sum = 0;
    for (const auto& face : mesh_.faces) {
      if (is_small(face) == small) {
        sum += corner(x, face, 0).dot(corner(x, face, 1).cross(corner(x, face, 2))) / 6;
      }
    }
    return sum;
  }

  /// Collective. @param before of the last row, or the present one
  TableRow row(const Eigen::Matrix3Xd& before, const Step& step, const StageClock& written) const {
    const Eigen::Matrix3Xd x = by_point(membrane_, state_.position.values(), mesh_.points.size());
    const Eigen::Matrix3Xd v = by_point(membrane_, state_.velocity.values(), mesh_.points.size());
    const Eigen::Vector2d v0(volume(rest_, false), volume(rest_, true));
    const Eigen::Vector2d now(volume(x, false), volume(x, true));
    const Eigen::Vector2d filled(1.01 + 0.3 * state_.time / (4 * h), 1.02 + 0.6 * state_.time / (4 * h));
    const Eigen::Vector2d temperature(310, 280 * std::pow(v0[1] / now[1], 0.4));
    const Eigen::Vector2d amount(filled[0] * ambient * v0[0] / (8.31446261815324 * 310),
                                 filled[1] * ambient * v0[1] / (8.31446261815324 * 280));
    const Eigen::Vector2d absolute(filled[0] * ambient * v0[0] / now[0],
                                   filled[1] * ambient * std::pow(v0[1] / now[1], 1.4));
    const auto mean = [&](const Eigen::Vector2d& values) { return values.dot(now) / now.sum(); };
    double rubber = 0;
    double initial_rubber = 0;
    double elastic = 0;
    double inverted = 0;
    double thinnest = HUGE_VAL;
    double thickest = 0;
    std::array<double, 2> ratio{HUGE_VAL, 0};         // of the thickness, least and largest
    std::array<double, 2> volume_ratio{HUGE_VAL, 0};  // of elements
    for (const auto& face : mesh_.faces) {
      const double initial = area(rest_, face).norm() * thickness_of(is_small(face));
      const double here = thickness(x, face);
      initial_rubber += initial;
      rubber += area(x, face).norm() * here;
      elastic += initial * energy_density(x, face);
      inverted += area(x, face).dot(area(before, face)) < 0 ? 1 : 0;
      thinnest = std::min(thinnest, here);
      thickest = std::max(thickest, here);
      const double of_thickness = here / thickness_of(is_small(face));
      ratio = {std::min(ratio[0], of_thickness), std::max(ratio[1], of_thickness)};
      const double of_volume = area(x, face).norm() * here / initial;
      volume_ratio = {std::min(volume_ratio[0], of_volume), std::max(volume_ratio[1], of_volume)};
    }
    TableRow row{{"time", state_.time},
                 {"step", state_.step},
                 {"time_step", state_.step == 0 ? 0 : h},
                 {"retries", state_.step % 3},
                 {"gas_volume", now.sum()},
                 {"gas_volume_ratio", now.sum() / v0.sum()},
                 {"gas_pressure", mean(absolute) - ambient},
                 {"gas_absolute_pressure", mean(absolute)},
                 {"gas_amount", amount.sum()},
                 {"gas_temperature", mean(temperature)},
                 {"rubber_volume_ratio", rubber / initial_rubber},
                 {"thickness_min", thinnest},
                 {"thickness_max", thickest},
                 {"thickness_ratio_min", ratio[0]},
                 {"thickness_ratio_max", ratio[1]},
                 {"element_volume_ratio_min", volume_ratio[0]},
                 {"element_volume_ratio_max", volume_ratio[1]},
                 {"inverted_elements", inverted},
                 {"newton_iterations", state_.step == 0 ? 0 : 1},
                 {"linear_iterations", step.motion_iterations},
                 {"concave_iterations", step.balance.concave_iterations},
                 {"elastic_energy", elastic},
                 {"gravity_work", gravity_work_},
                 {"damping_work", damping_work_},
                 {"pressure_work", pressure_work_},
                 {"kinetic_energy", mass_.dot(v.colwise().squaredNorm()) / 2},
                 {"momentum_x", mass_.dot(v.row(0))},
                 {"momentum_y", mass_.dot(v.row(1))},
                 {"momentum_z", mass_.dot(v.row(2))},
                 {"gas_volume_big", now[0]},
                 {"gas_volume_small", now[1]},
                 {"gas_pressure_big", absolute[0] - ambient},
                 {"gas_pressure_small", absolute[1] - ambient},
                 {"gas_amount_big", amount[0]},
                 {"gas_amount_small", amount[1]},
                 {"gas_temperature_big", temperature[0]},
                 {"gas_temperature_small", temperature[1]}};
    add_seconds(row, written);
    return row;
  }

  /// Norm of the forces that are left over at a state, with the gas at its pressure [N], and that over the largest norm
  /// of one kind of force. Collective.
  /// @param start positions and velocities at the beginning of the step
  std::pair<double, double> residual(const State& start) {
    Eigen::Matrix3Xd wall = Eigen::Matrix3Xd::Zero(3, membrane_.particles.owned);
    Eigen::Matrix3Xd gas = Eigen::Matrix3Xd::Zero(3, membrane_.particles.owned);
    balloons_.elements().add_gradient(state_.position, start.thickness_ratio, wall);
    for (int chamber = 0; chamber < 2; ++chamber) {
      gas += state_.pressure[chamber] * balloons_.chambers().volume_gradient(chamber, state_.position);
    }
    Eigen::Matrix<double, 6, 1> squares = Eigen::Matrix<double, 6, 1>::Zero();  // all together, then each kind
    for (PetscInt i = 0; i < membrane_.particles.owned; ++i) {
      const double m = mass_[membrane_.persistent_id[i]];
      const Eigen::Vector3d displacement = state_.position.vector(i) - start.position.vector(i);
      Eigen::Matrix<double, 3, 5> forces;
      forces << -wall.col(i), gas.col(i), m * options_.force.gravity,
          -m / (h * h) * (displacement - h * start.velocity.vector(i)), -m * damping / h * displacement;
      squares[0] += forces.rowwise().sum().squaredNorm();
      squares.tail<5>() += forces.colwise().squaredNorm().transpose();
    }
    MPI_Allreduce(MPI_IN_PLACE, squares.data(), 6, MPI_DOUBLE, MPI_SUM, PETSC_COMM_WORLD);
    return {std::sqrt(squares[0]), std::sqrt(squares[0] / squares.tail<5>().maxCoeff())};
  }

  /// Adds the works of a step, by the forces at its end. @param before positions at its start
  void add_work(const Eigen::Matrix3Xd& before) {
    const Eigen::Matrix3Xd x = by_point(membrane_, state_.position.values(), mesh_.points.size());
    const Eigen::Matrix3Xd moved = x - before;
    gravity_work_ += mass_.dot(options_.force.gravity.transpose() * moved);
    damping_work_ -= damping / h * mass_.dot(moved.colwise().squaredNorm());
    for (const auto& face : mesh_.faces) {
      const Eigen::Vector3d sum = moved.col(face[0]) + moved.col(face[1]) + moved.col(face[2]);
      pressure_work_ += state_.pressure[is_small(face) ? 1 : 0] * area(x, face).dot(sum) / 3;
    }
  }

  double gravity_work_ = 0;
  double damping_work_ = 0;
  double pressure_work_ = 0;
  SurfaceMesh mesh_;
  Options options_;
  StaticBalloon balloons_;
  const Membrane& membrane_ = balloons_.membrane();
  State& state_ = balloons_.state();
  Eigen::Matrix3Xd rest_;
  Eigen::RowVectorXd mass_ = Eigen::RowVectorXd::Zero(static_cast<Eigen::Index>(two_balls().points.size()));
};

INSTANTIATE_TEST_SUITE_P(Rules, BalloonTable, ::testing::Values("incompressible", "fixed"),
                         [](const auto& info) { return info.param; });

TEST_P(BalloonTable, HasWhatTheStateSays) {
  const TestFolder folder;
  options_.output.directory = folder / "out";
  options_.output.name = "balls";
  OneObject run(mesh_, options_, ChainKind::inflate);
  const StageClock& clock = run.clock();
  run.begin();
  std::vector<TableRow> history{row(rest_, {}, clock)};
  history.back()["residual"] = history.back()["relative_residual"] = 0;
  for (int k = 1; k <= 3; ++k) {
    run.keep();
    ASSERT_TRUE(run.advance(h).converged);
    run.accept(run.time());
    run.record(k % 3);

    State start(membrane_, balloons_.object.options(), static_cast<int>(state_.pressure.size()));
    start = state_;
    const AloneStep step = balloons_.advance(h);
    ASSERT_TRUE(step.converged) << step.reason;
    const Eigen::Matrix3Xd before = by_point(membrane_, start.position.values(), mesh_.points.size());
    add_work(before);
    history.push_back(row(before, step, clock));
    std::tie(history.back()["residual"], history.back()["relative_residual"]) = residual(start);
    EXPECT_GT(history.back()["residual"], 1e-6) << "too small to be told from rounding";
  }
  EXPECT_GT(history.back().at("gas_volume_ratio"), 1.02);
  MPI_Barrier(PETSC_COMM_WORLD);
  expect_table(read_csv(options_.output.directory + "/history.csv"), history, 1e-10);
}

TEST_P(BalloonTable, CountsWhatTurnsOverInAStep) {
  const TestFolder folder;
  options_.output.directory = folder / "out";
  options_.output.name = "balls";
  RunFolder run_folder(options_.output);
  run_folder.output.start();
  Object& object = balloons_.object;
  HistoryTables tables(run_folder.output, object, false);
  std::vector<TableRow> history;
  for (int k = 0; k < 3; ++k) {
    const Eigen::Matrix3Xd before = by_point(membrane_, state_.position.values(), mesh_.points.size());
    if (k > 0) {
      // The test puts the vertices where the step ends: in the first one a vertex goes through the big ball to beyond
      // the other side, in the second one all stay.
      state_.velocity.values().setZero();
      ASSERT_TRUE(object.begin(h).converged);
      StepPart& part = *object.motion().part();
      Field end(membrane_.particles, 3);
      end.values() = part.position().values();
      for (PetscInt i = 0; i < membrane_.particles.local() && k == 1; ++i) {
        if (membrane_.persistent_id[i] == 3) {
          end.vector(i) *= -1.5;
        }
      }
      part.move_to(end, part.own_unknowns());
      ASSERT_TRUE(object.end({}).converged);
      add_work(before);
    }
    tables.add_step(k);
    history.push_back(row(before, object.last_step(), object.clock()));
    for (const char* name : {"newton_iterations", "residual", "relative_residual"}) {
      history.back()[name] = 0;
    }
  }
  EXPECT_GT(history[1].at("inverted_elements"), 2);
  EXPECT_EQ(history[2].at("inverted_elements"), 0);
  MPI_Barrier(PETSC_COMM_WORLD);
  expect_table(read_csv(options_.output.directory + "/history.csv"), history, 1e-10);
}

}  // namespace
}  // namespace pellicle::balloon_ledger_test
