// What the sensors of a run gave, as plain series: no images, no points.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "viwo/api/measurement.hpp"
#include "viwo/api/rejections.hpp"
#include "viwo/math/trajectory.hpp"
#include "viwo/plausibility/plausibility.hpp"
#include "viwo/setup/run_setup.hpp"

namespace viwo::series {

/// Stamps of one kind of samples, of one camera if there are several, as they came.
struct Stamps {
  std::string sensor;
  const SampleType* type = nullptr;
  int channel = 0;
  std::vector<std::int64_t> t_ns;
};

/// A mean rate over a time.
struct Turn {
  std::int64_t begin_ns = 0, end_ns = 0;
  Eigen::Vector3d rate = Eigen::Vector3d::Zero();  ///< rad/s
};

/// How a camera turned between its images, in C, as far as its tracks tell: the rotation that takes
/// the directions to the points of one image best to those of the next.
struct CameraTurns {
  std::string sensor;
  int camera = 0;
  std::vector<Turn> turns;
  std::vector<double> points;  ///< that two images share, for each turn
  double far = 0.;  ///< of these, points that are nowhere near where that rotation has them
};

/// A wheel set and its samples.
struct Wheels {
  std::string sensor;
  std::shared_ptr<const WheelModel> model;
  WheelsPrior prior;
  std::vector<EncoderSample> samples;
  std::string unusable;  ///< why the model cannot take them
};

/// Poses of a body, measured or for reference.
struct Poses {
  std::string sensor;
  bool of_imu = false;  ///< reference states: of the IMU, in its clock
  Trajectory poses;
};

/// What a gyro that integrates for itself said.
struct Headings {
  std::string sensor;
  std::vector<HeadingSample> samples;
};

struct Recording {
  const RunSetup* setup = nullptr;
  std::vector<Stamps> stamps;
  std::string imu_sensor;  ///< "" for none
  std::vector<ImuSample> imu;
  std::vector<Wheels> wheels;
  std::vector<Headings> headings;
  std::vector<Poses> poses;
  std::vector<CameraTurns> cameras;
  std::vector<std::pair<std::string, RejectionCount>> rejections;  ///< by sensor
  std::vector<std::pair<std::string, std::string>> broken;         ///< sensor, what it said
  viwo::Findings implausible;                                      ///< of Plausibility

  /// What texts call the samples of a kind: the sensor, and the kind if it gives several.
  std::string label(const std::string& sensor, const SampleType& type) const;
  template <Sample T>
  std::string label(const std::string& sensor) const {
    return label(sensor, sample_type<T>());
  }
  std::string label(const Poses& of) const {
    return of.of_imu ? label<StateSample>(of.sensor) : label<PoseSample>(of.sensor);
  }
  std::int64_t begin_ns() const;  ///< of the IMU, else the earliest; 0 if there is nothing
};

/// Reads all sensors in the order of their stamps.
Recording gather(RunSetup& setup);

}  // namespace viwo::series
