// Whether what sensors give can be true, and goes on: told from the samples alone, before and
// whatever the filter makes of them. Sums only: nothing grows with the length of a run.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "viwo/plausibility/finding.hpp"
#include "viwo/setup/run_setup.hpp"

namespace viwo {

/// Upwards in I, of length 1: the mean direction of the specific force; zero where that has no
/// direction, or there is no IMU.
Eigen::Vector3d up_of(std::span<const ImuSample> imu);

/// What a run without a filter has, of the sensors that its routes name.
struct DeadReckoned {
  std::span<const ImuSample> imu;
  std::span<const EncoderSample> wheels;
  std::span<const HeadingSample> headings;
};
/// What cannot be true of it; of the wheels that is a doubt, as nothing makes up for them. How the
/// IMU is mounted is not configured: gravity says so, which is upwards on average. Times in texts
/// count from `zero_ns`.
Findings implausible(const RunSetup& setup, const DeadReckoned& data, std::int64_t zero_ns);

/// How far wheels say that they went, with their intrinsics as configured.
struct WheelsWay {
  double duration_s = 0.;  ///< of the samples
  double length_m = 0.;
};

class Plausibility {
 public:
  /// Of a run with a filter; `live`: of what happens, in the order of arrival.
  explicit Plausibility(const RunSetup& setup, bool live = false);
  ~Plausibility();

  /// Each sample that goes to the estimator, in its order.
  void add(const std::string& sensor, SampleView sample);

  /// Nothing has come at all for that long, by the clock of this machine.
  void wait(double seconds);
  /// Times in texts count from here; without it from the first sample.
  void begin_at(std::int64_t t_ns) {
    zero_ns_ = t_ns;
    is_begun_at_ = true;
  }

  /// What cannot be true, with the sensor and the most likely cause, as of the last second.
  const Findings& findings() const { return findings_; }
  /// Nothing more is to come.
  void finish();

  /// Of the first wheel set.
  WheelsWay way() const;

 private:
  struct Checks;
  friend Findings implausible(const RunSetup&, const DeadReckoned&, std::int64_t);
  void watch_streams(const RunSetup& setup);
  void watch_without_filter(const RunSetup& setup, const Eigen::Vector3d& up);
  void watch(const std::string& sensor, SampleView sample);
  void look_now_and_then();
  void look(bool at_end);

  std::unique_ptr<Checks> checks_;
  bool live_, has_filter_;
  std::optional<std::int64_t> now_ns_;  ///< the newest time of all streams
  std::optional<std::int64_t> zero_ns_;
  bool is_begun_at_ = false;
  std::int64_t n_watched_ = 0;  ///< samples
  std::int64_t waited_ns_ = 0;  ///< since then, without a sample
  std::int64_t next_look_ns_ = 0;
  Findings findings_;
};

}  // namespace viwo
