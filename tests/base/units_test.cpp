#include "base/units.h"

#include <gtest/gtest.h>

#include <cmath>

#include "base/error.h"

namespace pellicle {

TEST(Units, EveryUnitInSi) {
  const struct {
    const char* text;
    double value;
    Dimension dimension;
  } cases[] = {{"0.3 mm", 3e-4, {1, 0, 0, 0}},
               {"5cm", 0.05, {1, 0, 0, 0}},
               {"12 um", 12e-6, {1, 0, 0, 0}},
               {"1 km", 1000, {1, 0, 0, 0}},
               {"450 degC", 723.15, {0, 0, 0, 1}},
               {"-10 degC", 263.15, {0, 0, 0, 1}},
               {"300 K", 300, {0, 0, 0, 1}},
               {"2 ms", 2e-3, {0, 0, 1, 0}},
               {"3 ns", 3e-9, {0, 0, 1, 0}},
               {"1.5 min", 90, {0, 0, 1, 0}},
               {"2 h", 7200, {0, 0, 1, 0}},
               {"5 g", 5e-3, {0, 1, 0, 0}},
               {"1 mg", 1e-6, {0, 1, 0, 0}},
               {"2 t", 2000, {0, 1, 0, 0}},
               {"20 1/s", 20, {0, 0, -1, 0}},
               {"2 kHz", 2000, {0, 0, -1, 0}},
               {"0.02 1/(K s)", 0.02, {0, 0, -1, -1}},
               {"80 g/m^2", 0.08, {-2, 1, 0, 0}},
               {"1 g/cm^3", 1000, {-3, 1, 0, 0}},
               {"25 W/(m^2 K)", 25, {0, 1, -3, -1}},
               {"25 W/m^2/K", 25, {0, 1, -3, -1}},
               {"25 W*m^-2*K^-1", 25, {0, 1, -3, -1}},
               {"3 kN", 3000, {1, 1, -2, 0}},
               {"7 kPa", 7000, {-1, 1, -2, 0}},
               {"2 MPa", 2e6, {-1, 1, -2, 0}},
               {"1 GPa", 1e9, {-1, 1, -2, 0}},
               {"1 bar", 1e5, {-1, 1, -2, 0}},
               {"3 l", 3e-3, {3, 0, 0, 0}},
               {"4 kJ", 4000, {2, 1, -2, 0}},
               {"8 mmol", 8e-3, {0, 0, 0, 0, 1}},
               {"8.3 J/(mol K)", 8.3, {2, 1, -2, -1, -1}},
               {"2 mm^2/s", 2e-6, {2, 0, -1, 0}},
               {"9.81 m/s^2", 9.81, {1, 0, -2, 0}},
               {"0.5 rad", 0.5, {0, 0, 0, 0, 0, 1}},
               {"180 deg", std::acos(-1.0), {0, 0, 0, 0, 0, 1}},
               {"15 %", 0.15, {}},
               {"+2.5e3 m", 2500, {1, 0, 0, 0}}};
  for (const auto& c : cases) {
    const Quantity quantity = parse_quantity(c.text);
    EXPECT_DOUBLE_EQ(quantity.value, c.value) << c.text;
    EXPECT_EQ(quantity.dimension, c.dimension) << c.text;
    EXPECT_FALSE(quantity.bare) << c.text;
  }
}

TEST(Units, ABareNumberIsSi) {
  const Quantity quantity = parse_quantity(" -1e-3 ");
  EXPECT_EQ(quantity.value, -1e-3);
  EXPECT_TRUE(quantity.bare);
}

TEST(Units, APrefixRoundsOnce) {
  EXPECT_EQ(parse_quantity("0.3 mm").value, 3e-4);
  EXPECT_EQ(parse_quantity("0.7 ms").value, 7e-4);
}

std::string failure(const std::string& text) {
  try {
    parse_quantity(text);
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

TEST(Units, WhatIsNotUnderstoodIsNamed) {
  EXPECT_EQ(failure("abc"), "\"abc\" is not a finite number");
  EXPECT_EQ(failure(""), "\"\" is not a finite number");
  EXPECT_EQ(failure("nan"), "\"nan\" is not a finite number");
  EXPECT_EQ(failure("inf"), "\"inf\" is not a finite number");
  EXPECT_EQ(failure("1e999"), "\"1e999\" is not a finite number");
  EXPECT_EQ(failure("1e308 km"), "\"1e308 km\" is not a finite number in SI");
  EXPECT_EQ(failure("1 2"), "unit \"2\" is not understood");
  EXPECT_EQ(failure("1 1"), "\"1 1\" is two numbers");
  EXPECT_EQ(failure("+-1"), "\"+-1\" is not a finite number");
  EXPECT_EQ(failure("1,5"), "unit \",5\" is not understood");
  EXPECT_EQ(failure("0x10"), "unknown unit \"x\"");
  EXPECT_EQ(failure(std::string("1\0 mm", 5)), "unit \"\\x00 mm\" is not understood");
  EXPECT_EQ(failure(std::string("1 mm\0", 5)), "unit \"mm\\x00\" is not understood");
  EXPECT_EQ(failure("1\nmm"), "unit \"\\x0Amm\" is not understood");
  EXPECT_EQ(failure("2 furlong"), "unknown unit \"furlong\"");
  EXPECT_EQ(failure("2 kmin"), "unknown unit \"kmin\"");
  EXPECT_EQ(failure("2 W/(m^2 K"), "unit \"W/(m^2 K\" is not understood");
  EXPECT_EQ(failure("2 m)"), "unit \"m)\" is not understood");
  EXPECT_EQ(failure("2 m^"), "unit \"m^\" is not understood");
  EXPECT_EQ(failure("2 m/"), "unit \"m/\" is not understood");
  EXPECT_EQ(failure("2 W/m^2 K"), "unit \"W/m^2 K\" is ambiguous without parentheses after the /");
  EXPECT_EQ(failure("2 degC/s"), "unit \"degC/s\": degC stands alone only");
  EXPECT_EQ(failure("2 1/degC"), "unit \"1/degC\": degC stands alone only");
}

TEST(Units, NumbersReadBackAsTheSame) {
  EXPECT_EQ(number_text(0.0003), "0.0003");
  EXPECT_EQ(number_text(-9.81), "-9.81");
  EXPECT_EQ(number_text(0), "0");
  EXPECT_EQ(number_text(100), "100");
  EXPECT_EQ(number_text(-4500.5), "-4500.5");
  EXPECT_EQ(number_text(2e9), "2e+09");
  for (const double value : {1.0 / 3, 0.1 + 0.2, 1e300, 5e-324}) {
    EXPECT_EQ(std::strtod(number_text(value).c_str(), nullptr), value);
  }
}

}  // namespace pellicle
