// Who gets what the sensors of a run yield: one table, made once from the configuration, which
// recorded, simulated and live runs follow.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "viwo/api/sample.hpp"
#include "viwo/config/errors.hpp"
#include "viwo/config/node.hpp"
#include "viwo/estimator/declarations.hpp"

namespace viwo {

enum class Consumer {
  kImu,             ///< the filter's propagation, and whoever compares the wheels with a gyro
  kHeading,         ///< whoever compares the wheels with a gyro
  kStream,          ///< a stream of the estimator: Route::stream
  kWheels,          ///< dead reckoning, and whoever wants to know how the wheels turned
  kReferencePoses,  ///< evaluation
  kReferenceStates,
  kTrueCalibration,
  kPictures,
};

struct Route {
  std::string sensor;
  const SampleType* type = nullptr;
  Consumer consumer = Consumer::kStream;
  std::size_t stream = 0;
};

/// A sensor of a run and the kinds that it yields.
struct SensorYield {
  std::string name;
  SampleTypes types;
};

/// What a run wants to know of its sensors.
struct Wanted {
  std::span<const SharedStream> streams;
  bool filter = false;                 ///< else dead reckoning
  bool wheels = false;                 ///< it has a kinematic model
  std::string wheels_sensor;           ///< that gives its encoder samples; "" for the only one
  std::vector<std::string> measuring;  ///< sensors whose poses are measured, not a reference
};

class Routes {
 public:
  /// What does not fit is appended to `errors`, at `mark`.
  static Routes resolve(std::span<const SensorYield> sensors, const Wanted& wanted,
                        const config::Mark& mark, config::Errors& errors);

  std::span<const Route> all() const { return routes_; }
  /// The sensor that `consumer` gets its samples from; "" for none.
  std::string sensor_of(Consumer consumer) const;
  /// Calls `take(route)` for everybody who gets samples of this kind from this sensor. InputError
  /// when the sensor gives what it does not yield.
  template <class Take>
  void dispatch(const std::string& sensor, const SampleType& type, Take&& take) const {
    require_yielded(sensor, type);
    for (const Route& route : routes_) {
      if (*route.type == type && route.sensor == sensor) take(route);
    }
  }

 private:
  void require_yielded(const std::string& sensor, const SampleType& type) const;

  std::vector<SensorYield> sensors_;
  std::vector<Route> routes_;
};

}  // namespace viwo
