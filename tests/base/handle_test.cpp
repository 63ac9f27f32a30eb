#include "base/handle.h"

#include <gtest/gtest.h>

#include <type_traits>

#include "base/error.h"

namespace pellicle {

int destroyed = 0;

PetscErrorCode destroy_number(int** number) {
  ++destroyed;
  delete *number;
  *number = nullptr;
  return 0;
}

using NumberHandle = Handle<int*, destroy_number>;

TEST(Handle, DestroysOnce) {
  destroyed = 0;
  {
    NumberHandle handle;
    *handle.create() = new int(3);
    EXPECT_EQ(*static_cast<int*>(handle), 3);
    EXPECT_EQ(destroyed, 0);
  }
  EXPECT_EQ(destroyed, 1);
  { const NumberHandle empty; }
  EXPECT_EQ(destroyed, 1);
}

TEST(Handle, MovesAndDoesNotCopy) {
  static_assert(!std::is_copy_constructible_v<NumberHandle> && !std::is_copy_assignable_v<NumberHandle>);
  destroyed = 0;
  {
    NumberHandle first;
    *first.create() = new int(1);
    NumberHandle second(std::move(first));
    EXPECT_EQ(*static_cast<int*>(second), 1);
    NumberHandle third;
    *third.create() = new int(2);
    third = std::move(second);
    EXPECT_EQ(*static_cast<int*>(third), 1);
  }
  EXPECT_EQ(destroyed, 2);
}

TEST(Handle, CreateDestroysWhatWasHeld) {
  destroyed = 0;
  NumberHandle handle;
  *handle.create() = new int(1);
  *handle.create() = new int(2);
  EXPECT_EQ(destroyed, 1);
  EXPECT_EQ(*static_cast<int*>(handle), 2);
}

TEST(Handle, HoldsPetscObjects) {
  VecHandle vector;
  check(VecCreateSeq(PETSC_COMM_SELF, 3, vector.create()));
  check(VecSet(vector, 2));
  PetscReal sum = 0;
  check(VecNorm(vector, NORM_1, &sum));
  EXPECT_EQ(sum, 6);
}

}  // namespace pellicle
