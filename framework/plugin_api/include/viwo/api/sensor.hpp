// Sensor: yields measurements in time order.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "viwo/api/export.hpp"
#include "viwo/api/measurement.hpp"
#include "viwo/api/rejections.hpp"
#include "viwo/api/status.hpp"

namespace viwo {

/// What the filter knows after an epoch, for whoever publishes it.
struct EstimateSample {
  std::int64_t t_ns = 0;                              ///< of the newest image, in the IMU clock
  std::array<double, 4> q_ItoG_xyzw{0., 0., 0., 1.};  ///< Hamilton quaternion, unit norm
  std::array<double, 3> p_IinG_m{};
  std::array<double, 3> v_IinG_m_per_s{};
  std::array<double, 3> w_IinI_rad_per_s{};  ///< angular rate of I in I, bias removed
  /// Covariance, row after row, of [dtheta, dp, dv]: R_GtoI = Exp(-dtheta) R_GtoI_hat (dtheta in
  /// I), p = p_hat + dp and v = v_hat + dv in G.
  std::array<double, 81> covariance{};
  double latency_s = 0.;  ///< from the arrival of the newest image to this estimate; or NaN
  std::vector<std::string> calibration_names;
  std::vector<double> calibration;  ///< estimates, of the same order
  std::vector<double> calibration_sigma;
  int piece = 0;  ///< how often the filter was started anew: the pose has jumped
  std::vector<std::string> warnings;  ///< what is wrong with sensors, updates and estimate by now
};

/// A source of measurements: a log, a simulator, a device. Calls are serialised by the host, but
/// for estimate(), which may run while next() waits.
class VIWO_API Sensor {
 public:
  virtual ~Sensor();

  /// The kinds of samples that next() may give, as it is configured: from them the host knows
  /// before a run who gets what. What is not among them is an error when it comes.
  virtual SampleTypes yields() const = 0;

  /// The next measurement in time order; kEnd when there is none. Throws InputError when the source
  /// is broken beyond single data (not a number where one must be, missing column, truncated file).
  virtual Status next(Measurement& out) = 0;

  /// Whether what it yields is free of noise, and of errors that it draws, when that is asked for
  /// (HostServices::exact). False: an analysis says that noise may count as observed.
  virtual bool can_be_exact() const;

  /// What was dropped so far; appended to `out`.
  virtual void rejections(std::vector<RejectionCount>& out) const;

  /// Whether this sensor turns the measurements of another one, named by the configuration's key
  /// `input`, into its own (images into feature tracks): then connect() comes before next().
  virtual bool takes_input() const;
  /// `input` outlives the calls of next(), which read from it. Called only if takes_input().
  virtual void connect(Sensor& input);

  /// Whether measurements are taken as they happen: next() waits for them, and a run goes on until
  /// kEnd, or until stop().
  virtual bool live() const;
  /// Ends a live sensor: next() gives kEnd soon. May be called while next() waits.
  virtual void stop();

  /// The estimate after each epoch of the filter that this sensor feeds: for a sensor that passes
  /// it on to where its measurements come from. Only live sensors are told.
  virtual void estimate(const EstimateSample& estimate);
};

}  // namespace viwo
