// A fixture for the tests of tables of log folders.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "log_files.hpp"
#include "viwo/api/measurement.hpp"
#include "viwo/asl/asl.hpp"

namespace viwo::log {

class AslTables : public InFolder {
 protected:
  /// The message for a table of this text, without the file's name.
  template <class Read>
  std::string refusal(const std::string& text, Read&& read) const {
    const auto file = write("t.csv", text);
    const std::string what = error_of([&] { read(file); });
    EXPECT_TRUE(what.starts_with(file.string())) << what;
    return what.substr(std::min(what.size(), file.string().size()));
  }

  void write_log(const std::vector<Measurement>& measurements) const {
    AslWriter writer(folder_ / "log");
    for (const Measurement& measurement : measurements) EXPECT_TRUE(writer.write(measurement));
    writer.close();
  }

  std::mt19937_64 random_{7};
  /// Of all magnitudes, so that texts of every length occur.
  double any() {
    std::uniform_real_distribution<double> mantissa(-1., 1.);
    std::uniform_int_distribution<int> exponent(-60, 20);
    return std::ldexp(mantissa(random_), exponent(random_));
  }
  template <std::size_t N>
  void fill(std::array<double, N>& values) {
    for (double& value : values) value = any();
  }
};

}  // namespace viwo::log
