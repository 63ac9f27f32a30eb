#include <gtest/gtest.h>

#include <sstream>

#include "options_fixture.h"

namespace pellicle {

bool contains(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

TEST(Manual, HelpNamesEveryOptionWithDefaultUnitAndRange) {
  const SampleOptions options;
  const std::string help = help_text(options.table);
  for (const char* part :
       {"usage: mpirun -n N pellicle DECK.yaml", "\ngeneral\n  -dynamics projection (projection, spring)\n",
        "\nheat\n  -heat_diffusivity 0.002 m^2/s (at least 0)\n      Thermal diffusivity. [burning paper, eq. 2]\n",
        "  -mesh_edge_length none (more than 0)\n", "  -mesh_file \"\"\n",
        "  -time_gravity 0, 0, -9.81 m/s^2 (3 numbers)\n", "\nbodies\n", "  -bodies_NAME_radius 0.1 m (more than 0)\n",
        "-project_red_"}) {
    EXPECT_TRUE(contains(help, part)) << part << "\n" << help;
  }
  std::istringstream lines(help);
  for (std::string line; std::getline(lines, line);) {
    EXPECT_LE(line.size(), 100u) << line;
  }
}

TEST(Manual, TheTableHasARowForEveryOption) {
  const SampleOptions options;
  const std::string table = options_markdown(options.table);
  EXPECT_TRUE(contains(
      table,
      "| `heat.diffusivity` | `-heat_diffusivity` | object | 0.002 | m^2/s | at least 0 | | Thermal diffusivity. | "
      "burning paper, eq. 2 |\n"))
      << table;
  EXPECT_TRUE(contains(table, "| `bodies.NAME.radius` | `-bodies_NAME_radius` | object | 0.1 | m | more than 0 |"));
  EXPECT_TRUE(contains(table, "\n## general\n"));
}

TEST(Manual, DefaultsAreThoseOfTheDeclaration) {
  SampleOptions options;
  const std::string before = options_markdown(options.table);
  ASSERT_EQ(options.deck_error("heat: {diffusivity: 5}\nbodies: {ball: {radius: 3}}\n"), "");
  EXPECT_EQ(options_markdown(options.table).substr(0, before.find("## bodies")),
            before.substr(0, before.find("## bodies")));
}

TEST(Manual, NamesWhatAnOptionNeedsAndWhatTheProgramDoesNotDo) {
  OptionTable table;
  std::string shape = "torus";
  double radius = 1;
  table.add("mesh.shape", shape).help("Shape.");
  table.add("mesh.radius", radius).acts_with(one_of("mesh.shape", shape, {"torus", "disc"})).help("Radius.");
  EXPECT_TRUE(contains(help_text(table), "  -mesh_radius 1\n      Radius. {mesh.shape: torus, disc}\n"))
      << help_text(table);
  EXPECT_TRUE(contains(options_markdown(table), "| 1 | | | mesh.shape: torus, disc | Radius. | |\n"))
      << options_markdown(table);
  for (const std::string& text : {help_text(table), options_markdown(table)}) {
    EXPECT_TRUE(contains(text, "What the program does not do stands in docs/limits.md")) << text;
  }
}

}  // namespace pellicle
