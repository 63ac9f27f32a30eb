#include "projection/spring_lines.h"

#include <gtest/gtest.h>
#include <petscsys.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "meshing/generators.h"
#include "parallel/collective.h"
#include "parallel/exchange.h"
#include "surface/shell.h"
#include "tests/support/grid_mesh.h"
#include "tests/support/solver_options.h"

namespace pellicle {
namespace {

/// The lines of a flat grid, whose springs are along lines of the plane.
class SpringLinesOfAGrid : public ::testing::TestWithParam<Colour> {
 protected:
  static constexpr double edge = 0.2;  // [m]

  void make(int nx, int ny, MPI_Comm comm = PETSC_COMM_WORLD) {
    sheet_ = make_sheet(comm, grid_mesh(nx, ny, edge), {});
    lines_ = find_lines(springs(), sheet_.particles);
  }
  const SpringSet& springs() const { return sheet_.of(GetParam()); }
  /// Where a particle is in the plane, in halves of edges.
  std::array<int, 2> place(PetscInt particle) const {
    return {static_cast<int>(std::lround(2 * sheet_.rest(0, particle) / edge)),
            static_cast<int>(std::lround(2 * sheet_.rest(1, particle) / edge))};
  }
  /// On which line of the plane a local spring is: its direction, and what is the same all along the line.
  std::array<int, 3> line_of(PetscInt spring) const {
    const auto [x, y] = place(springs().ends[spring][0]);
    const auto [x_end, y_end] = place(springs().ends[spring][1]);
    std::array<int, 2> along{x_end - x, y_end - y};
    if (along < std::array<int, 2>{0, 0}) {
      along = {-along[0], -along[1]};
    }
    return {along[0], along[1], along[0] * y - along[1] * x};
  }
  /// The middle of a spring along its line.
  int middle_of(PetscInt spring) const {
    const std::array<int, 3> line = line_of(spring);
    int sum = 0;
    for (const PetscInt end : springs().ends[spring]) {
      sum += line[0] * place(end)[0] + line[1] * place(end)[1];
    }
    return sum;
  }
  bool share_a_particle(PetscInt one, PetscInt other) const {
    const auto& a = springs().ends[one];
    return std::find_first_of(a.begin(), a.end(), springs().ends[other].begin(), springs().ends[other].end()) !=
           a.end();
  }

  Sheet sheet_;
  SpringLines lines_;
};

INSTANTIATE_TEST_SUITE_P(, SpringLinesOfAGrid, ::testing::ValuesIn(all_colours),
                         [](const auto& info) { return colour_names[static_cast<std::size_t>(info.param)]; });

TEST_P(SpringLinesOfAGrid, AreStraightAndHaveSpringsInTheirOrder) {
  make(80, 60);
  for (const LineFamily* family : {&lines_.eliminated, &lines_.kept}) {
    for (const std::vector<PetscInt>& line : family->lines) {
      for (std::size_t k = 1; k < line.size(); ++k) {
        ASSERT_EQ(line_of(line[k]), line_of(line[0]));
        if (k > 1) {
          EXPECT_EQ(middle_of(line[k]) - middle_of(line[k - 1]), middle_of(line[1]) - middle_of(line[0]));
        }
      }
    }
  }
}

TEST_P(SpringLinesOfAGrid, AreOfOneFamilyOnAllRanksWhereTheyAreParallel) {
  make(80, 60);
  // Springs by net, of which yellow ones make two without a common particle, then family and direction.
  std::array<long, 8> count{};
  for (std::size_t family = 0; family < 2; ++family) {
    for (const std::vector<PetscInt>& line : (family == 0 ? lines_.eliminated : lines_.kept).lines) {
      const auto [x, y] = place(springs().ends[line[0]][0]);
      const std::size_t net = GetParam() == Colour::yellow && (x + y) % 4 != 0 ? 1 : 0;
      const auto [along_x, along_y, offset] = line_of(line[0]);
      const std::size_t direction = std::abs(along_x) > std::abs(along_y) || along_x * along_y > 0 ? 1 : 0;
      count[4 * net + 2 * family + direction] += static_cast<long>(line.size());
    }
  }
  count = sum_over_ranks(PETSC_COMM_WORLD, count);
  const auto all = static_cast<double>(springs().layout.global);
  EXPECT_NEAR(static_cast<double>(count[0] + count[1] + count[4] + count[5]) / all, 0.5, 0.1);
  const long strays =
      std::min(count[0] + count[3], count[1] + count[2]) + std::min(count[4] + count[7], count[5] + count[6]);
  EXPECT_LE(static_cast<double>(strays), ranks() == 1 ? 0 : 0.01 * all);
}

TEST_P(SpringLinesOfAGrid, EndAtSeparatorsThatAreNumberedAlongThem) {
  make(80, 60);
  for (const LineFamily* family : {&lines_.eliminated, &lines_.kept}) {
    // Of each separator of all ranks its number and its line, by its global number as a spring.
    std::vector<PetscInt> number(static_cast<std::size_t>(springs().local()), -1);
    std::vector<std::array<PetscInt, 2>> own;
    ASSERT_EQ(family->separators.size(), family->numbers.size());
    std::set<std::vector<PetscInt>> lines(family->lines.begin(), family->lines.end());
    for (std::size_t k = 0; k < family->separators.size(); ++k) {
      number[family->separators[k]] = family->numbers[k];
      own.push_back({family->numbers[k], springs().layout.to_global(family->separators[k])});
      EXPECT_EQ(lines.count({family->separators[k]}), 1) << "a separator is a line of its own";
    }
    update_ghosts(springs().layout, number);
    std::vector<std::array<PetscInt, 2>> all = of_all_ranks(PETSC_COMM_WORLD, own);
    std::sort(all.begin(), all.end());
    EXPECT_EQ(family->separators_of_all, all.size());
    for (std::size_t k = 0; k < all.size(); ++k) {
      EXPECT_EQ(all[k][0], k);
    }
    // Where lines end, and which separators are beside each other.
    std::set<std::pair<PetscInt, std::size_t>> with_end;
    for (const LineEnd& end : family->ends) {
      const std::vector<PetscInt>& line = family->lines[end.line];
      EXPECT_EQ(end.pair.own, end.end == 0 ? line.front() : line.back());
      EXPECT_TRUE(share_a_particle(end.pair.own, end.pair.other));
      EXPECT_EQ(line_of(end.pair.own), line_of(end.pair.other));
      EXPECT_EQ(number[end.pair.other], end.number);
      EXPECT_GE(end.number, 0);
      EXPECT_TRUE(with_end.insert({static_cast<PetscInt>(end.line), end.end}).second);
    }
    for (const auto& [line, end] : with_end) {
      EXPECT_TRUE(with_end.count({line, 1}) == 1) << "a line that ends at one separator does so with its last spring";
    }
    ASSERT_EQ(family->neighbours.size(), family->neighbour_numbers.size());
    std::vector<std::array<PetscInt, 2>> pairs;
    for (std::size_t k = 0; k < family->neighbours.size(); ++k) {
      const auto [one, other] = family->neighbours[k];
      EXPECT_TRUE(share_a_particle(one, other));
      EXPECT_EQ(line_of(one), line_of(other));
      EXPECT_EQ(number[one], family->neighbour_numbers[k]);
      EXPECT_EQ(number[other], number[one] + 1);
      pairs.push_back({number[one], number[other]});
    }
    pairs = of_all_ranks(PETSC_COMM_WORLD, pairs);
    const auto pair_count = pairs.size();
    std::sort(pairs.begin(), pairs.end());
    pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
    EXPECT_EQ(pairs.size(), pair_count) << "each pair is on one rank";
    // Numbers rise along a line of the plane without others between them.
    std::vector<std::array<int, 5>> own_places;
    for (std::size_t k = 0; k < family->separators.size(); ++k) {
      const std::array<int, 3> line = line_of(family->separators[k]);
      own_places.push_back(
          {static_cast<int>(family->numbers[k]), line[0], line[1], line[2], middle_of(family->separators[k])});
    }
    std::vector<std::array<int, 5>> places = of_all_ranks(PETSC_COMM_WORLD, own_places);
    std::sort(places.begin(), places.end());
    std::map<std::array<int, 3>, std::vector<int>> along;
    for (const auto& [at, x, y, offset, middle] : places) {
      along[{x, y, offset}].push_back(middle);
    }
    for (const auto& [line, middles] : along) {
      const auto rises = std::is_sorted(middles.begin(), middles.end());
      EXPECT_TRUE(rises || std::is_sorted(middles.rbegin(), middles.rend()));
    }
  }
  const PetscInt separators = lines_.eliminated.separators_of_all + lines_.kept.separators_of_all;
  EXPECT_EQ(separators > 0, ranks() > 1);
}

TEST_P(SpringLinesOfAGrid, HaveNoSeparatorsWhereTheseWouldBeTooMany) {
  make(7, 5);
  for (const LineFamily* family : {&lines_.eliminated, &lines_.kept}) {
    if (ranks() > 1) {  // A separator is worth 10 springs of each rank.
      EXPECT_LE(10 * family->separators_of_all * ranks(), springs().layout.global);
    }
    EXPECT_EQ(sum_over_ranks(PETSC_COMM_WORLD, static_cast<int>(family->separators.size())), family->separators_of_all);
  }
}

/// How many lines there are of each length.
std::map<std::size_t, int> lengths_of(const LineFamily& family) {
  std::map<std::size_t, int> count;
  for (const std::vector<PetscInt>& line : family.lines) {
    ++count[line.size()];
  }
  return count;
}

TEST(SpringLines, OfATorusAreClosedAndCutAtOneSpring) {
  const Sheet sheet = make_sheet(PETSC_COMM_SELF, torus_mesh({12, 8}, 1, 0.3), {});
  using Count = std::map<std::size_t, int>;
  for (const Colour colour : {Colour::blue, Colour::green}) {
    const SpringLines lines = find_lines(sheet.of(colour), sheet.particles);
    const Count eliminated = lengths_of(lines.eliminated);
    const Count kept = lengths_of(lines.kept);
    // 8 rings of 12 and 12 rings of 8; what is cut out of any ring, one spring of each of 20, is kept.
    const bool are_long = eliminated == Count{{11, 8}};
    EXPECT_TRUE(are_long || eliminated == (Count{{7, 12}}));
    EXPECT_EQ(kept, are_long ? (Count{{1, 20}, {7, 12}}) : (Count{{1, 20}, {11, 8}}));
  }
}

TEST(SpringLines, OfATorusThatSeveralRanksShareAreOpenedAtOneSeparator) {
  const Sheet sheet = make_sheet(PETSC_COMM_WORLD, torus_mesh({120, 60}, 1, 0.3), {});
  const SpringSet& springs = sheet.of(Colour::blue);
  const SpringLines lines = find_lines(springs, sheet.particles);
  for (const LineFamily* family : {&lines.eliminated, &lines.kept}) {
    std::vector<PetscInt> numbers = of_all_ranks(PETSC_COMM_WORLD, family->numbers);
    std::sort(numbers.begin(), numbers.end());
    ASSERT_EQ(numbers.size(), family->separators_of_all);
    for (std::size_t k = 0; k < numbers.size(); ++k) {
      EXPECT_EQ(numbers[k], k);
    }
    // The separators beside each other differ by 1, and so do those at both ends of a line: a ring is open.
    std::map<std::size_t, std::vector<PetscInt>> at_line;
    for (const LineEnd& end : family->ends) {
      at_line[end.line].push_back(end.number);
    }
    for (const auto& [line, ends] : at_line) {
      if (ends.size() == 2) {
        EXPECT_EQ(std::abs(ends[0] - ends[1]), 1);
      }
    }
  }
  EXPECT_EQ(lines.eliminated.separators_of_all > 0 || lines.kept.separators_of_all > 0, ranks() > 1);
}

}  // namespace
}  // namespace pellicle
