// Whether what sensors give can be true, and goes on: told from the samples alone, before and
// whatever the filter makes of them. Sums only: nothing grows with the length of a run.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "viwo/plausibility/finding.hpp"
#include "viwo/setup/run_setup.hpp"

namespace viwo {

class Plausibility {
 public:
  /// `live`: of what happens, in the order of arrival.
  explicit Plausibility(const RunSetup& setup, bool live = false);
  /// Of a run without a filter, whose configuration does not say how an IMU is mounted. `up`:
  /// upwards in I, which is upwards of the base on average; zero where that is not known.
  Plausibility(const RunSetup& setup, const Eigen::Vector3d& up);
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

 private:
  struct Checks;
  void watch_streams(const RunSetup& setup);
  void watch_without_filter(const RunSetup& setup, const Eigen::Vector3d& up);
  void watch(const std::string& sensor, SampleView sample);
  void look_now_and_then();
  void look(bool at_end);

  std::unique_ptr<Checks> checks_;
  bool live_;
  std::optional<std::int64_t> now_ns_;  ///< the newest time of all streams
  std::optional<std::int64_t> zero_ns_;
  bool is_begun_at_ = false;
  std::int64_t n_watched_ = 0;  ///< samples
  std::int64_t waited_ns_ = 0;  ///< since then, without a sample
  std::int64_t next_look_ns_ = 0;
  Findings findings_;
};

}  // namespace viwo
