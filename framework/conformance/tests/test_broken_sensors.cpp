// Each mistake of a sensor fails, with a message that names it.
#include <fstream>

#include "support.hpp"

namespace viwo::conformance {
namespace {

std::string sensor_failures(const std::string& defect) { return failures_of("sensor", defect); }

/// With a file that the sensor reads.
std::string failures_with_file(const std::string& defect) {
  const auto folder = std::filesystem::temp_directory_path() / ("viwo_conformance_" + defect);
  std::filesystem::create_directories(folder);
  std::ofstream(folder / "a.txt") << "samples\n";
  std::ofstream(folder / "a.yaml")
      << "sensors: {one: {type: broken_" << defect << ", path: a.txt}}\n";
  Options options;
  options.config = folder / "a.yaml";
  const std::string text = failures_of("sensor", defect, options);
  std::filesystem::remove_all(folder);
  return text;
}

TEST(BrokenSensor, WithoutAMistakeItPasses) {
  EXPECT_EQ(sensor_failures("none"), "");
  EXPECT_EQ(failures_with_file("none"), "");
}

TEST(BrokenSensor, StampsOutOfOrder) {
  EXPECT_EQ(sensor_failures("order"),
            "measurements: measurement 12 (imu) at 59000000 ns comes after one at 60000000 ns - "
            "next() gives measurements in time order");
}

TEST(BrokenSensor, AValueThatIsNotFinite) {
  EXPECT_EQ(sensor_failures("nan"),
            "measurements: measurement 16 (imu) at 85000000 ns has values that are not finite");
}

TEST(BrokenSensor, AKindOfSamplesThatYieldsDoesNotName) {
  EXPECT_EQ(sensor_failures("yields"),
            "measurements: measurement 0 (imu) at 5000000 ns is of a kind that yields() does not "
            "name - it names all that next() may give");
  EXPECT_EQ(sensor_failures("yields_nothing"), "measurements: yields() names no kind of samples");
}

TEST(BrokenSensor, NumbersThatDependOnWhatRanBefore) {
  EXPECT_EQ(sensor_failures("clock"),
            "repeatable: not the same for the same seed: measurement 0 differs - take random "
            "numbers from HostServices::seed, and no clock\nindependent instances: two "
            "instances that are read in turn see each other: measurement 0 differs - no static "
            "variables");
}

TEST(BrokenSensor, MeasurementsBehindTheEnd) {
  EXPECT_EQ(sensor_failures("goes_on"),
            "measurements: next() goes on after kEnd - once at the end it stays there");
}

TEST(BrokenSensor, AFileThatIsNotLookedAt) {
  EXPECT_EQ(failures_with_file("ignores_files"),
            "files: parameter 'path' names a file that does not exist, and nothing is said - "
            "throw InputError with file and line");
}

TEST(BrokenSensor, AnExceptionForAFileThatTheUserCouldMend) {
  EXPECT_EQ(failures_with_file("throws_on_files"),
            "files: parameter 'path' names a file that does not exist: threw 'bad file' - "
            "throw InputError with file and line");
}

}  // namespace
}  // namespace viwo::conformance
