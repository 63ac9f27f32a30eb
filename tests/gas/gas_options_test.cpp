#include "gas/gas_options.h"

#include <gtest/gtest.h>

#include <map>

namespace pellicle {
namespace {

TEST(GasOptions, AChamberIsReadByItsKeysInUnits) {
  OptionTable table;
  GasOptions gas;
  std::map<std::string, ChamberOptions> chambers;
  describe(table, gas);
  table.add_objects("chambers", chambers, "volumes filled with gas");
  table.create_object("chambers", "air");
  const auto assign = [&](const std::string& name, const std::string& text) {
    Option* option = table.find_name(name);
    ASSERT_NE(option, nullptr) << name;
    option->assign(option->from_command_line(text));
  };
  assign("gas_ambient_pressure", "1 bar");
  assign("chambers_air_law", "adiabatic");
  assign("chambers_air_amount", "0,1;2 s,0.5");
  assign("chambers_air_gamma", "1.667");
  assign("chambers_air_volume_ratio", "0,1;1500 ms,3");
  EXPECT_EQ(gas.ambient_pressure, 1e5);
  const ChamberOptions& air = chambers.at("air");
  EXPECT_EQ(air.law.name(), "adiabatic");
  EXPECT_EQ(air.amount, (Rows{{0, 1}, {2, 0.5}}));
  EXPECT_EQ(air.gamma, 1.667);
  EXPECT_EQ(air.volume_ratio, (Rows{{0, 1}, {1.5, 3}}));
  EXPECT_TRUE(air.pressure.empty());
}

}  // namespace
}  // namespace pellicle
