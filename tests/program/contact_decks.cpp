// Whole decks whose surfaces touch themselves or each other: nothing crosses, by an independent test after every step.

#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

#include "tests/support/csv.h"
#include "tests/support/program.h"

namespace pellicle {
namespace {

/// With contact if the deck has none.
class LongContactDecks : public ProgramTest, public testing::WithParamInterface<const char*> {};

TEST_P(LongContactDecks, DoNotCross) {
  const std::string deck = GetParam();
  set_time_limit(1500);
  succeed(1, {deck_path(deck), "-contact_self", "-contact_check", "-output_interval_time", "10", "-output_directory",
              "out"});
  const bool has_objects = std::filesystem::exists(folder() / "out/contacts.csv");
  const auto table = read_csv(folder() / (has_objects ? "out/contacts.csv" : "out/history.csv"));
  const std::vector<double>& crossings = table.at("crossings");
  EXPECT_GT(crossings.size(), 100U);
  EXPECT_EQ(*std::max_element(crossings.begin(), crossings.end()), 0);
}

INSTANTIATE_TEST_SUITE_P(Decks, LongContactDecks,
                         testing::Values("burning_paper", "hot_sphere_c", "shirt", "burning_torus", "sheet_weights_d",
                                         "cloth_over_sphere", "folding_strip", "crumpling_sheet", "two_balloons",
                                         "balloon_in_box", "stack_of_sheets", "cloth_on_balloon", "tied_balloon",
                                         "deflating_balloon"),
                         [](const auto& deck) { return std::string(deck.param); });

}  // namespace
}  // namespace pellicle
