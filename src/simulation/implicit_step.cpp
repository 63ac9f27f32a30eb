#include "simulation/implicit_step.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>

#include "base/error.h"
#include "base/ksp.h"

namespace pellicle {

namespace {

/// How often a Newton step may be halved.
constexpr int max_halvings = 20;

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
  KspHandle linear = make_ksp(amat, tangent, "prism_", defaults);
  patches_ = RigidPatches::of(linear, tangent, membrane, model_.constraints.projectors(), options_.patch_size);

  check(SNESCreate(comm, snes_.create()));
  check(SNESSetOptionsPrefix(snes_, "prism_"));
  if (bordered() == 0) {
    check(MatCreateVecs(tangent, unknowns_.create(), residual_.create()));
    check(SNESSetKSP(snes_, linear));
    check(SNESSetJacobian(snes_, amat, tangent, jacobian_callback, this));
  } else {
    const PetscInt rows = 3 * owned() + (rank_ == 0 ? bordered() : 0);
    check(VecCreateMPI(comm, rows, PETSC_DETERMINE, unknowns_.create()));
    check(VecDuplicate(unknowns_, residual_.create()));
    check(MatCreateVecs(tangent, part_.create(), part_solution_.create()));
    for (int border = 0; border < bordered(); ++border) {
      check(VecDuplicate(part_, influence_.emplace_back().create()));
    }
    inner_solver_ = std::move(linear);
    check(MatCreateShell(comm, rows, rows, PETSC_DETERMINE, PETSC_DETERMINE, this, bordered_matrix_.create()));
    check(MatShellSetOperation(bordered_matrix_, MATOP_MULT,
                               reinterpret_cast<void (*)()>(&ImplicitStep::bordered_product_callback)));
    KspHandle outer;
    PC pc = nullptr;
    check(KSPCreate(comm, outer.create()));
    check(KSPSetOptionsPrefix(outer, "prism_border_"));
    check(KSPSetType(outer, KSPPREONLY));
    check(KSPGetPC(outer, &pc));
    check(PCSetType(pc, PCSHELL));
    check(PCShellSetContext(pc, this));
    check(PCShellSetApply(pc, bordered_solve_callback));
    check(SNESSetKSP(snes_, outer));
    check(SNESSetJacobian(snes_, bordered_matrix_, bordered_matrix_, jacobian_callback, this));
  }
  check(SNESSetFunction(snes_, residual_, residual_callback, this));

  // Rounding of positions alone leaves some 3 to 4 epsilon times this: it does not shrink with the elements, since
  // their stiffness does not either. A balloon at rest ends its steps here.
  const double vertices = static_cast<double>(model_.elements.membrane().particles.global);
  const double rounding = std::numeric_limits<double>::epsilon() * force_scale_ * std::sqrt(vertices);
  check(SNESSetTolerances(snes_, 20 * rounding, options_.snes_rtol, 1e-13, options_.max_iterations, PETSC_DEFAULT));
  SNESLineSearch search = nullptr;
  check(SNESGetLineSearch(snes_, &search));
  check(SNESLineSearchSetType(search, options_.line_search ? SNESLINESEARCHSHELL : SNESLINESEARCHBASIC));
  if (options_.line_search) {
    check(SNESLineSearchShellSetUserFunc(search, line_search_callback, this));
    check(SNESSetMaxLinearSolveFailures(snes_, PETSC_MAX_INT));  // The line search judges what the solver has reached.
  }
  try {
    check(SNESSetFromOptions(snes_));
  } catch (const PetscFailure& failure) {  // A value that PETSc does not know: every rank reads the same.
    throw Error(std::string("-prism_...: ") + failure.what());
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
  bordered_iterations_ = 0;
  check(SNESSolve(snes_, nullptr, unknowns_));

  ImplicitResult result;
  SNESConvergedReason reason = SNES_CONVERGED_ITERATING;
  PetscInt newton = 0;
  PetscInt linear = 0;
  check(SNESGetConvergedReason(snes_, &reason));
  check(SNESGetIterationNumber(snes_, &newton));
  check(SNESGetLinearSolveIterations(snes_, &linear));
  result.newton_iterations = static_cast<int>(newton);
  result.linear_iterations = bordered() == 0 ? static_cast<int>(linear) : bordered_iterations_;
  result.converged = reason > 0 || (options_.newton == "fixed" && reason == SNES_DIVERGED_MAX_IT);
  if (!result.converged) {
    result.reason = words_of_failure(reason);
    return result;
  }
  check(SNESGetFunctionNorm(snes_, &result.residual));
  read_unknowns(unknowns_);
  state.position.values() = position_.values();
  for (int border = 0; border < bordered(); ++border) {
    state.pressure[bordered_chambers_[static_cast<std::size_t>(border)]] = multiplier_[border];
  }
  return result;
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
  switch (reason) {
    case SNES_DIVERGED_LINE_SEARCH:
      return "no part of Newton's step lowers the potential without turning elements over";
    case SNES_DIVERGED_FNORM_NAN:
    case SNES_DIVERGED_FUNCTION_DOMAIN:
      return "the forces are not finite: an element has collapsed, or a chamber has no volume left";
    case SNES_DIVERGED_MAX_IT:
      std::snprintf(text, sizeof text,
                    "Newton's method did not converge in %d iterations (residual %.2e N): no equilibrium near, or the "
                    "step is too long",
                    static_cast<int>(iterations), norm);
      return text;
    default:
      return std::string("Newton's method did not converge (") + SNESConvergedReasons[reason] + ")";
  }
}

/// Whether Newton's method can use what the linear solver has reached: its solution, or, where conjugate gradients met
/// a concave direction, the potential's or the preconditioner's, the way downhill until then.
bool ImplicitStep::linear_solve_is_usable() {
  if (bordered() > 0) {
    return linear_failure_.empty();
  }
  KSP ksp = nullptr;
  KSPConvergedReason reason = KSP_CONVERGED_ITERATING;
  PetscInt iterations = 0;
  check(SNESGetKSP(snes_, &ksp));
  check(KSPGetConvergedReason(ksp, &reason));
  check(KSPGetIterationNumber(ksp, &iterations));
  if (reason > 0) {
    linear_failure_.clear();
    return true;
  }
  const bool is_indefinite = reason == KSP_DIVERGED_INDEFINITE_MAT || reason == KSP_DIVERGED_INDEFINITE_PC;
  linear_failure_ =
      is_indefinite
          ? "the tangent is not positive definite: there is no stable equilibrium near, as beyond the highest pressure "
            "that the balloon can hold (to go there prescribe its volume or its amount of gas), or the step is too long"
          : std::string("the linear solver prism_ did not converge (") + KSPConvergedReasons[reason] + ")";
  return is_indefinite && iterations > 0;
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
  Eigen::Matrix3Xd force = Eigen::Matrix3Xd::Zero(3, owned());
  model_.elements.add_force(position_, thickness_ratio_, force);
  for (int chamber = 0; chamber < model_.chambers.count(); ++chamber) {
    force += gas_[static_cast<std::size_t>(chamber)].pressure * model_.chambers.volume_gradient(chamber, position_);
  }
  if (options_.stiffness_damping > 0) {
    displacement_.values() = position_.values() - start_.values();
    tangent_.add_lagged_product(-options_.stiffness_damping / h_, displacement_, force);
  }
  double* values = nullptr;
  check(VecGetArray(residual, &values));
  for (PetscInt i = 0; i < owned(); ++i) {
    const auto index = static_cast<std::size_t>(i);
    const double mass = model_.mass[index];
    const auto x = position_.vector(i);
    Eigen::Vector3d total = force.col(i) + mass * model_.gravity;
    total -= options_.mass_damping * mass / h_ * (x - start_.vector(i));
    if (options_.inertia) {
      total -= mass / (h_ * h_) * (x - predicted_.col(i));
    }
    if (!model_.loads.empty()) {
      total -= model_.loads.at(i, x).gradient;
    }
    Eigen::Map<Eigen::Vector3d>(values + 3 * i) = -(model_.constraints.projectors()[index] * total);
  }
  if (rank_ == 0) {
    for (int border = 0; border < bordered(); ++border) {
      values[3 * owned() + border] = -pressure_scale(border) * excess_volume(border);
    }
  }
  check(VecRestoreArray(residual, &values));
}

void ImplicitStep::compute_jacobian() {
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
                   options_.stiffness_damping / h_});
  if (patches_) {
    patches_->update();
  }

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
    coefficients[chamber] = model_.chambers.prescribes_volume(chamber)
                                ? bordering_stiffness(chamber)
                                : -rank_one_share(model_.gas_tangent) * gas.pressure_slope;
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
  if (!linear_solve_is_usable()) {
    return false;
  }

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

/// The bordered system [A, -s G; -s G^T, 0] [dx; dz] = [r; q], with G the volume gradients of the bordered chambers, s
/// their pressure scales and p = s z: A is replaced by A + rho g g^T and r accordingly, for s g.dx = -q.
void ImplicitStep::solve_bordered(Vec right_hand_side, Vec solution) {
  const MPI_Comm comm = model_.elements.membrane().comm();
  const PetscInt rows = 3 * owned();
  const Eigen::VectorXd volume_rows = border_values(right_hand_side);
  Eigen::MatrixXd columns(rows, bordered());
  for (int border = 0; border < bordered(); ++border) {
    columns.col(border) = gradients_.col(bordered_chambers_[static_cast<std::size_t>(border)]);
  }
  const auto as_vector = [rows](double* values) { return Eigen::Map<Eigen::VectorXd>(values, rows); };
  const auto solve_part = [&](Vec result) {
    const StageResult solved = solve(inner_solver_, part_, result);
    bordered_iterations_ += solved.iterations;
    if (!solved.converged && linear_failure_.empty()) {
      linear_failure_ = solved.reason;
    }
  };

  double* values = nullptr;
  const double* given = nullptr;
  check(VecGetArrayRead(right_hand_side, &given));
  check(VecGetArray(part_, &values));
  as_vector(values) = Eigen::Map<const Eigen::VectorXd>(given, rows);
  for (int border = 0; border < bordered(); ++border) {
    const double rho = bordering_stiffness(bordered_chambers_[static_cast<std::size_t>(border)]);
    as_vector(values) -= rho * volume_rows[border] / pressure_scale(border) * columns.col(border);
  }
  check(VecRestoreArray(part_, &values));
  check(VecRestoreArrayRead(right_hand_side, &given));
  solve_part(part_solution_);
  for (int border = 0; border < bordered(); ++border) {
    check(VecGetArray(part_, &values));
    as_vector(values) = columns.col(border);
    check(VecRestoreArray(part_, &values));
    solve_part(influence_[static_cast<std::size_t>(border)]);
  }

  // dx = a + sum_c s_c b_c dz_c with s_d g_d.dx = -q_d.
  const int size = bordered();
  Eigen::MatrixXd system(size, size + 1);  // g.b, g.a
  for (int column = 0; column <= size; ++column) {
    Vec part = column < size ? static_cast<Vec>(influence_[static_cast<std::size_t>(column)]) : Vec(part_solution_);
    check(VecGetArrayRead(part, &given));
    system.col(column) = columns.transpose() * Eigen::Map<const Eigen::VectorXd>(given, rows);
    check(VecRestoreArrayRead(part, &given));
  }
  MPI_Allreduce(MPI_IN_PLACE, system.data(), static_cast<int>(system.size()), MPI_DOUBLE, MPI_SUM, comm);
  Eigen::VectorXd scale(size);
  for (int border = 0; border < size; ++border) {
    scale[border] = pressure_scale(border);
  }
  const Eigen::VectorXd wanted = -volume_rows.cwiseQuotient(scale) - system.col(size);
  const Eigen::VectorXd pressures = system.leftCols(size).partialPivLu().solve(wanted);  // s dz

  double* result = nullptr;
  check(VecGetArray(solution, &result));
  check(VecGetArrayRead(part_solution_, &given));
  as_vector(result) = Eigen::Map<const Eigen::VectorXd>(given, rows);
  check(VecRestoreArrayRead(part_solution_, &given));
  for (int border = 0; border < size; ++border) {
    Vec part = influence_[static_cast<std::size_t>(border)];
    check(VecGetArrayRead(part, &given));
    as_vector(result) += pressures[border] * Eigen::Map<const Eigen::VectorXd>(given, rows);
    check(VecRestoreArrayRead(part, &given));
    if (rank_ == 0) {
      result[rows + border] = pressures[border] / scale[border];
    }
  }
  check(VecRestoreArray(solution, &result));
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

PetscErrorCode ImplicitStep::bordered_solve_callback(PC pc, Vec right_hand_side, Vec solution) {
  return as_petsc_callback([&] {
    void* context = nullptr;
    check(PCShellGetContext(pc, &context));
    auto& self = *static_cast<ImplicitStep*>(context);
    self.solve_bordered(right_hand_side, solution);
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
