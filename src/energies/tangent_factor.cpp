#include "energies/tangent_factor.h"

#include <algorithm>
#include <array>
#include <utility>

#include "base/error.h"
#include "base/sorting.h"
#include "geometry/principal_axes.h"
#include "linear/shell_operations.h"
#include "parallel/collective.h"

namespace pellicle::energies {

void TangentFactor::check_options(MPI_Comm comm, const std::string& prefix) {
  constexpr PetscInt pord = 4;
  const std::string option = "-" + prefix + "mat_mumps_icntl_7";
  PetscInt ordering = 0;
  check(PetscOptionsGetInt(nullptr, nullptr, option.c_str(), &ordering, nullptr));
  if (ordering == pord && ranks_of(comm) > 1) {
    throw Error(option + " 4: PORD cannot order what ranks share; expected another ordering, or one rank");
  }
}

TangentFactor::TangentFactor(const Tangent& tangent, const LowRankSystem& system, const std::string& prefix)
    : tangent_(tangent), system_(system), prefix_(prefix) {
  check(KSPCreate(tangent_.vertices().comm, solver_.create()));
  check(KSPSetOptionsPrefix(solver_, prefix_.c_str()));
  check(KSPSetOperators(solver_, system_.matrix(), system_.matrix()));
  check(KSPSetType(solver_, KSPCG));
  check(KSPSetNormType(solver_, KSP_NORM_UNPRECONDITIONED));  // saves the last product with the inverse
  const PC pc = preconditioner_of(solver_);
  check(PCSetType(pc, PCSHELL));
  run_solver(prefix_, [&] { check(KSPSetFromOptions(solver_)); });
  check(PCSetType(pc, PCSHELL));  // whatever the options say of the preconditioner in its place
  check(PCShellSetContext(pc, this));
  check(PCShellSetApply(pc, [](PC of, Vec in, Vec out) {
    return as_petsc_callback([&] {
      TangentFactor* self = nullptr;
      check(PCShellGetContext(of, &self));
      self->apply(in, out);
    });
  }));
  make_stoppable(solver_);
}

/// Finds inner vertices and interface, and makes their factors.
void TangentFactor::make_pattern() {
  const Layout& reach = tangent_.reach();
  const PetscInt end = reach.first + reach.owned;
  std::vector<std::array<PetscInt, 2>> blocks;  // as they come, vertices of all ranks
  std::vector<PetscInt> later;                  // vertices of later ranks that those of this one are coupled with
  const auto take_place = [&](PetscInt row, PetscInt column, const Eigen::Matrix3d&) {
    blocks.push_back({reach.first + row, reach.to_global(column)});
    if (blocks.back()[1] >= end) {
      later.push_back(blocks.back()[1]);
    }
  };
  TakenBlocks places(reach.owned, take_place);
  tangent_.visit(places);
  interface_ = RankInterface(reach.comm, reach.first, reach.owned, later);
  std::vector<int> coupled;  // of the interface with inner vertices
  for (const auto& [row, column] : blocks) {
    if (column >= row && (interface_.number(row) < 0) != (interface_.number(column) < 0)) {
      coupled.push_back(std::max(interface_.number(row), interface_.number(column)));
    }
  }
  interface_.set_border(without_repeats(std::move(coupled)), 3);
  const std::vector<int>& border = interface_.border();
  const auto inner = static_cast<int>(interface_.inner().size());
  const auto place_in_inner = [&](PetscInt vertex) {
    const int number = interface_.number(vertex);
    const auto place = std::lower_bound(border.begin(), border.end(), number) - border.begin();
    return number < 0 ? interface_.inner_number(vertex) : inner + static_cast<int>(place);
  };
  struct Entries {
    std::vector<int> rows;
    std::vector<int> columns;
    void add(int row, int column, bool on_diagonal) {
      for (int c = 0; c < 3; ++c) {
        for (int r = 0; r <= (on_diagonal ? c : 2); ++r) {
          rows.push_back(3 * row + r + 1);
          columns.push_back(3 * column + c + 1);
        }
      }
    }
  };
  Entries of_inner;
  Entries of_interface;
  targets_.clear();
  for (const auto& [row, column] : blocks) {
    if (column < row) {
      targets_.push_back(Target::none);
    } else if (interface_.number(row) >= 0 && interface_.number(column) >= 0) {
      targets_.push_back(Target::interface);
      of_interface.add(interface_.number(row), interface_.number(column), row == column);
    } else {
      targets_.push_back(Target::inner);
      of_inner.add(place_in_inner(row), place_in_inner(column), row == column);
    }
  }
  const auto width = static_cast<int>(3 * border.size());
  const auto unknown = [&](int k) { return 3 * border[static_cast<std::size_t>(k) / 3] + k % 3 + 1; };
  for (int column = 0; column < width; ++column) {
    for (int row = column; row < width; ++row) {
      of_interface.rows.push_back(unknown(row));
      of_interface.columns.push_back(unknown(column));
    }
  }
  own_entries_.resize(of_interface.rows.size());
  all_entries_ = Gatherer(reach.comm, own_entries_.size());
  of_interface.rows = of_all_ranks(reach.comm, of_interface.rows);
  of_interface.columns = of_all_ranks(reach.comm, of_interface.columns);
  values_.resize(3 * inner + width);
  together(reach.comm, [&] {
    interface_factor_ = std::make_unique<InterfaceFactor>(std::move(of_interface.rows), std::move(of_interface.columns),
                                                          3 * interface_.size(), prefix_);
    inner_factor_ = std::make_unique<MumpsFactor>(std::move(of_inner.rows), std::move(of_inner.columns),
                                                  3 * inner + width, width, prefix_);
  });
}

/// Copies the tangent's present values to the factors' entries.
void TangentFactor::fill() {
  const Layout& reach = tangent_.reach();
  auto target = targets_.begin();
  auto to_inner = inner_factor_->values().begin();
  auto to_interface = own_entries_.begin();
  const auto take_block = [&](PetscInt row, PetscInt column, const Eigen::Matrix3d& block) {
    const Target where = *target++;
    if (where == Target::none) {
      return;
    }
    auto& to = where == Target::inner ? to_inner : to_interface;
    const bool on_diagonal = column == row;
    for (int c = 0; c < 3; ++c) {
      to = std::copy_n(block.col(c).data(), on_diagonal ? c + 1 : 3, to);
    }
  };
  TakenBlocks blocks(reach.owned, take_block);
  tangent_.visit(blocks);
}

/// Sum over all ranks, from the first to the last. Collective.
Eigen::MatrixXd TangentFactor::sum_of_ranks(const Eigen::MatrixXd& own) const {
  const std::vector<double> all =
      of_all_ranks(tangent_.vertices().comm, std::vector<double>(own.data(), own.data() + own.size()));
  Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(own.rows(), own.cols());
  for (auto values = all.begin(); values != all.end(); values += own.size()) {
    sum += Eigen::Map<const Eigen::MatrixXd>(&*values, own.rows(), own.cols());
  }
  return sum;
}

std::optional<int> TangentFactor::refresh() {
  MPI_Comm comm = tangent_.vertices().comm;
  if (inner_factor_ == nullptr) {
    make_pattern();
  }
  fill();
  influence_.resize(0, 0);
  const bool is_regular = inner_factor_->refresh();
  if (on_any_rank(comm, !is_regular)) {
    return std::nullopt;
  }
  const int width = inner_factor_->size_of_border();
  auto to = own_entries_.end() - width * (width + 1) / 2;
  for (int column = 0; column < width; ++column) {
    const double* entries = inner_factor_->complement().data() + column * width;
    to = std::copy(entries + column, entries + width, to);
  }
  all_entries_.gather(own_entries_.data(), interface_factor_->values());
  if (on_any_rank(comm, !interface_factor_->refresh())) {
    return std::nullopt;
  }
  int negative = sum_over_ranks(comm, inner_factor_->negative()) + interface_factor_->negative();

  const auto is_held = [this](int column) {
    return std::find(system_.constrained().begin(), system_.constrained().end(), column) != system_.constrained().end();
  };
  std::vector<int> counting;  // columns
  for (int column = 0; column < system_.count(); ++column) {
    if (is_held(column) || system_.low_rank().coefficients[column] != 0) {
      counting.push_back(column);
    }
  }
  const auto count = static_cast<Eigen::Index>(counting.size());
  if (count == 0) {
    return negative;
  }
  Eigen::MatrixXd columns(3 * tangent_.vertices().owned, count);
  Eigen::MatrixXd influence(columns.rows(), count);
  Eigen::VectorXd inverse = Eigen::VectorXd::Zero(count);  // of C
  for (Eigen::Index k = 0; k < count; ++k) {
    const int column = counting[k];
    columns.col(k) = system_.low_rank().column(column);
    solve(columns.col(k).data(), influence.col(k).data());
    inverse[k] = is_held(column) ? 0 : 1 / system_.low_rank().coefficients[column];
    negative -= is_held(column) || system_.low_rank().coefficients[column] > 0 ? 1 : 0;
  }
  Eigen::MatrixXd border = sum_of_ranks(columns.transpose() * influence);
  border += inverse.asDiagonal();
  border = ((border + border.transpose()) / 2).eval();
  const Eigen::VectorXd eigenvalues = principal_axes(border).values;
  if (!(eigenvalues.cwiseAbs().minCoeff() > 0)) {
    return std::nullopt;
  }
  border_.compute(border);
  influence_ = std::move(influence);
  return negative + static_cast<int>((eigenvalues.array() > 0).count());
}

/// T^-1 load. Collective. @param load, solution of the owned vertices
void TangentFactor::solve(const double* load, double* solution) {
  values_.setZero();
  auto place = values_.begin();
  for (const PetscInt i : interface_.inner()) {
    place = std::copy_n(load + 3 * i, 3, place);
  }
  inner_factor_->reduce(values_);
  interface_.sum(load, values_.data() + (place - values_.begin()), interface_values_);
  interface_factor_->solve(interface_values_);
  for (const int k : interface_.border()) {
    place = std::copy_n(interface_values_.begin() + 3 * k, 3, place);
  }
  inner_factor_->expand(values_);
  place = values_.begin();
  for (const PetscInt i : interface_.inner()) {
    std::copy_n(place, 3, solution + 3 * i);
    place += 3;
  }
  auto of_interface = interface_values_.begin() + 3 * interface_.own_first();
  for (const PetscInt i : interface_.own()) {
    std::copy_n(of_interface, 3, solution + 3 * i);
    of_interface += 3;
  }
}

void TangentFactor::apply(Vec in, Vec out) {
  const ConstVecValues load(in);
  VecValues solution(out);
  solve(load.data(), solution.data());
  if (influence_.cols() > 0) {
    const Eigen::VectorXd forces = influence_.transpose() * load;
    solution -= influence_ * border_.solve(sum_of_ranks(forces));
  }
}

}  // namespace pellicle::energies
