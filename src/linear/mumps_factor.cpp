#include "linear/mumps_factor.h"

#include <dmumps_c.h>
#include <fmt/format.h>
#include <petscblaslapack.h>

#include <algorithm>
#include <array>
#include <numeric>
#include <utility>

#include "base/error.h"
#include "linear/ksp.h"
#include "parallel/partition.h"

namespace pellicle::linear {

namespace {

/// Settings that options may change: those of PETSc's own interface to MUMPS, but for what this class sets itself (19,
/// 20, 26: border and right-hand side).
constexpr std::array<int, 25> free_settings = {1,  2,  3,  4,  6,  7,  8,  10, 11, 12, 13, 14, 15,
                                               22, 23, 24, 25, 27, 28, 29, 31, 33, 35, 36, 38};
constexpr std::array<int, 6> free_numbers = {1, 2, 3, 4, 5, 7};  ///< settings that are real numbers

}  // namespace

/// MUMPS' own arrays, and its jobs by numbers.
struct MumpsFactor::Instance {
  static constexpr int start = -1;
  static constexpr int end = -2;
  static constexpr int analyse = 1;
  static constexpr int factorise = 2;
  static constexpr int solve = 3;
  /// MUMPS' setting by its number in the manual, from 1.
  int& setting(int number) { return data.icntl[number - 1]; }
  int result(int number) const { return data.infog[number - 1]; }

  DMUMPS_STRUC_C data{};
};

MumpsFactor::MumpsFactor(std::vector<int> rows, std::vector<int> columns, int size, int border,
                         const std::string& prefix)
    : size_(size),
      border_(border),
      rows_(std::move(rows)),
      columns_(std::move(columns)),
      values_(rows_.size()),
      border_unknowns_(border),
      complement_(static_cast<std::size_t>(border) * static_cast<std::size_t>(border)),
      border_values_(border),
      mumps_(std::make_unique<Instance>()) {
  DMUMPS_STRUC_C& data = mumps_->data;
  std::vector<int> places;  // from 1
  if (!is_empty()) {
    data.sym = 2;  // of any inertia
    data.par = 1;
    data.comm_fortran = MPI_Comm_c2f(MPI_COMM_SELF);
    run(Instance::start);
    for (const int stream : {1, 2, 3}) {
      mumps_->setting(stream) = -1;
    }
    mumps_->setting(4) = 0;  // prints nothing
    mumps_->setting(8) = 0;  // Rows are alike: scaling costs more than it gains.
    mumps_->setting(static_cast<int>(mumps_room_setting)) = static_cast<int>(mumps_room);
    places = order();
    mumps_->setting(7) = 1;  // as it says
    data.perm_in = places.data();
  }
  // Options are read on every rank: those that rank 0 has not read are warned of.
  const std::string name = "-" + prefix + "mat_mumps_";
  for (const int number : free_settings) {
    PetscInt value = mumps_->setting(number);
    check(PetscOptionsGetInt(nullptr, nullptr, (name + "icntl_" + std::to_string(number)).c_str(), &value, nullptr));
    mumps_->setting(number) = static_cast<int>(value);
  }
  for (const int number : free_numbers) {
    check(PetscOptionsGetReal(nullptr, nullptr, (name + "cntl_" + std::to_string(number)).c_str(),
                              &data.cntl[number - 1], nullptr));
  }
  if (is_empty()) {
    return;
  }
  data.n = size_;
  data.nnz = static_cast<MUMPS_INT8>(rows_.size());
  data.irn = rows_.data();
  data.jcn = columns_.data();
  if (border_ > 0) {
    std::iota(border_unknowns_.begin(), border_unknowns_.end(), size_ - border_ + 1);
    mumps_->setting(19) = 2;  // the complement's lower half, by columns, in one block
    data.size_schur = data.lredrhs = data.schur_lld = data.mblock = data.nblock = border_;
    data.nprow = data.npcol = 1;
    data.listvar_schur = border_unknowns_.data();
    data.schur = complement_.data();
    data.redrhs = border_values_.data();
  }
  data.nrhs = 1;
  data.lrhs = size_;
  run(Instance::analyse);
  throw_if_failed("order the unknowns");
}

/// Position of each unknown in the order of elimination, from 1.
std::vector<int> MumpsFactor::order() const {
  const std::size_t triples = (size_ - border_) / 3;
  std::vector<std::vector<int>> neighbours(triples);
  for (std::size_t k = 0; k < rows_.size(); ++k) {
    const auto a = static_cast<std::size_t>(rows_[k] - 1) / 3;
    const auto b = static_cast<std::size_t>(columns_[k] - 1) / 3;
    if (rows_[k] % 3 == 1 && columns_[k] % 3 == 1 && a != b && a < triples && b < triples) {
      neighbours[a].push_back(static_cast<int>(b));
      neighbours[b].push_back(static_cast<int>(a));
    }
  }
  std::vector<int> places;
  for (const int place : nested_dissection(graph_of(std::move(neighbours)))) {
    for (int k = 1; k <= 3; ++k) {
      places.push_back(3 * place + k);
    }
  }
  while (static_cast<int>(places.size()) < size_) {
    places.push_back(static_cast<int>(places.size()) + 1);
  }
  return places;
}

MumpsFactor::~MumpsFactor() {
  if (!is_empty()) {
    run(Instance::end);
  }
}

void MumpsFactor::run(int job) {
  mumps_->data.job = job;
  dmumps_c(&mumps_->data);
}

void MumpsFactor::solve(int phase) {
  mumps_->setting(26) = phase;
  run(Instance::solve);
  throw_if_failed("solve with its factor");
}

void MumpsFactor::throw_if_failed(const char* job) const {
  if (mumps_->result(1) < 0) {
    throw Error(fmt::format("MUMPS cannot {}: its error {}, {}", job, mumps_->result(1), mumps_->result(2)));
  }
}

bool MumpsFactor::refresh() {
  if (is_empty()) {
    return true;
  }
  mumps_->data.a = values_.data();
  run(Instance::factorise);
  check(PetscLogFlops(mumps_->data.rinfog[2]));
  return mumps_->result(1) >= 0;
}

int MumpsFactor::negative() const { return is_empty() ? 0 : mumps_->result(12); }

void MumpsFactor::reduce(Eigen::VectorXd& load) {
  if (is_empty() || border_ == 0) {
    return;
  }
  mumps_->data.rhs = load.data();
  solve(1);
  std::copy(border_values_.begin(), border_values_.end(), load.end() - border_);
}

void MumpsFactor::expand(Eigen::VectorXd& solution) {
  if (is_empty()) {
    return;
  }
  std::copy(solution.end() - border_, solution.end(), border_values_.begin());
  mumps_->data.rhs = solution.data();
  solve(border_ > 0 ? 2 : 0);
}

InterfaceFactor::InterfaceFactor(std::vector<int> rows, std::vector<int> columns, int size, const std::string& prefix) {
  const std::size_t order = size;
  if (rows.size() < order * (order + 1) / 2) {
    sparse_ = std::make_unique<MumpsFactor>(std::move(rows), std::move(columns), size, 0, prefix);
    return;
  }
  for (std::size_t k = 0; k < rows.size(); ++k) {
    const auto [first, second] = std::minmax(rows[k], columns[k]);
    place_.push_back(static_cast<std::size_t>(first - 1) * order + static_cast<std::size_t>(second - 1));
  }
  values_.resize(rows.size());
  matrix_.resize(size, size);
  pivots_.resize(order);
  constexpr std::size_t block = 64;  // columns that LAPACK eliminates at once
  workspace_.resize(block * order);
}

bool InterfaceFactor::refresh() {
  if (sparse_) {
    return sparse_->refresh();
  }
  matrix_.setZero();
  for (std::size_t k = 0; k < place_.size(); ++k) {
    matrix_.data()[place_[k]] += values_[k];
  }
  const auto order = static_cast<PetscBLASInt>(matrix_.rows());
  const auto clearance = static_cast<PetscBLASInt>(workspace_.size());
  PetscBLASInt zero_pivot = 0;
  if (order > 0) {
    LAPACKsytrf_("L", &order, matrix_.data(), &order, pivots_.data(), workspace_.data(), &clearance, &zero_pivot);
    check(PetscLogFlops(static_cast<double>(order) * order * order / 3));
  }
  return zero_pivot == 0;
}

int InterfaceFactor::negative() const {
  if (sparse_) {
    return sparse_->negative();
  }
  int twice = 0;
  for (Eigen::Index row = 0; row < matrix_.rows(); ++row) {
    const bool is_of_two = pivots_[row] < 0;  // A pivot of two rows has one negative and one positive eigenvalue.
    twice += is_of_two ? 1 : matrix_(row, row) < 0 ? 2 : 0;
  }
  return twice / 2;
}

void InterfaceFactor::solve(Eigen::VectorXd& values) {
  if (sparse_) {
    sparse_->expand(values);
    return;
  }
  const auto order = static_cast<PetscBLASInt>(matrix_.rows());
  const PetscBLASInt one = 1;
  PetscBLASInt info = 0;
  if (order > 0) {
    LAPACKsytrs_("L", &order, &one, matrix_.data(), &order, pivots_.data(), values.data(), &order, &info);
  }
}

}  // namespace pellicle::linear
