// Whether what sensors give can be true: told from the samples alone, before and whatever the
// filter makes of them. Sums only: nothing grows with the length of a run.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "finding.hpp"
#include "viwo/experiment/run.hpp"

namespace viwo::experiment {

class Plausibility {
 public:
  explicit Plausibility(const RunSetup& setup);
  ~Plausibility();

  /// Each sample that goes to the estimator, in its order.
  void add(const std::string& sensor, SampleView sample);

  /// What cannot be true, with the sensor and the most likely cause, as of the last second.
  const Findings& findings() const { return findings_; }
  /// Nothing more is to come.
  void finish();

 private:
  struct Checks;
  void look();

  std::unique_ptr<Checks> checks_;
  std::int64_t next_look_ns_ = 0;
  Findings findings_;
};

}  // namespace viwo::experiment
