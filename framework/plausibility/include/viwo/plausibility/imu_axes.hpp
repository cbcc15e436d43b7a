// What the six numbers of an IMU are called.
#pragma once

#include <array>
#include <string>

#include <Eigen/Core>

namespace viwo {

inline constexpr std::array<const char*, 6> kImuAxes = {"gyro's x",          "gyro's y",
                                                        "gyro's z",          "accelerometer's x",
                                                        "accelerometer's y", "accelerometer's z"};

/// The largest entry of a direction: "+x", "-z".
inline std::string axis_of(const Eigen::Vector3d& direction) {
  int i = 0;
  direction.cwiseAbs().maxCoeff(&i);
  return std::string(direction[i] < 0. ? "-" : "+") + "xyz"[i];
}

}  // namespace viwo
