// How wrong the calibration of a filter is made to start.
#pragma once

#include <cmath>
#include <cstdint>

#include <Eigen/Core>

#include "section_params.hpp"
#include "viwo/sim/random.hpp"

namespace viwo {

/// How wrong calibration starts, in prior sigmas.
struct CalibrationError {
  double scale = 0.;
  EstimatorParams::Draw draw = EstimatorParams::Draw::kGaussian;
};

/// Draws how wrong calibration starts: the same whether it is then calibrated or not.
class WrongStart {
 public:
  WrongStart(CalibrationError error, std::uint64_t seed, std::uint64_t index)
      : error_(error), random_(seed, sim::Stream::kCalibrationError, index) {}
  double draw(double sigma) {
    const double gaussian = random_.gaussian();
    switch (error_.draw) {
      case EstimatorParams::Draw::kSign:
        return std::copysign(error_.scale * sigma, gaussian);
      case EstimatorParams::Draw::kPlus:
        return error_.scale * sigma;
      default:
        return error_.scale * sigma * gaussian;
    }
  }
  /// Each axis.
  Eigen::Vector3d draw(const Eigen::Vector3d& sigma) {
    Eigen::Vector3d errors;
    for (int i = 0; i < 3; ++i) errors[i] = draw(sigma[i]);
    return errors;
  }
  bool is_wrong() const { return error_.scale > 0.; }

 private:
  CalibrationError error_;
  sim::RandomStream random_;
};

}  // namespace viwo
