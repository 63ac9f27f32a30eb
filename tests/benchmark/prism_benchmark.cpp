// The linear algebra of an implicit step of an inflated balloon, by matrix type and kernel, on one rank:
//
//     OPENBLAS_NUM_THREADS=1 build/release/tests/benchmark_pellicle --benchmark_filter=prism/.*10242
//
// - product: K w; `times_triad` is the ratio of its shortest time to that of the bytes that it must read and write at
//   the bandwidth that a = b + s c reaches on as many bytes
// - update: the values of the tangent at new positions
// - solve: update, preconditioner and conjugate gradients to 1e-6 of M/h^2 + K and the gas, h = 10 ms, on a sphere
// - step: a step of the teddy, three Newton iterations, at half its inflation; its wall does not bend, as in the paper,
//   and linear solves are to 1e-4, those of the paper's to 1e-6 (input/paper_solver.yaml)
//
// Ratios within one run are what counts: a busy machine slows all alike.

#include <benchmark/benchmark.h>
#include <petscksp.h>

#include <cmath>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/error.h"
#include "energies/tangent.h"
#include "geometry/pressure_load.h"
#include "linear/ksp.h"
#include "meshing/closed_shapes.h"
#include "meshing/mesh_options.h"
#include "options/arguments.h"
#include "prism/wall.h"
#include "prism/wall_potential.h"
#include "surface/membrane.h"
#include "tests/benchmark/triad.h"
#include "tests/support/alone.h"
#include "world/options.h"

namespace pellicle {
namespace {

constexpr double pressure = 1400;  // [Pa]

/// An icosphere of radius 0.1 m, 0.3 mm thick, blown up to stretches of 1.2 to 1.5 and not yet at rest.
struct Inflated {
  explicit Inflated(int level)
      : membrane(make_membrane(PETSC_COMM_SELF, icosphere_mesh(level, 0.1), {})),
        wall(make_wall(membrane, {}, {})),
        elements(membrane, wall),
        positions(membrane.particles, 3) {
    for (PetscInt i = 0; i < membrane.particles.local(); ++i) {
      const Eigen::Vector3d rest = membrane.rest.col(i);
      positions.vector(i) = (1.35 + 0.12 * std::sin(40 * rest[0] + 1) * std::cos(30 * rest[2])) * rest;
    }
    thickness_ratio.assign(membrane.triangles.size(), 1.0);
    elements.update_thickness(positions, thickness_ratio);
    load_pressure.assign(membrane.triangles.size(), pressure);
    mass = vertex_masses(membrane, wall);
    volume_gradient = Eigen::Matrix3Xd::Zero(3, membrane.particles.local());
    for (const auto& [a, b, c] : membrane.triangles) {
      const Eigen::Vector3d fraction = area_vector(positions.vector(a), positions.vector(b), positions.vector(c)) / 3;
      volume += enclosed_volume(positions.vector(a), positions.vector(b), positions.vector(c));
      for (const PetscInt i : {a, b, c}) {
        volume_gradient.col(i) += fraction;
      }
    }
    force = -pressure * volume_gradient;
    elements.add_gradient(positions, thickness_ratio, force);
    force = -force;
  }

  Membrane membrane;
  Wall wall;
  PrismElements elements;
  Field positions;
  std::vector<double> thickness_ratio;
  std::vector<double> load_pressure;
  double volume = 0;                 ///< of the gas [m^3]
  Eigen::Matrix3Xd volume_gradient;  ///< [m^2]
  std::vector<double> mass;          ///< of the vertices [kg]
  Eigen::Matrix3Xd force;            ///< elastic and of the gas [N]
};

/// What is made once and must die before PETSc ends.
template <class Key, class Value>
class Made {
 public:
  static const Value& of(const Key& key) {
    auto& place = values()[key];
    if (place == nullptr) {
      place = std::make_unique<Value>(key);
      check(PetscRegisterFinalize([]() -> PetscErrorCode {
        values().clear();
        return 0;
      }));
    }
    return *place;
  }

 private:
  static std::map<Key, std::unique_ptr<Value>>& values() {
    static std::map<Key, std::unique_ptr<Value>> made;
    return made;
  }
};

const Inflated& balloon(int level) { return Made<int, Inflated>::of(level); }

/// PETSc options, without their prefix `prism_`.
using PetscChoice = std::vector<std::pair<std::string, std::string>>;

void set(const PetscChoice& choice) {
  for (const auto& [name, value] : choice) {
    check(PetscOptionsSetValue(nullptr, ("-prism_" + name).c_str(), value.c_str()));
  }
}

void clear(const PetscChoice& choice) {
  for (const auto& [name, value] : choice) {
    check(PetscOptionsClearValue(nullptr, ("-prism_" + name).c_str()));
  }
}

PrismOptions options_of(const std::string& mat_type, const std::string& tangent) {
  PrismOptions options;
  options.mat_type = mat_type;
  options.tangent = tangent;
  return options;
}

/// K of the wall and M (1/h^2 + 20/(s h)), inertia and damping of a step of 10 ms.
struct InflatedTangent {
  /// @param loads whether the exact tangent of the gas is wanted
  InflatedTangent(const Inflated& given, const PrismOptions& options, bool loads)
      : inflated(given),
        wall(given.elements, options),
        damping(given.elements, given.mass, inertia_too(options)),
        tangent(given.membrane.particles, {&wall, &damping}, Projectors(given.membrane.persistent_id.size()),
                options.mat_type, "prism_") {
    wall.set_thickness(given.thickness_ratio);
    wall.set_load(loads ? given.load_pressure : std::vector<double>());
    damping.begin_step(given.positions, given.thickness_ratio, given.positions.values(), 1 / h);
  }

  void update() { tangent.update(inflated.positions, Curvature::exact); }
  Mat matrix() const { return tangent.matrix(); }

 private:
  static PrismOptions inertia_too(PrismOptions options) {
    options.mass_damping = 20 + 1 / h;
    return options;
  }

  static constexpr double h = 0.01;  // [s]
  const Inflated& inflated;
  WallPotential wall;
  DampingPotential damping;
  Tangent tangent;
};

/// Bytes that a product must read or write once: its matrix or the elements' data, argument, result, vertex blocks.
double product_bytes(const Inflated& inflated, const std::string& mat_type, const std::string& tangent) {
  const double vertices = inflated.membrane.particles.owned;
  const double elements = inflated.membrane.elements.owned;
  const double vectors = 48 * vertices;
  const double blocks = vertices + 3 * elements;  // a vertex and both directions of 3/2 edges an element
  if (mat_type == "baij") {
    return vectors + 76 * blocks;
  }
  if (mat_type == "aij") {
    return vectors + 9 * 12 * blocks;
  }
  if (mat_type == "sbaij") {
    return vectors + 76 * (blocks + vertices) / 2;
  }
  const double element_bytes = tangent == "exact" ? sizeof(StiffnessBatch) / 8.0 : 300;
  return vectors + 72 * vertices + element_bytes * elements;
}

void product(benchmark::State& state, const std::string& mat_type, const std::string& tangent_name, int level) {
  const Inflated& inflated = balloon(level);
  InflatedTangent tangent(inflated, options_of(mat_type, tangent_name), true);
  tangent.update();
  time_products(state, tangent.matrix(), product_bytes(inflated, mat_type, tangent_name));
}

void update(benchmark::State& state, const std::string& mat_type, const std::string& tangent_name, int level) {
  const Inflated& inflated = balloon(level);
  InflatedTangent tangent(inflated, options_of(mat_type, tangent_name), true);
  for (auto _ : state) {
    tangent.update();
  }
}

/// A choice of matrix and solver.
struct Solver {
  std::string name;
  std::string mat_type;
  std::string tangent;
  PetscChoice petsc;
  bool reuse = false;  ///< the preconditioner of the first solve
};

void linear_solve(benchmark::State& state, const Solver& solver, int level) {
  const Inflated& inflated = balloon(level);
  const bool exact = solver.tangent != "paper";
  InflatedTangent tangent(inflated, options_of(solver.mat_type, solver.tangent), exact);
  tangent.update();
  // The gas: p V constant, -dp/dV = p/V, a third of it in the paper's tangent.
  MatHandle column, system;
  VecHandle slope;
  Eigen::Matrix3Xd gradient = inflated.volume_gradient;
  check(
      MatCreateSeqDense(PETSC_COMM_SELF, static_cast<PetscInt>(gradient.size()), 1, gradient.data(), column.create()));
  check(VecCreateSeq(PETSC_COMM_SELF, 1, slope.create()));
  check(VecSet(slope, pressure / inflated.volume / (exact ? 1 : 3)));
  check(MatCreateLRC(tangent.matrix(), column, slope, nullptr, system.create()));
  set(solver.petsc);
  VecHandle x, b;
  check(MatCreateVecs(tangent.matrix(), x.create(), b.create()));
  double* values = nullptr;
  check(VecGetArrayWrite(b, &values));
  Eigen::Map<Eigen::Matrix3Xd>(values, 3, inflated.membrane.particles.owned) = inflated.force;
  check(VecRestoreArrayWrite(b, &values));
  KspDefaults defaults;
  defaults.preconditioner = PCPBJACOBI;
  defaults.rtol = 1e-6;
  defaults.max_iterations = 10000;
  KspHandle ksp = make_ksp(system, tangent.matrix(), "prism_", defaults);
  StageResult result = solve(ksp, b, x);
  if (solver.reuse) {
    check(KSPSetReusePreconditioner(ksp, PETSC_TRUE));
  }
  for (auto _ : state) {
    tangent.update();
    result = solve(ksp, b, x);
  }
  if (!result.converged) {
    state.SkipWithError(result.reason.c_str());
  }
  state.counters["iterations"] = result.iterations;
  clear(solver.petsc);
}

std::vector<Solver> solvers() {
  return {{"paper", "shell", "paper", {{"pc_type", "none"}}},
          {"gradient", "shell", "gradient", {{"pc_type", "none"}}},
          {"none", "baij", "exact", {{"pc_type", "none"}}},
          {"pbjacobi", "baij", "exact", {}},
          {"shell", "shell", "exact", {}},
          {"icc", "sbaij", "exact", {{"pc_type", "icc"}}},
          {"gamg", "aij", "exact", {{"pc_type", "gamg"}}, true}};
}

/// The paper's balloon of the deck's mesh, with p0 V0/V up to 7 kPa in half a second.
Options balloon_options(const std::string& deck) {
  Options options;
  OptionTable table;
  describe(table, options);
  const std::string path = std::string(PELLICLE_SOURCE_DIR) + "/input/" + deck + ".yaml";
  read_arguments(PETSC_COMM_SELF, {path}, table, [](const std::string&) -> OptionTable& { throw Error("objects"); });
  options.time.step = 0.01;
  options.force.gravity.setZero();
  options.prism = PrismOptions{};
  options.prism.newton = "fixed";
  options.prism.max_iterations = 3;
  options.wall = WallOptions{};
  options.wall.bending = "none";
  options.chambers = {{"gas", ChamberOptions{}}};
  options.chambers["gas"].pressure = {{0, 0}, {0.5, 7000}};
  return options;
}

/// A balloon after 0.2 s.
struct HalfBlown {
  explicit HalfBlown(const std::string& deck)
      : options(balloon_options(deck)),
        mesh(make_checked_mesh(options.mesh).mesh),
        membrane(make_membrane(PETSC_COMM_SELF, mesh, options.sheet)),
        state(membrane.particles, membrane.elements.local()) {
    Options converging = options;  // while the wall is slack, three iterations are too few
    converging.prism.newton = "converged";
    converging.prism.max_iterations = 100;
    Alone balloon(mesh, converging, ChainKind::inflate, PETSC_COMM_SELF);
    for (int step = 0; step < 20; ++step) {
      const AloneStep result = balloon.advance(options.time.step);
      if (!result.converged) {
        throw Error("a step of the benchmark failed: " + result.reason);
      }
    }
    state = balloon.state();
  }

  Options options;
  SurfaceMesh mesh;
  Membrane membrane;
  FieldRegistry state;
};

/// A way to make a step.
struct Way {
  std::string name;
  std::string mat_type;
  std::string tangent;
  std::string gas_tangent;
  PetscChoice petsc;
  std::optional<double> ksp_rtol = std::nullopt;
};

void step(benchmark::State& state, const Way& displacement, const std::string& deck) {
  const HalfBlown& half_blown = Made<std::string, HalfBlown>::of(deck);
  Options options = half_blown.options;
  options.prism.mat_type = displacement.mat_type;
  options.prism.tangent = displacement.tangent;
  options.gas.tangent = displacement.gas_tangent;
  options.prism.ksp_rtol = displacement.ksp_rtol;
  set(displacement.petsc);
  Alone balloon(half_blown.mesh, options, ChainKind::inflate, PETSC_COMM_SELF);
  AloneStep result;
  const auto advance = [&] {
    balloon.state() = half_blown.state;
    result = balloon.advance(options.time.step);
  };
  advance();  // The first one also makes what is kept from step to step.
  for (auto _ : state) {
    advance();
  }
  if (!result.converged) {
    state.SkipWithError(result.reason.c_str());
  }
  state.counters["newton"] = result.newton_iterations;
  state.counters["iterations"] = result.motion_iterations;
  state.counters["residual"] = result.balance.residual;
  clear(displacement.petsc);
}

[[maybe_unused]] const bool prism_registered = [] {
  const auto add = [](const std::string& name, auto&&... arguments) {
    benchmark::RegisterBenchmark(("prism/" + name).c_str(), arguments...)->Unit(benchmark::kMillisecond);
  };
  for (const auto& [level, vertices] : {std::pair{5, "10242/"}, {7, "163842/"}}) {
    const std::string size = vertices;
    for (const char* type : {"baij", "aij", "sbaij", "shell"}) {
      add("product/" + size + type, product, type, "exact", level);
      add("update/" + size + type, update, type, "exact", level);
    }
    for (const char* tangent : {"gradient", "paper"}) {
      add("product/" + size + tangent, product, "shell", tangent, level);
      add("update/" + size + tangent, update, "shell", tangent, level);
    }
    for (const Solver& solver : solvers()) {
      add("solve/" + size + solver.name, linear_solve, solver, level);
    }
  }
  const Way ours{
      "ours", PrismOptions{}.mat_type.name(), PrismOptions{}.tangent.name(), GasOptions{}.tangent.name(), {}};
  const Way paper{"paper", "shell", "paper", "paper", {{"pc_type", "none"}}, 1e-6};
  const Way pbjacobi{"pbjacobi", "baij", "exact", "exact", {{"pc_type", "pbjacobi"}}};
  for (const Way& displacement : {paper, pbjacobi, ours}) {
    add("step/teddy/" + displacement.name, step, displacement, "teddy");
  }
  return true;
}();

}  // namespace
}  // namespace pellicle
