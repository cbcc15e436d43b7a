// Encoder samples of a wheeled base that follows a motion, for any kinematic model.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "viwo/api/kinematic_model.hpp"
#include "viwo/api/measurement.hpp"
#include "viwo/sim/planar_motion.hpp"

namespace viwo::sim {

/// One wheel reads more than it rolls, several times.
struct DriveSlip {
  std::vector<double> start_s;  ///< time of the motion
  double duration_s = 0.;
  int wheel = 0;      ///< drive channel, from 0
  double ratio = 0.;  ///< 0.2: the drive reads 20 % more than the wheel rolls
};

struct EncoderSimulation {
  double duration_s = 60.;
  double rate_hz = 100.;
  std::int64_t start_ns = 0;        ///< stamp of time 0 of the motion, and of the first sample
  double time_offset_s = 0.;        ///< t_motion = t_wheel + time_offset_s; stamps are t_wheel
  bool noise = true;                ///< noise of encoders and slip as the model's description says
  DriveSlip slip;                   ///< with or without `noise`, as are outliers and resolution
  double outlier_probability = 0.;  ///< per sample; hits one drive channel
  double outlier_rad_per_s = 0.;    ///< size, of either sign
  double drive_resolution_rad_per_s = 0.;  ///< rates are rounded to its multiples; 0: not rounded
  /// Intrinsics wander about their true values as Gauss-Markov processes of these sigmas, with or
  /// without `noise`; empty: none does.
  Intrinsics sigma_wander;
  double wander_time_s = 2.;
  /// A base that cannot move sideways follows a twist all the same whose v_y is not more than this:
  /// it slides then. For twists that are exact only up to an approximation.
  double sliding_m_per_s = 0.;

  /// Readings of the motion itself: no noise, slip, wander, outliers and resolution.
  void make_exact();
};

/// Stamp of the sample `k` of a sensor with `rate_hz`, in nanoseconds from its first one.
std::int64_t sample_time_ns(std::int64_t k, double rate_hz);

/// Samples at k / rate_hz up to duration_s, in the wheel clock. Cells end at the mid-points between
/// stamps, the first begins and the last ends at its own stamp.
///
/// Each sample satisfies b(y) - A(y) xi = slip with the exact twist xi of the motion and slip drawn
/// from the description's noise sources of kind kSlip, before noise is added to the channels. A
/// sample whose slip the model cannot realise, or only by turning a wheel that hardly rolls by more
/// than 0.2 rad, has none. Models without inverse() are solved with Newton's method from the
/// previous sample; before the first one the wheels stand in the direction of the motion.
///
/// The twist is asked for in time order, at stamps of the motion from time_offset_s (and 0.05 s) to
/// duration_s + time_offset_s; `motion_name` is for messages.
///
/// InputError when the base cannot follow the motion, std::invalid_argument for a wrong slip wheel.
std::vector<EncoderSample> simulate_encoders(const KinematicModel& model, const Intrinsics& truth,
                                             const std::function<Twist(double t_s)>& twist,
                                             std::string_view motion_name,
                                             const EncoderSimulation& options, std::uint64_t seed);

/// The same for a motion on a plane.
std::vector<EncoderSample> simulate_encoders(const KinematicModel& model, const Intrinsics& truth,
                                             const PlanarMotion& motion,
                                             const EncoderSimulation& options, std::uint64_t seed);

/// nominal + scale * prior_sigma * gaussian for every entry, also those that a filter holds by its
/// gauge if they place all of O (of skid_steer they do not). The draw of an entry depends on seed
/// and index alone.
Intrinsics perturbed_intrinsics(const ModelDescription& description, double scale,
                                std::uint64_t seed);

/// Sigmas of intrinsics that wander: so many prior sigmas for those whose names begin with one of
/// `of`, all if that is empty. ParamError of `intrinsics_wander_of` for what begins none.
Intrinsics wander_sigmas(const ModelDescription& description, double prior_sigmas,
                         const std::vector<std::string>& of);

/// Solves b(y) - A(y) xi = slip for the encoder channels that have a noise source, starting at `y`;
/// what inverse() does for models that offer it. kRejected when no solution was found; then `y` is
/// as it was.
Status solve_inverse(const KinematicModel& model, const ModelDescription& description,
                     const Twist& xi, const Intrinsics& x_WI, const RowVector& slip,
                     EncoderSample& y);

}  // namespace viwo::sim
