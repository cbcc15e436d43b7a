// Whether what two cameras see at the same time lies before them.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "viwo/api/measurement.hpp"
#include "viwo/api/rig.hpp"
#include "viwo/plausibility/finding.hpp"

namespace viwo {

class StereoCheck {
 public:
  explicit StereoCheck(const std::vector<CameraPrior>& cameras);

  void add(const std::string& sensor, const FeatureSample& sample);
  void findings(Findings& out) const;

 private:
  static constexpr std::size_t kMostPoints = 30;  ///< of an image

  void compare(const FeatureSample& other);

  std::string sensor_;
  std::vector<CameraView> cameras_;  ///< the first two; none if there are fewer
  FeatureSample last_;
  std::int64_t before_ = 0, behind_ = 0;
};

}  // namespace viwo
