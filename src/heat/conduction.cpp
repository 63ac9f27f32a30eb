#include "heat/conduction.h"

#include <algorithm>

#include "base/error.h"
#include "base/ksp.h"

namespace pellicle {

namespace {

Eigen::Map<Eigen::VectorXd> owned_values(double* values, Eigen::Index size) { return {values, size}; }

}  // namespace

Conduction::Conduction(const Sheet& sheet, const HeatOptions& options, const std::vector<double>& diffusivity_factor)
    : sheet_(sheet),
      umbrella_(options.operator_name == "umbrella"),
      assembled_(options.mat_type == "aij"),
      diffusivity_(static_cast<std::size_t>(sheet.particles.local()), options.diffusivity) {
  for (std::size_t i = 0; i < diffusivity_factor.size(); ++i) {
    diffusivity_[i] *= diffusivity_factor[i];
  }
  graph_.pairs = umbrella_ ? umbrella_pairs(sheet) : cotangent_pairs(sheet);
  if (assembled_) {
    create_assembled();
  } else {
    create_shell();
  }
  check(MatSetOption(matrix_, MAT_SPD, PETSC_TRUE));
  check(MatSetOption(matrix_, MAT_SPD_ETERNAL, PETSC_TRUE));
  check(MatCreateVecs(matrix_, increment_.create(), right_hand_side_.create()));

  KspDefaults defaults;
  defaults.preconditioner = PCJACOBI;
  defaults.rtol = options.ksp_rtol;
  ksp_ = make_ksp(matrix_, matrix_, "heat_", defaults);
}

void Conduction::create_assembled() {
  const Layout& particles = sheet_.particles;
  // Each rank writes the rows of its own particles: their diagonal, then what lies beside it, pair by pair.
  std::vector<PetscInt> rows;
  std::vector<PetscInt> columns;
  for (PetscInt i = 0; i < particles.owned; ++i) {
    rows.push_back(particles.to_global(i));
    columns.push_back(particles.to_global(i));
  }
  for (const auto& [a, b] : graph_.pairs) {
    if (a < particles.owned) {
      rows.push_back(particles.to_global(a));
      columns.push_back(particles.to_global(b));
    }
    if (b < particles.owned) {
      rows.push_back(particles.to_global(b));
      columns.push_back(particles.to_global(a));
    }
  }
  entries_.resize(rows.size());
  check(MatCreate(sheet_.comm(), matrix_.create()));
  check(MatSetSizes(matrix_, particles.owned, particles.owned, particles.global, particles.global));
  check(MatSetType(matrix_, MATAIJ));
  check(MatSetPreallocationCOO(matrix_, static_cast<PetscCount>(rows.size()), rows.data(), columns.data()));
}

void Conduction::create_shell() {
  const Layout& particles = sheet_.particles;
  exchange_ = Field(particles, 1);
  check(MatCreateShell(sheet_.comm(), particles.owned, particles.owned, particles.global, particles.global, this,
                       matrix_.create()));
  const auto product = +[](Mat matrix, Vec x, Vec y) -> PetscErrorCode {
    return as_petsc_callback([&] {
      void* self = nullptr;
      check(MatShellGetContext(matrix, &self));
      static_cast<Conduction*>(self)->multiply(x, y);
    });
  };
  const auto diagonal = +[](Mat matrix, Vec out) -> PetscErrorCode {
    return as_petsc_callback([&] {
      void* self = nullptr;
      check(MatShellGetContext(matrix, &self));
      const Eigen::VectorXd& values = static_cast<Conduction*>(self)->diagonal_;
      double* array = nullptr;
      check(VecGetArrayWrite(out, &array));
      std::copy(values.begin(), values.end(), array);
      check(VecRestoreArrayWrite(out, &array));
    });
  };
  check(MatShellSetOperation(matrix_, MATOP_MULT, reinterpret_cast<void (*)()>(product)));
  check(MatShellSetOperation(matrix_, MATOP_GET_DIAGONAL, reinterpret_cast<void (*)()>(diagonal)));
}

void Conduction::update_operator(const ConductionInput& input) {
  if (umbrella_) {
    set_umbrella(graph_, sheet_, diffusivity_, input.positions, input.living);
  } else {
    set_cotangent(graph_, sheet_, diffusivity_, input.positions, input.mass, input.living);
  }
  const PetscInt owned = sheet_.particles.owned;
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(sheet_.particles.local());
  for (std::size_t p = 0; p < graph_.pairs.size(); ++p) {
    graph_.weights[p] *= input.time_step;
    sum[graph_.pairs[p][0]] += graph_.weights[p];
    sum[graph_.pairs[p][1]] += graph_.weights[p];
  }
  diagonal_ = graph_.capacity + sum.head(owned);
  for (Eigen::Index i = 0; i < owned; ++i) {
    if (diagonal_[i] == 0) {  // The particle has left: any capacity keeps its temperature.
      graph_.capacity[i] = diagonal_[i] = 1;
    }
  }

  if (assembled_) {
    std::copy(diagonal_.begin(), diagonal_.end(), entries_.begin());
    auto entry = entries_.begin() + owned;
    for (std::size_t p = 0; p < graph_.pairs.size(); ++p) {
      for (const PetscInt end : graph_.pairs[p]) {
        if (end < owned) {
          *entry++ = -graph_.weights[p];
        }
      }
    }
    check(MatSetValuesCOO(matrix_, entries_.data(), INSERT_VALUES));
  } else {
    // Tells the preconditioner that the diagonal is another one now.
    check(MatAssemblyBegin(matrix_, MAT_FINAL_ASSEMBLY));
    check(MatAssemblyEnd(matrix_, MAT_FINAL_ASSEMBLY));
  }
}

void Conduction::multiply(Vec x, Vec y) {
  const PetscInt owned = sheet_.particles.owned;
  const double* in = nullptr;
  check(VecGetArrayRead(x, &in));
  std::copy(in, in + owned, exchange_.data());
  check(VecRestoreArrayRead(x, &in));
  exchange_.update_ghosts();
  double* out = nullptr;
  check(VecGetArrayWrite(y, &out));
  // (capacity + h K) x: the inflow is -h K x.
  owned_values(out, owned) =
      graph_.capacity.cwiseProduct(owned_values(exchange_.data(), owned)) - graph_.inflow(exchange_);
  check(VecRestoreArrayWrite(y, &out));
}

StageResult Conduction::advance(Field& temperature, const ConductionInput& input) {
  update_operator(input);
  const PetscInt owned = sheet_.particles.owned;
  double* array = nullptr;
  check(VecGetArrayWrite(right_hand_side_, &array));
  owned_values(array, owned) = graph_.inflow(temperature);
  check(VecRestoreArrayWrite(right_hand_side_, &array));

  StageResult result = solve(ksp_, right_hand_side_, increment_);
  if (!result.converged) {
    return result;
  }
  const double* increment = nullptr;
  check(VecGetArrayRead(increment_, &increment));
  owned_values(temperature.data(), owned) += Eigen::Map<const Eigen::VectorXd>(increment, owned);
  check(VecRestoreArrayRead(increment_, &increment));
  temperature.update_ghosts();
  return result;
}

}  // namespace pellicle
