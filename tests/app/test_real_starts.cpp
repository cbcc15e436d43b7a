// Starts without a reference on real recordings: rotors that idle, and a sensor that is carried.
#include <cstdint>
#include <fstream>
#include <sstream>
#include <string>

#include <zlib.h>

#include "support.hpp"

namespace viwo {
namespace {

namespace fs = std::filesystem;

using RealStartTest = CommandLineTest;

const std::string kRunConfigurations = std::string(VIWO_TEST_SOURCE_DIR) + "/configs/runs/";

fs::path recording(const char* name) { return fs::path(VIWO_TEST_SHARED_DIR) / "data/real" / name; }

/// Stamp of the first pose of a trajectory, s.
double first_s(const fs::path& path) {
  std::ifstream file(path);
  std::string line;
  while (std::getline(file, line) && line.starts_with("#")) {
  }
  return std::stod(line);
}

/// The rows of a table that are no more than `duration_s` after `begin_ns`, with the header.
void cut(const fs::path& from, std::int64_t begin_ns, double duration_s, const fs::path& to) {
  fs::create_directories(to.parent_path());
  gzFile in = gzopen(from.c_str(), "r"), out = gzopen(to.c_str(), "w1");
  char line[1024];
  for (bool is_header = true; gzgets(in, line, sizeof line) != nullptr; is_header = false) {
    const double t_s = is_header ? 0. : 1e-9 * static_cast<double>(std::stoll(line) - begin_ns);
    if (is_header || (t_s >= 0. && t_s <= duration_s)) gzputs(out, line);
  }
  gzclose(in);
  gzclose(out);
}

TEST_F(RealStartTest, AHelicopterStartsFromTheGroundWhileItsRotorsIdle) {
  const fs::path data = recording("euroc_v1_01_start");
  if (!fs::exists(data)) GTEST_SKIP() << "the recording is not here";
  for (const char* start : {"moving", "standstill"}) {
    expect_done({"run", kRunConfigurations + "euroc.yaml", "--out", "run", "--set",
                 "placeholders.data=" + fs::canonical(data.parent_path()).string(), "--set",
                 "placeholders.sequence=euroc_v1_01_start", "--set",
                 std::string("estimator.start=") + start});
    const nlohmann::json result = summary("run");
    EXPECT_EQ(result.at("status"), "ok");
    // The first image is of 1403715273.262 s.
    EXPECT_LT(first_s(at("run/trajectory.tum")), 1403715274.263) << start;
    EXPECT_LT(result.at("accuracy").at("ate_m").get<double>(), 0.005) << start;
  }
}

TEST_F(RealStartTest, ACarriedSensorStartsInItsMotionWithoutWheels) {
  const fs::path data = recording("euroc_imu_april");
  if (!fs::exists(data)) GTEST_SKIP() << "the recording is not here";
  constexpr std::int64_t kBeginNs = 1404733405732800000;
  for (const int place_s : {5, 20, 35}) {
    const std::int64_t begin_ns = kBeginNs + std::int64_t{1'000'000'000} * place_s;
    for (const char* table : {"imu0", "features0", "state_groundtruth_estimate0"}) {
      cut(data / table / "data.csv.gz", begin_ns, 15., at(table) / "data.csv.gz");
    }
    for (const char* cameras : {"1", "2"}) {
      double ate_m[2];
      for (const bool moving : {false, true}) {
        expect_done({"run", kRunConfigurations + "euroc_board.yaml", "--out", "run", "--set",
                     "placeholders.data=" + at(".").string(), "--set",
                     std::string("cameras.use=") + cameras, "--set",
                     std::string("estimator.start=") + (moving ? "moving" : "reference")});
        ate_m[moving] = summary("run").at("accuracy").at("ate_m").get<double>();
      }
      EXPECT_LT(1e9 * first_s(at("run/trajectory.tum")), static_cast<double>(begin_ns) + 1.5e9)
          << place_s << " s, cameras: " << cameras;
      EXPECT_LT(ate_m[1], 1.5 * ate_m[0]) << place_s << " s, cameras: " << cameras;
    }
  }
}

}  // namespace
}  // namespace viwo
