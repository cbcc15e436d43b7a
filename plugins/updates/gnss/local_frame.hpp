// Fixes on the ellipsoid as points of a local frame E: x east, y north, z up at its origin,
// Cartesian. Equations: model.md beside this file.
#pragma once

#include <vector>

#include <Eigen/Core>
#include <GeographicLib/LocalCartesian.hpp>

#include "viwo/api/measurement.hpp"

namespace viwo::gnss {

/// What is believed of the accuracy of fixes.
struct FixNoise {
  double sigma_m = 1.;  ///< of fixes that come without covariance, per axis
  double scale = 1.;    ///< of the sigmas of all fixes
};

/// Along east, north and up at the antenna [m^2]; of the message, if it has one.
Eigen::Matrix3d covariance_of(const GnssSample& fix, const FixNoise& noise);

/// A fix in E.
struct LocalFix {
  Eigen::Vector3d p_AinE = Eigen::Vector3d::Zero();
  Eigen::Matrix3d R = Eigen::Matrix3d::Identity();  ///< covariance, along the axes of E [m^2]
};

class LocalFrame {
 public:
  LocalFrame(double latitude_deg, double longitude_deg, double altitude_m)
      : frame_(latitude_deg, longitude_deg, altitude_m), ENU_to_E_(9) {}

  double latitude_deg() const { return frame_.LatitudeOrigin(); }
  double longitude_deg() const { return frame_.LongitudeOrigin(); }
  double altitude_m() const { return frame_.HeightOrigin(); }

  LocalFix at(const GnssSample& fix, const FixNoise& noise);

 private:
  GeographicLib::LocalCartesian frame_;
  std::vector<double> ENU_to_E_;  // of the last fix: storage that is used again
};

}  // namespace viwo::gnss
