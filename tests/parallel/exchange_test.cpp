#include "parallel/exchange.h"

#include <gtest/gtest.h>

#include <array>
#include <cstdint>

#include "parallel/field.h"

namespace pellicle {
namespace {

/// A ring of items, a few on each rank and none on the last of several: a rank has the two beside its own as ghosts.
struct Exchange : ::testing::Test {
  Exchange() {
    int rank = 0;
    int ranks = 1;
    MPI_Comm_rank(PETSC_COMM_WORLD, &rank);
    MPI_Comm_size(PETSC_COMM_WORLD, &ranks);
    layout = number_owned(PETSC_COMM_WORLD, ranks > 1 && rank == ranks - 1 ? 0 : 3 + rank);
    if (layout.owned > 0 && layout.owned < layout.global) {
      layout.ghost_global = {(layout.first + layout.owned) % layout.global,
                             (layout.first + layout.global - 1) % layout.global};
    }
  }

  /// Of each local item what `of` makes of its global number, of ghosts `unknown`.
  template <class Value, class Of>
  std::vector<Value> owned_values(const Of& of, const Value& unknown) const {
    std::vector<Value> values;
    for (PetscInt i = 0; i < layout.local(); ++i) {
      values.push_back(i < layout.owned ? of(layout.to_global(i)) : unknown);
    }
    return values;
  }

  Layout layout;
};

TEST_F(Exchange, CarriesAnyPlainTypes) {
  struct Mixed {
    std::int64_t id;
    std::array<bool, 3> flags;
  };
  // What no double can tell from its neighbours.
  const auto id = [](PetscInt number) { return (std::int64_t{1} << 60) + number; };
  auto mixed = owned_values<Mixed>([&](PetscInt n) { return Mixed{id(n), {n % 2 == 0, true, n % 3 == 0}}; }, {});
  auto numbers = owned_values<PetscInt>([](PetscInt n) { return -n; }, 1);
  std::vector<bool> flags(layout.local(), false);
  for (PetscInt i = 0; i < layout.owned; ++i) {
    flags[i] = layout.to_global(i) % 2 == 1;
  }
  Field field(layout, 2);
  for (PetscInt i = 0; i < layout.owned; ++i) {
    field.values().col(i) << layout.to_global(i), 0.5;
  }
  update_ghosts(layout, mixed);
  update_ghosts(layout, numbers);
  update_ghosts(layout, flags);
  field.update_ghosts();
  for (PetscInt i = 0; i < layout.local(); ++i) {
    const PetscInt n = layout.to_global(i);
    const auto k = static_cast<std::size_t>(i);
    EXPECT_EQ(mixed[k].id, id(n));
    EXPECT_EQ(mixed[k].flags, (std::array<bool, 3>{n % 2 == 0, true, n % 3 == 0}));
    EXPECT_EQ(numbers[k], -n);
    EXPECT_EQ(flags[k], n % 2 == 1);
    EXPECT_EQ(field.values().col(i), Eigen::Vector2d(n, 0.5));
  }
}

TEST_F(Exchange, VectorsOfOneTypeDoNotMix) {
  auto one = owned_values<PetscInt>([](PetscInt n) { return n; }, -1);
  auto other = owned_values<PetscInt>([](PetscInt n) { return 100 + n; }, -1);
  update_ghosts(layout, one);
  update_ghosts(layout, other);
  for (PetscInt i = 0; i < layout.local(); ++i) {
    EXPECT_EQ(one[i], layout.to_global(i));
    EXPECT_EQ(other[i], 100 + layout.to_global(i));
  }
}

TEST_F(Exchange, AFlagOfAnyGhostReachesTheOwner) {
  using Flags = std::array<bool, 2>;
  std::vector<Flags> flags(layout.local(), Flags{});
  std::vector<Flags> expected = flags;
  for (PetscInt i = layout.owned; i < layout.local(); ++i) {
    flags[i][1] = true;
  }
  if (layout.ghosts() > 0) {  // Neighbours on either side have the first and the last item.
    expected.front()[1] = expected[static_cast<std::size_t>(layout.owned) - 1][1] = true;
  }
  if (layout.owned > 1) {
    flags[1][0] = expected[1][0] = true;
  }
  gather_flags(layout, flags);
  for (PetscInt i = 0; i < layout.owned; ++i) {
    EXPECT_EQ(flags[i], expected[i]) << i;
  }
}

TEST_F(Exchange, AFieldAddsWhatItsGhostsHave) {
  Field field(layout, 1);
  field.values().setOnes();
  field.add_ghosts();
  for (PetscInt i = 0; i < layout.local(); ++i) {
    const bool is_at_an_end = i == 0 || i == layout.owned - 1;
    EXPECT_EQ(field.data()[i], i >= layout.owned ? 0 : layout.ghosts() > 0 && is_at_an_end ? 2 : 1);
  }
}

}  // namespace
}  // namespace pellicle
