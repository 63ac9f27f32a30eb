#include "world/implicit_step.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>

#include "base/error.h"
#include "solvers/ksp.h"

namespace pellicle {

namespace {

/// How often a Newton step may be halved.
constexpr int max_halvings = 20;

/// What a residual is compared with at least, over ImplicitStep's force scale: a balloon at rest has no forces.
constexpr double negligible_force = 1e-6;

/// The kinds of force of which the residual is the sum.
enum ForceKind { of_wall, of_gas, of_inertia, of_drag, of_weight, of_loads, force_kinds };

double sum_over_ranks(MPI_Comm comm, double value) {
  MPI_Allreduce(MPI_IN_PLACE, &value, 1, MPI_DOUBLE, MPI_SUM, comm);
  return value;
}

/// Share of dV/dx dV/dx^T dp/dV that a tangent takes: the paper's 1/27 is a third of the exact 1/9 (eq. 16).
double rank_one_share(const std::string& gas_tangent) { return gas_tangent == "paper" ? 1.0 / 3 : 1.0; }

/// Tells algebraic multigrid what moves the wall without stretching it: the rigid motions.
void attach_rigid_motions(Mat tangent, const Membrane& membrane) {
  VecHandle coordinates;
  check(VecCreateMPI(membrane.comm(), 3 * membrane.particles.owned, PETSC_DETERMINE, coordinates.create()));
  check(VecSetBlockSize(coordinates, 3));
  double* values = nullptr;
  check(VecGetArray(coordinates, &values));
  std::copy_n(membrane.rest.data(), 3 * membrane.particles.owned, values);
  check(VecRestoreArray(coordinates, &values));
  Handle<MatNullSpace, MatNullSpaceDestroy> motions;
  check(MatNullSpaceCreateRigidBody(coordinates, motions.create()));
  check(MatSetNearNullSpace(tangent, motions));
}

}  // namespace

ImplicitStep::ImplicitStep(const BalloonModel& model, const PrismOptions& options)
    : model_(model),
      options_(options),
      tangent_(model.elements, options, model.constraints.projectors()),
      start_(model.elements.membrane().particles, 3),
      position_(model.elements.membrane().particles, 3),
      displacement_(model.elements.membrane().particles, 3),
      predicted_(3, owned()),
      gradients_(3 * owned(), model.chambers.count()) {
  const Membrane& membrane = model_.elements.membrane();
  MPI_Comm_rank(membrane.comm(), &rank_);
  for (int chamber = 0; chamber < model_.chambers.count(); ++chamber) {
    if (model_.chambers.prescribes_volume(chamber)) {
      bordered_chambers_.push_back(chamber);
    }
  }
  multiplier_.setZero(bordered());
  gas_.resize(static_cast<std::size_t>(model_.chambers.count()));

  // The energy of the wall half as long again, over the square root of its area: what its forces are like. Taken from a
  // small stretch, since not every material can go that far.
  constexpr double strain = 1e-3;
  double sums[2] = {0, 0};
  for (std::size_t e = 0; e < static_cast<std::size_t>(membrane.elements.owned); ++e) {
    sums[0] += model_.elements.wall().rest[e].area;
  }
  position_.values() = (1 + strain) * membrane.rest;
  sums[1] = model_.elements.energy(position_, std::vector<double>(membrane.triangles.size(), 1.0));
  MPI_Allreduce(MPI_IN_PLACE, sums, 2, MPI_DOUBLE, MPI_SUM, membrane.comm());
  length_scale_ = std::sqrt(sums[0]);
  force_scale_ = sums[1] * std::pow(0.5 / strain, 2) / length_scale_;
  make_solver();
}

void ImplicitStep::make_solver() {
  const Membrane& membrane = model_.elements.membrane();
  const MPI_Comm comm = membrane.comm();
  Mat tangent = tangent_.matrix();
  const int chambers = model_.chambers.count();
  attach_rigid_motions(tangent, membrane);
  Mat amat = tangent;
  if (chambers > 0) {
    check(VecCreateSeq(PETSC_COMM_SELF, chambers, gas_coefficients_.create()));
    check(MatCreateDense(comm, 3 * owned(), PETSC_DECIDE, PETSC_DETERMINE, chambers, gradients_.data(),
                         gas_columns_.create()));
    check(MatCreateLRC(tangent, gas_columns_, gas_coefficients_, nullptr, low_rank_.create()));
    amat = low_rank_;
  }
  KspDefaults defaults;
  // Multigrid needs every entry, and a tangent that is positive definite by itself: without inertia the balloon's rigid
  // motions are all but free, and beyond a limit point only the volume that is prescribed holds it.
  if (options_.mat_type == "sbaij") {
    defaults.preconditioner = PCBJACOBI;
  } else if (options_.mat_type == "shell" || !options_.inertia || bordered() > 0) {
    defaults.preconditioner = PCPBJACOBI;
  } else {
    defaults.preconditioner = PCMG;
  }
  defaults.rtol = options_.ksp_rtol;
  defaults.max_iterations = 10000;
  solver_ = make_ksp(amat, tangent, "prism_", defaults);
  patches_ = RigidPatches::of(solver_, tangent, membrane, model_.constraints.projectors(), options_.patch_size);
  KSPType type = nullptr;
  check(KSPGetType(solver_, &type));
  solves_once_ = chambers > 0 && std::string(type) == KSPPREONLY;
  if (solves_once_) {
    check(KSPSetOperators(solver_, tangent, tangent));
  }
  check(MatCreateVecs(tangent, part_.create(), part_solution_.create()));
  if (bordered() > 0) {
    const PetscInt rows = 3 * owned() + (rank_ == 0 ? bordered() : 0);
    check(VecCreateMPI(comm, rows, PETSC_DETERMINE, unknowns_.create()));
    check(MatCreateShell(comm, rows, rows, PETSC_DETERMINE, PETSC_DETERMINE, this, bordered_matrix_.create()));
    check(MatShellSetOperation(bordered_matrix_, MATOP_MULT,
                               reinterpret_cast<void (*)()>(&ImplicitStep::bordered_product_callback)));
    for (int border = 0; border < bordered(); ++border) {
      check(VecDuplicate(part_, influence_.emplace_back().create()));
    }
    amat = bordered_matrix_;
  } else {
    check(VecDuplicate(part_, unknowns_.create()));
  }
  check(VecDuplicate(unknowns_, residual_.create()));
  make_newton(amat);
}

/// Makes SNES. What it takes for its linear solver is solve_newton: `solver_`, and what it needs round it.
void ImplicitStep::make_newton(Mat system) {
  const MPI_Comm comm = model_.elements.membrane().comm();
  require_known_newton();
  KspHandle outer;
  PC pc = nullptr;
  check(KSPCreate(comm, outer.create()));
  check(KSPSetOptionsPrefix(outer, "prism_newton_"));
  check(KSPSetType(outer, KSPPREONLY));
  check(KSPSetTolerances(outer, options_.ksp_rtol, PETSC_DEFAULT, PETSC_DEFAULT, PETSC_DEFAULT));
  check(KSPGetPC(outer, &pc));
  check(PCSetType(pc, PCSHELL));
  check(PCShellSetContext(pc, this));
  check(PCShellSetApply(pc, solve_callback));
  check(SNESCreate(comm, snes_.create()));
  check(SNESSetOptionsPrefix(snes_, "prism_"));
  check(SNESSetKSP(snes_, outer));
  check(SNESSetJacobian(snes_, system, system, jacobian_callback, this));
  check(SNESSetFunction(snes_, residual_, residual_callback, this));

  // Rounding of positions alone leaves some 3 to 4 epsilon times this: it does not shrink with the elements, since
  // their stiffness does not either. A balloon at rest ends its steps here.
  const double vertices = static_cast<double>(model_.elements.membrane().particles.global);
  rounding_ = 20 * std::numeric_limits<double>::epsilon() * force_scale_ * std::sqrt(vertices);
  check(SNESSetTolerances(snes_, rounding_, options_.snes_rtol, 1e-13, options_.max_iterations, PETSC_DEFAULT));
  SNESLineSearch search = nullptr;
  check(SNESGetLineSearch(snes_, &search));
  check(SNESLineSearchSetType(search, options_.line_search ? SNESLINESEARCHSHELL : SNESLINESEARCHBASIC));
  if (options_.line_search) {
    check(SNESLineSearchShellSetUserFunc(search, line_search_callback, this));
  }
  run_solver("prism_", [&] { check(SNESSetFromOptions(snes_)); });
}

/// Refuses nonlinear solvers and Jacobians that would pass the tangent by, or most of what makes a step safe.
void ImplicitStep::require_known_newton() const {
  char type[64] = SNESNEWTONLS;
  check(PetscOptionsGetString(nullptr, "prism_", "-snes_type", type, sizeof type, nullptr));
  const std::vector<std::string> known{SNESNEWTONLS, SNESNEWTONTR, SNESKSPONLY};
  if (std::find(known.begin(), known.end(), type) == known.end()) {
    throw Error(std::string("-prism_snes_type ") + type +
                ": an implicit step is Newton's method with its own tangent, expected newtonls, newtontr or ksponly");
  }
  for (const char* option : {"-snes_mf", "-snes_mf_operator", "-snes_fd", "-snes_fd_color"}) {
    PetscBool is_set = PETSC_FALSE;
    check(PetscOptionsGetBool(nullptr, "prism_", option, &is_set, nullptr));
    if (is_set == PETSC_TRUE) {
      throw Error(std::string("-prism_") + (option + 1) +
                  ": an implicit step has its own tangent, expected prism.tangent or prism.mat_type shell");
    }
  }
}

ImplicitResult ImplicitStep::advance(BalloonState& state, double h) {
  const MPI_Comm comm = model_.elements.membrane().comm();
  h_ = h;
  time_end_ = state.time + h;
  thickness_ratio_ = state.thickness_ratio;
  start_.values() = state.position.values();
  model_.loads.begin_step(start_, time_end_, h);
  if (options_.stiffness_damping > 0) {
    tangent_.lag(start_, thickness_ratio_);
  }

  // x^n + h v^n, held vertices in their places; x^n alone if that turns an element over or is more than one can bear.
  const std::vector<Eigen::Matrix3d>& projectors = model_.constraints.projectors();
  const auto start_from = [&](double share) {
    for (PetscInt i = 0; i < position_.values().cols(); ++i) {
      position_.vector(i) =
          start_.vector(i) + share * h * (projectors[static_cast<std::size_t>(i)] * state.velocity.vector(i));
    }
    model_.pins.impose(position_, time_end_);
  };
  start_from(1);
  predicted_ = position_.values().leftCols(owned());
  if (sum_over_ranks(comm, static_cast<double>(model_.elements.inverted(start_, position_))) > 0 ||
      !std::isfinite(sum_over_ranks(comm, model_.elements.energy(position_, thickness_ratio_)))) {
    start_from(0);
  }
  for (int border = 0; border < bordered(); ++border) {
    multiplier_[border] = state.pressure[bordered_chambers_[static_cast<std::size_t>(border)]];
  }
  set_unknowns(unknowns_);

  linear_failure_.clear();
  bad_options_.clear();
  start_residual_.reset();
  linear_iterations_ = 0;
  concave_iterations_ = 0;
  try {
    run_solver("prism_", [&] { check(SNESSolve(snes_, nullptr, unknowns_)); });
  } catch (const PetscFailure&) {
    if (!bad_options_.empty()) {
      throw Error(bad_options_);
    }
    throw;
  }

  ImplicitResult result;
  SNESConvergedReason reason = SNES_CONVERGED_ITERATING;
  PetscInt newton = 0;
  check(SNESGetConvergedReason(snes_, &reason));
  check(SNESGetIterationNumber(snes_, &newton));
  result.newton_iterations = static_cast<int>(newton);
  result.linear_iterations = linear_iterations_;
  result.concave_iterations = concave_iterations_;
  result.converged = reason > 0 || (options_.newton == "fixed" && reason == SNES_DIVERGED_MAX_IT);
  if (!result.converged) {
    result.reason = words_of_failure(reason);
    return result;
  }
  judge(reason, result);
  if (!result.converged) {
    return result;
  }
  state.position.values() = position_.values();
  for (int border = 0; border < bordered(); ++border) {
    state.pressure[bordered_chambers_[static_cast<std::size_t>(border)]] = multiplier_[border];
  }
  return result;
}

/// What is left of the forces where SNES has ended, which it took for an end: whether it is one.
void ImplicitStep::judge(SNESConvergedReason reason, ImplicitResult& result) {
  const MPI_Comm comm = model_.elements.membrane().comm();
  read_unknowns(unknowns_);
  compute_residual(residual_);  // SNES need not have done so here: with ksponly it has not.
  check(VecNorm(residual_, NORM_2, &result.residual));
  MPI_Allreduce(MPI_IN_PLACE, squared_forces_.data(), force_kinds, MPI_DOUBLE, MPI_SUM, comm);
  const double largest = std::sqrt(*std::max_element(squared_forces_.begin(), squared_forces_.end()));
  result.relative_residual = result.residual / std::max(largest, negligible_force * force_scale_);
  result.is_above_tolerance = result.residual > rounding_ && result.relative_residual > options_.residual_tolerance;
  const double start = start_residual_.value_or(0);
  char text[200] = "";
  if (!(result.residual <= std::max(start, rounding_))) {
    std::snprintf(text, sizeof text, "Newton's iterations made the residual grow, from %.2e N to %.2e N", start,
                  result.residual);
  } else if (reason == SNES_CONVERGED_SNORM_RELATIVE && options_.newton == "converged" && result.is_above_tolerance) {
    std::snprintf(text, sizeof text, "Newton's method goes no further at a residual of %.2e N, %.1e of the forces",
                  result.residual, result.relative_residual);
  }
  result.converged = text[0] == '\0';
  result.reason = text;
}

std::string ImplicitStep::words_of_failure(SNESConvergedReason reason) const {
  if (!linear_failure_.empty()) {
    return linear_failure_;
  }
  PetscInt iterations = 0;
  double norm = 0;
  check(SNESGetIterationNumber(snes_, &iterations));
  check(SNESGetFunctionNorm(snes_, &norm));
  char text[200];
  std::string words;
  switch (reason) {
    case SNES_DIVERGED_LINE_SEARCH:
      words = "no part of Newton's step lowers the potential without turning elements over";
      break;
    case SNES_DIVERGED_FNORM_NAN:
    case SNES_DIVERGED_FUNCTION_DOMAIN:
      words = "the forces are not finite: an element has collapsed, or a chamber has no volume left";
      break;
    case SNES_DIVERGED_MAX_IT:
      std::snprintf(text, sizeof text,
                    "Newton's method did not converge in %d iterations (residual %.2e N): no equilibrium near, or the "
                    "step is too long",
                    static_cast<int>(iterations), norm);
      words = text;
      break;
    default:
      words = std::string("Newton's method did not converge (") + SNESConvergedReasons[reason] + ")";
  }
  if (concave_iterations_ > 0) {
    words +=
        "; the tangent is not positive definite: there is no stable equilibrium near, as beyond the highest pressure "
        "that the balloon can hold (to go there prescribe its volume or its amount of gas), or the step is too long";
  }
  return words;
}

void ImplicitStep::set_unknowns(Vec unknowns) const {
  double* values = nullptr;
  check(VecGetArray(unknowns, &values));
  std::copy_n(position_.data(), 3 * owned(), values);
  if (rank_ == 0) {
    for (int border = 0; border < bordered(); ++border) {
      values[3 * owned() + border] = multiplier_[border] / pressure_scale(border);
    }
  }
  check(VecRestoreArray(unknowns, &values));
}

void ImplicitStep::read_unknowns(Vec unknowns) {
  const double* values = nullptr;
  check(VecGetArrayRead(unknowns, &values));
  std::copy_n(values, 3 * owned(), position_.data());
  if (rank_ == 0) {
    for (int border = 0; border < bordered(); ++border) {
      multiplier_[border] = values[3 * owned() + border] * pressure_scale(border);
    }
  }
  check(VecRestoreArrayRead(unknowns, &values));
  if (bordered() > 0) {
    MPI_Bcast(multiplier_.data(), bordered(), MPI_DOUBLE, 0, model_.elements.membrane().comm());
  }
  position_.update_ghosts();
}

double ImplicitStep::pressure_scale(int border) const {
  return force_scale_ / model_.chambers.initial_volume(bordered_chambers_[static_cast<std::size_t>(border)]);
}

double ImplicitStep::excess_volume(int border) const {
  const int chamber = bordered_chambers_[static_cast<std::size_t>(border)];
  return volumes_[chamber] - model_.chambers.prescribed_volume(chamber, time_end_);
}

void ImplicitStep::evaluate_gas() {
  volumes_ = model_.chambers.volumes(position_);
  for (int chamber = 0; chamber < model_.chambers.count(); ++chamber) {
    gas_[static_cast<std::size_t>(chamber)] = model_.chambers.state(chamber, volumes_[chamber], time_end_);
  }
  for (int border = 0; border < bordered(); ++border) {
    gas_[static_cast<std::size_t>(bordered_chambers_[static_cast<std::size_t>(border)])].pressure = multiplier_[border];
  }
}

void ImplicitStep::compute_residual(Vec residual) {
  evaluate_gas();
  Eigen::Matrix3Xd wall = Eigen::Matrix3Xd::Zero(3, owned());
  Eigen::Matrix3Xd gas = Eigen::Matrix3Xd::Zero(3, owned());
  Eigen::Matrix3Xd damping = Eigen::Matrix3Xd::Zero(3, owned());
  model_.elements.add_force(position_, thickness_ratio_, wall);
  for (int chamber = 0; chamber < model_.chambers.count(); ++chamber) {
    gas += gas_[static_cast<std::size_t>(chamber)].pressure * model_.chambers.volume_gradient(chamber, position_);
  }
  if (options_.stiffness_damping > 0) {
    displacement_.values() = position_.values() - start_.values();
    tangent_.add_lagged_product(-options_.stiffness_damping / h_, displacement_, damping);
  }
  squared_forces_.assign(force_kinds, 0);
  double* values = nullptr;
  check(VecGetArray(residual, &values));
  for (PetscInt i = 0; i < owned(); ++i) {
    const auto index = static_cast<std::size_t>(i);
    const double mass = model_.mass[index];
    const auto x = position_.vector(i);
    Eigen::Matrix<double, 3, force_kinds> forces;
    forces.col(of_wall) = wall.col(i);
    forces.col(of_gas) = gas.col(i);
    forces.col(of_inertia).setZero();
    if (options_.inertia) {
      forces.col(of_inertia) = -mass / (h_ * h_) * (x - predicted_.col(i));
    }
    forces.col(of_drag) = damping.col(i) - options_.mass_damping * mass / h_ * (x - start_.vector(i));
    forces.col(of_weight) = mass * model_.gravity;
    forces.col(of_loads).setZero();
    if (!model_.loads.empty()) {
      forces.col(of_loads) = -model_.loads.at(i, x).gradient;
    }
    forces = (model_.constraints.projectors()[index] * forces).eval();
    for (int kind = 0; kind < force_kinds; ++kind) {
      squared_forces_[static_cast<std::size_t>(kind)] += forces.col(kind).squaredNorm();
    }
    Eigen::Map<Eigen::Vector3d>(values + 3 * i) = -forces.rowwise().sum();
  }
  if (rank_ == 0) {
    for (int border = 0; border < bordered(); ++border) {
      values[3 * owned() + border] = -pressure_scale(border) * excess_volume(border);
    }
  }
  check(VecRestoreArray(residual, &values));
}

void ImplicitStep::compute_jacobian() {
  const bool renews_patches = patches_ && patches_->due();
  if (renews_patches || positive_ != nullptr) {
    compute_tangent(Tangent::positive);
    if (renews_patches) {
      patches_->renew();
    }
    if (positive_ != nullptr) {
      check(MatCopy(tangent_.matrix(), positive_, SAME_NONZERO_PATTERN));
    }
  }
  compute_tangent(Tangent::exact);
}

void ImplicitStep::compute_tangent(Tangent kind) {
  const bool positive = kind == Tangent::positive;
  evaluate_gas();
  const Membrane& membrane = model_.elements.membrane();
  std::vector<double> load_pressure;
  if (model_.gas_tangent == "exact" && model_.chambers.count() > 0) {
    load_pressure.resize(membrane.triangles.size());
    for (std::size_t e = 0; e < load_pressure.size(); ++e) {
      const int chamber = model_.chambers.of_element(static_cast<PetscInt>(e));
      load_pressure[e] = chamber >= 0 ? gas_[static_cast<std::size_t>(chamber)].pressure : 0;
    }
  }
  std::vector<Eigen::Matrix3d> blocks(static_cast<std::size_t>(owned()));
  for (PetscInt i = 0; i < owned(); ++i) {
    const auto index = static_cast<std::size_t>(i);
    const double mass = model_.mass[index];
    blocks[index] =
        (options_.mass_damping * mass / h_ + (options_.inertia ? mass / (h_ * h_) : 0)) * Eigen::Matrix3d::Identity();
    if (!model_.loads.empty()) {
      blocks[index] += model_.loads.at(i, position_.vector(i)).hessian;
    }
  }
  tangent_.update({position_, thickness_ratio_, load_pressure, model_.constraints.origin(), blocks,
                   options_.stiffness_damping / h_, positive});

  gas_influence_.clear();
  if (model_.chambers.count() == 0) {
    return;
  }
  double* coefficients = nullptr;
  check(VecGetArray(gas_coefficients_, &coefficients));
  for (int chamber = 0; chamber < model_.chambers.count(); ++chamber) {
    Eigen::Matrix3Xd gradient = model_.chambers.volume_gradient(chamber, position_);
    for (PetscInt i = 0; i < owned(); ++i) {
      gradient.col(i) = model_.constraints.projectors()[static_cast<std::size_t>(i)] * gradient.col(i);
    }
    gradients_.col(chamber) = gradient.reshaped();
    const GasState& gas = gas_[static_cast<std::size_t>(chamber)];
    const double stiffness = model_.chambers.prescribes_volume(chamber)
                                 ? bordering_stiffness(chamber)
                                 : -rank_one_share(model_.gas_tangent) * gas.pressure_slope;
    coefficients[chamber] = positive ? std::max(stiffness, 0.0) : stiffness;
  }
  check(VecRestoreArray(gas_coefficients_, &coefficients));
  check(MatAssemblyBegin(gas_columns_, MAT_FINAL_ASSEMBLY));
  check(MatAssemblyEnd(gas_columns_, MAT_FINAL_ASSEMBLY));
}

/// rho of A + rho g g^T: several times what the pressure can fall with the volume beyond a limit point.
double ImplicitStep::bordering_stiffness(int chamber) const {
  const double volume = std::abs(volumes_[chamber]);
  const double pressure = std::abs(gas_[static_cast<std::size_t>(chamber)].pressure);
  return 10 * (pressure + force_scale_ / std::pow(volume, 2.0 / 3)) / volume;
}

double ImplicitStep::potential() const {
  double sum = model_.elements.energy(position_, thickness_ratio_);
  for (PetscInt i = 0; i < owned(); ++i) {
    const double mass = model_.mass[static_cast<std::size_t>(i)];
    const auto x = position_.vector(i);
    sum += options_.mass_damping * mass / (2 * h_) * (x - start_.vector(i)).squaredNorm();
    sum -= mass * model_.gravity.dot(x - start_.vector(i));
    if (options_.inertia) {
      sum += mass / (2 * h_ * h_) * (x - predicted_.col(i)).squaredNorm();
    }
    if (!model_.loads.empty()) {
      sum += model_.loads.at(i, x).value;
    }
  }
  if (options_.stiffness_damping > 0) {
    Eigen::Matrix3Xd product = Eigen::Matrix3Xd::Zero(3, owned());
    tangent_.add_lagged_product(options_.stiffness_damping / h_, displacement_, product);
    sum += product.cwiseProduct(displacement_.values().leftCols(owned())).sum() / 2;
  }
  sum = sum_over_ranks(model_.elements.membrane().comm(), sum);
  for (int chamber = 0; chamber < model_.chambers.count(); ++chamber) {
    if (!model_.chambers.prescribes_volume(chamber)) {
      sum += gas_[static_cast<std::size_t>(chamber)].potential;
    }
  }
  return sum;
}

/// Steps back from Newton's step until no element turns over and the potential falls; with prescribed volumes the
/// potential and what the multipliers make of the volumes' errors. @returns whether a step was found; X, F are then
/// there.
bool ImplicitStep::search_line(SNESLineSearch search) {
  Vec x = nullptr;
  Vec f = nullptr;
  Vec y = nullptr;
  Vec w = nullptr;
  SNES snes = nullptr;
  check(SNESLineSearchGetVecs(search, &x, &f, &y, &w, nullptr));
  check(SNESLineSearchGetSNES(search, &snes));
  const MPI_Comm comm = model_.elements.membrane().comm();

  double weight = 0;  // of the volumes' errors: more than any multiplier makes them an exact penalty
  const auto merit = [&] {
    evaluate_gas();
    displacement_.values() = position_.values() - start_.values();
    double value = potential();
    for (int border = 0; border < bordered(); ++border) {
      value += weight * std::abs(excess_volume(border));
    }
    return value;
  };
  double slope = 0;
  check(VecDot(f, y, &slope));
  if (bordered() > 0) {
    check(VecWAXPY(w, -1, y, x));
    read_unknowns(w);
    weight = 2 * multiplier_.cwiseAbs().maxCoeff();
    slope = 0;  // only a decrease is asked for
  }
  read_unknowns(x);
  const double merit_before = merit();
  const double rounding = 1e-13 * (std::abs(merit_before) + force_scale_ * length_scale_);
  double lambda = 1;
  for (int halvings = 0; halvings <= max_halvings; ++halvings, lambda /= 2) {
    check(VecWAXPY(w, -lambda, y, x));
    read_unknowns(w);
    if (sum_over_ranks(comm, static_cast<double>(model_.elements.inverted(start_, position_))) > 0) {
      continue;
    }
    if (merit() <= merit_before - 1e-4 * lambda * slope + rounding) {
      check(VecCopy(w, x));
      check(SNESComputeFunction(snes, x, f));
      check(SNESLineSearchSetLambda(search, lambda));
      check(SNESLineSearchComputeNorms(search));
      return true;
    }
  }
  return false;
}

/// Hands on what SNES sets on the solver that it sees: Eisenstat and Walker's tolerance, a lagged preconditioner.
void ImplicitStep::take_over_settings() {
  KSP outer = nullptr;
  double rtol = 0;
  PetscBool reuses = PETSC_FALSE;
  check(SNESGetKSP(snes_, &outer));
  check(KSPGetTolerances(outer, &rtol, nullptr, nullptr, nullptr));
  check(KSPGetReusePreconditioner(outer, &reuses));
  check(KSPSetTolerances(solver_, rtol, PETSC_DEFAULT, PETSC_DEFAULT, PETSC_DEFAULT));
  check(KSPSetReusePreconditioner(solver_, reuses));
}

/// The step of Newton's method, J y = r, or of the positive tangent in J's place (see the class). What went wrong is
/// then in `linear_failure_`.
void ImplicitStep::solve_newton(Vec right_hand_side, Vec solution) {
  linear_failure_.clear();
  Solved solved = solve_once(right_hand_side, solution);
  if (solved == Solved::bad_preconditioner && positive_ == nullptr && !solves_once_ && options_.mat_type != "shell") {
    // It was made from the tangent without the gas's part, which need not be positive definite where the whole is.
    Mat system = nullptr;
    check(MatDuplicate(tangent_.matrix(), MAT_SHARE_NONZERO_PATTERN, positive_.create()));
    check(KSPGetOperators(solver_, &system, nullptr));
    check(KSPSetOperators(solver_, system, positive_));
    compute_jacobian();
    solved = solve_once(right_hand_side, solution);
  }
  if (solved == Solved::concave) {
    ++concave_iterations_;
    compute_tangent(Tangent::positive);
    solved = solve_once(right_hand_side, solution);
  }
  if (solved == Solved::yes) {
    linear_failure_.clear();
  }
}

ImplicitStep::Solved ImplicitStep::solve_once(Vec right_hand_side, Vec solution) {
  if (bordered() > 0) {
    return solve_bordered(right_hand_side, solution);
  }
  const Solved solved = solve_part(right_hand_side, solution);
  double curvature = 0;  // y.A y
  check(VecDot(right_hand_side, solution, &curvature));
  return solved == Solved::yes && curvature < 0 ? concave() : solved;
}

/// A system of the positions alone, with the gas's low-rank part.
ImplicitStep::Solved ImplicitStep::solve_part(Vec right_hand_side, Vec solution) {
  return solves_once_ ? solve_part_directly(right_hand_side, solution) : run_solver_once(right_hand_side, solution);
}

ImplicitStep::Solved ImplicitStep::run_solver_once(Vec right_hand_side, Vec solution) {
  const LinearResult result = solve(solver_, right_hand_side, solution);
  linear_iterations_ += result.iterations;
  if (result.converged) {
    return Solved::yes;
  }
  linear_failure_ = result.reason;
  switch (result.ended) {
    case KSP_DIVERGED_INDEFINITE_MAT:
    case KSP_CONVERGED_CG_NEG_CURVE:
      return Solved::concave;
    case KSP_DIVERGED_INDEFINITE_PC:
    case KSP_DIVERGED_PC_FAILED:
      return Solved::bad_preconditioner;
    default:
      return Solved::no;
  }
}

ImplicitStep::Solved ImplicitStep::concave() {
  linear_failure_ = "the tangent is not positive definite";
  return Solved::concave;
}

/// With a solver for the sparse part T alone (Woodbury): for A = T + G C G^T and Z = T^-1 G,
/// A^-1 r = T^-1 r - Z (1 + C G^T Z)^-1 C G^T T^-1 r.
ImplicitStep::Solved ImplicitStep::solve_part_directly(Vec right_hand_side, Vec solution) {
  const int chambers = model_.chambers.count();
  while (static_cast<int>(gas_influence_.size()) < chambers) {
    const auto chamber = static_cast<PetscInt>(gas_influence_.size());
    VecHandle influence;
    Vec gradient = nullptr;
    check(VecDuplicate(right_hand_side, influence.create()));
    check(MatDenseGetColumnVecRead(gas_columns_, chamber, &gradient));
    const Solved solved = run_solver_once(gradient, influence);
    check(MatDenseRestoreColumnVecRead(gas_columns_, chamber, &gradient));
    if (solved != Solved::yes) {
      return solved;
    }
    gas_influence_.push_back(std::move(influence));
  }
  const Solved solved = run_solver_once(right_hand_side, solution);
  if (solved != Solved::yes) {
    return solved;
  }
  std::vector<Vec> vectors(gas_influence_.begin(), gas_influence_.end());
  vectors.push_back(solution);
  const Eigen::MatrixXd products = gradient_products(vectors);
  const double* coefficients = nullptr;
  check(VecGetArrayRead(gas_coefficients_, &coefficients));
  const Eigen::MatrixXd scaled = Eigen::Map<const Eigen::VectorXd>(coefficients, chambers).asDiagonal() * products;
  check(VecRestoreArrayRead(gas_coefficients_, &coefficients));
  const Eigen::MatrixXd system = Eigen::MatrixXd::Identity(chambers, chambers) + scaled.leftCols(chambers);
  const Eigen::VectorXd weights = -system.partialPivLu().solve(scaled.col(chambers));
  check(VecMAXPY(solution, chambers, weights.data(), vectors.data()));
  const std::string fault =
      fault_of_solution(low_rank_, tangent_.matrix(), right_hand_side, solution, options_.ksp_rtol);
  if (!fault.empty()) {
    linear_failure_ = "the linear solver prism_ with the gas's part does not solve: " + fault;
    return Solved::no;
  }
  return Solved::yes;
}

/// g_c.v of every chamber, a row each, for some vectors of positions, a column each. Collective.
Eigen::MatrixXd ImplicitStep::gradient_products(const std::vector<Vec>& vectors) const {
  Eigen::MatrixXd products(gradients_.cols(), vectors.size());
  for (std::size_t column = 0; column < vectors.size(); ++column) {
    const double* values = nullptr;
    check(VecGetArrayRead(vectors[column], &values));
    products.col(static_cast<Eigen::Index>(column)) =
        gradients_.transpose() * Eigen::Map<const Eigen::VectorXd>(values, gradients_.rows());
    check(VecRestoreArrayRead(vectors[column], &values));
  }
  MPI_Allreduce(MPI_IN_PLACE, products.data(), static_cast<int>(products.size()), MPI_DOUBLE, MPI_SUM,
                model_.elements.membrane().comm());
  return products;
}

/// The bordered system [A, -s G; -s G^T, 0] [dx; dz] = [r; q], with G the volume gradients of the bordered chambers, s
/// their pressure scales and p = s z: A is replaced by A + rho g g^T and r accordingly, for s g.dx = -q.
ImplicitStep::Solved ImplicitStep::solve_bordered(Vec right_hand_side, Vec solution) {
  const PetscInt rows = 3 * owned();
  const int size = bordered();
  const Eigen::VectorXd volume_rows = border_values(right_hand_side);
  const auto as_vector = [rows](double* values) { return Eigen::Map<Eigen::VectorXd>(values, rows); };

  double* values = nullptr;
  const double* given = nullptr;
  check(VecGetArrayRead(right_hand_side, &given));
  check(VecGetArray(part_, &values));
  as_vector(values) = Eigen::Map<const Eigen::VectorXd>(given, rows);
  for (int border = 0; border < size; ++border) {
    const int chamber = bordered_chambers_[static_cast<std::size_t>(border)];
    as_vector(values) -=
        bordering_stiffness(chamber) * volume_rows[border] / pressure_scale(border) * gradients_.col(chamber);
  }
  check(VecRestoreArray(part_, &values));
  check(VecRestoreArrayRead(right_hand_side, &given));
  Solved solved = solve_part(part_, part_solution_);
  for (int border = 0; border < size && solved == Solved::yes; ++border) {
    check(VecGetArray(part_, &values));
    as_vector(values) = gradients_.col(bordered_chambers_[static_cast<std::size_t>(border)]);
    check(VecRestoreArray(part_, &values));
    solved = solve_part(part_, influence_[static_cast<std::size_t>(border)]);
  }
  if (solved != Solved::yes) {
    return solved;
  }

  // dx = a + sum_c s_c b_c dz_c with s_d g_d.dx = -q_d.
  std::vector<Vec> vectors(influence_.begin(), influence_.end());
  vectors.push_back(part_solution_);
  const Eigen::MatrixXd system = gradient_products(vectors)(bordered_chambers_, Eigen::all);  // g.b, g.a
  Eigen::VectorXd scale(size);
  for (int border = 0; border < size; ++border) {
    scale[border] = pressure_scale(border);
  }
  const Eigen::VectorXd wanted = -volume_rows.cwiseQuotient(scale) - system.col(size);
  const Eigen::VectorXd pressures = system.leftCols(size).partialPivLu().solve(wanted);  // s dz
  check(VecMAXPY(part_solution_, size, pressures.data(), vectors.data()));

  double curvature = 0;
  check(MatMult(low_rank_, part_solution_, part_));
  check(VecDot(part_, part_solution_, &curvature));
  check(VecGetArrayRead(part_solution_, &given));
  check(VecGetArray(solution, &values));
  std::copy_n(given, rows, values);
  for (int border = 0; rank_ == 0 && border < size; ++border) {
    values[rows + border] = pressures[border] / scale[border];
  }
  check(VecRestoreArray(solution, &values));
  check(VecRestoreArrayRead(part_solution_, &given));
  return curvature < 0 ? concave() : Solved::yes;
}

/// The entries of the bordered chambers in a vector of unknowns, on every rank. Collective.
Eigen::VectorXd ImplicitStep::border_values(Vec vector) const {
  Eigen::VectorXd values(bordered());
  const double* given = nullptr;
  check(VecGetArrayRead(vector, &given));
  if (rank_ == 0) {
    std::copy_n(given + 3 * owned(), bordered(), values.data());
  }
  check(VecRestoreArrayRead(vector, &given));
  MPI_Bcast(values.data(), bordered(), MPI_DOUBLE, 0, model_.elements.membrane().comm());
  return values;
}

/// y = J x of the bordered system.
void ImplicitStep::multiply_bordered(Vec x, Vec y) {
  const MPI_Comm comm = model_.elements.membrane().comm();
  const PetscInt rows = 3 * owned();
  const Eigen::VectorXd border = border_values(x);
  const double* given = nullptr;
  double* values = nullptr;
  check(VecGetArrayRead(x, &given));
  check(VecGetArray(part_, &values));
  std::copy_n(given, rows, values);
  check(VecRestoreArray(part_, &values));
  check(MatMult(tangent_.matrix(), part_, part_solution_));
  Eigen::VectorXd products(bordered());
  for (int b = 0; b < bordered(); ++b) {
    products[b] = gradients_.col(bordered_chambers_[static_cast<std::size_t>(b)])
                      .dot(Eigen::Map<const Eigen::VectorXd>(given, rows));
  }
  check(VecRestoreArrayRead(x, &given));
  MPI_Allreduce(MPI_IN_PLACE, products.data(), bordered(), MPI_DOUBLE, MPI_SUM, comm);
  check(VecGetArrayRead(part_solution_, &given));
  check(VecGetArray(y, &values));
  Eigen::Map<Eigen::VectorXd> result(values, rows);
  result = Eigen::Map<const Eigen::VectorXd>(given, rows);
  for (int b = 0; b < bordered(); ++b) {
    const double scale = pressure_scale(b);
    result -= scale * border[b] * gradients_.col(bordered_chambers_[static_cast<std::size_t>(b)]);
    if (rank_ == 0) {
      values[rows + b] = -scale * products[b];
    }
  }
  check(VecRestoreArray(y, &values));
  check(VecRestoreArrayRead(part_solution_, &given));
}

PetscErrorCode ImplicitStep::residual_callback(SNES, Vec unknowns, Vec residual, void* context) {
  return as_petsc_callback([&] {
    auto& self = *static_cast<ImplicitStep*>(context);
    self.read_unknowns(unknowns);
    self.compute_residual(residual);
    if (!self.start_residual_) {
      check(VecNorm(residual, NORM_2, &self.start_residual_.emplace()));
    }
  });
}

PetscErrorCode ImplicitStep::jacobian_callback(SNES, Vec unknowns, Mat, Mat, void* context) {
  return as_petsc_callback([&] {
    auto& self = *static_cast<ImplicitStep*>(context);
    self.read_unknowns(unknowns);
    self.compute_jacobian();
  });
}

PetscErrorCode ImplicitStep::line_search_callback(SNESLineSearch search, void* context) {
  return as_petsc_callback([&] {
    const bool found = static_cast<ImplicitStep*>(context)->search_line(search);
    check(SNESLineSearchSetReason(search, found ? SNES_LINESEARCH_SUCCEEDED : SNES_LINESEARCH_FAILED_REDUCT));
  });
}

PetscErrorCode ImplicitStep::solve_callback(PC pc, Vec right_hand_side, Vec solution) {
  return as_petsc_callback([&] {
    void* context = nullptr;
    check(PCShellGetContext(pc, &context));
    auto& self = *static_cast<ImplicitStep*>(context);
    self.take_over_settings();
    try {
      self.solve_newton(right_hand_side, solution);
    } catch (const Error& error) {
      self.bad_options_ = error.what();
      throw;
    }
    check(PCSetFailedReason(pc, self.linear_failure_.empty() ? PC_NOERROR : PC_SUBPC_ERROR));
  });
}

PetscErrorCode ImplicitStep::bordered_product_callback(Mat matrix, Vec x, Vec y) {
  return as_petsc_callback([&] {
    void* context = nullptr;
    check(MatShellGetContext(matrix, &context));
    static_cast<ImplicitStep*>(context)->multiply_bordered(x, y);
  });
}

}  // namespace pellicle
