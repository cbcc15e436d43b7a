// Random numbers with a fixed algorithm: the distributions of the standard library differ between
// implementations, std::mt19937_64 does not.
#pragma once

#include <cstdint>
#include <random>

namespace viwo::sim {

/// What random numbers are for. Each purpose has its own stream, so that turning one source of
/// randomness off, or drawing more from it, leaves the others as they were.
enum class Stream : std::uint64_t {
  kDriveNoise = 1,
  kSteerNoise,
  kSlip,
  kOutliers,
  kIntrinsics,
  kGyroNoise,
  kAccelNoise,
  kGyroWalk,
  kAccelWalk,
  kInitialBias,
  kLandmarks,
  kPixelNoise,
  kFeatureOutliers,
  kFeatureDropouts,
  kCalibrationError,
  kStartError,
  kPoseNoise,
  kPoseOutliers,
  kTrueCameras,
  kTrueMount,
  kWander,
};

/// A stream of independent numbers; equal seed, purpose and index give equal numbers. `index`
/// tells several sensors of one kind apart.
class RandomStream {
 public:
  RandomStream(std::uint64_t seed, Stream purpose, std::uint64_t index = 0);

  double uniform();   ///< in [0, 1)
  double gaussian();  ///< mean 0, standard deviation 1

 private:
  std::mt19937_64 engine_;
  double spare_ = 0.;
  bool has_spare_ = false;
};

}  // namespace viwo::sim
