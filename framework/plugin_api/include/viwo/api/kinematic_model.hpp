// KinematicModel: a wheeled base as constraint rows on the planar twist,
//
//     A(y, x_WI) xi = b(y, x_WI) + noise,      xi = [v_x, v_y, omega] of O in O   [m/s, m/s, rad/s]
//
// y is the encoder sample, x_WI the intrinsics. The model supplies rows and their derivatives; the
// framework solves for the twist, splits off the parity residual, preintegrates and gates.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "viwo/api/export.hpp"
#include "viwo/api/measurement.hpp"
#include "viwo/api/status.hpp"

namespace viwo {

inline constexpr int kMaxRows = 24;        ///< constraint rows of one model
inline constexpr int kMaxIntrinsics = 32;  ///< intrinsics of one model
inline constexpr int kMaxNoises = 32;      ///< noise sources of one model

/// [v_x, v_y, omega] of O expressed in O, m/s, m/s, rad/s (counter-clockwise positive).
using Twist = Eigen::Vector3d;

// Sized at run time, stored in place: no allocation.
using RowMatrix = Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::ColMajor, kMaxRows, 3>;
using RowVector = Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor, kMaxRows, 1>;
using RowJacobian = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, kMaxRows,
                                  kMaxIntrinsics>;
using TwistRowsJacobian =
    Eigen::Matrix<double, 3, Eigen::Dynamic, Eigen::ColMajor, 3, kMaxIntrinsics>;
using Intrinsics = Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor, kMaxIntrinsics, 1>;
using IntrinsicMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor,
                                      kMaxIntrinsics, kMaxIntrinsics>;
using NoiseVector = Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor, kMaxNoises, 1>;

/// The rows that a column of a Jacobian touches; all others are zero and need not be written.
struct RowRange {
  int first = 0;
  int count = 0;
};

/// One entry of x_WI.
struct IntrinsicSpec {
  std::string name;          ///< as it appears in summary.json and calibration files, e.g. "r_1"
  std::string unit;          ///< "m", "rad", ...
  double nominal = 0.;       ///< in `unit`
  double prior_sigma = 0.;   ///< in `unit`, > 0: how well the nominal value is known
  bool gauge_fixed = false;  ///< held to place the odometry frame O on the body
  RowRange rows{};           ///< rows whose derivative by this entry is not zero
  // In `unit`: what no base exceeds. A radius is not negative, or it would be one of a mirrored
  // base.
  double lowest = -std::numeric_limits<double>::infinity();
  double highest = std::numeric_limits<double>::infinity();
};

/// What n_i in y = y_true + n_i (encoder channels) or in b (slip) a noise source is.
enum class NoiseKind : std::uint8_t { kDrive, kSteer, kSlip };

/// One independent white noise source, standard deviation per sample.
struct NoiseSpec {
  NoiseKind kind = NoiseKind::kDrive;
  int channel = 0;    ///< drive or steering channel; wheel index for slip
  double sigma = 0.;  ///< rad/s, rad, m/s; > 0
  RowRange rows{};    ///< rows it enters
  /// The model's parameter that says sigma, e.g. "sigma_drive_rad_per_s"; sources of one parameter
  /// are one kind of noise. Empty: what was found of it is not reported.
  std::string parameter{};
};

/// What never changes about a model; filled once by describe().
struct ModelDescription {
  int n_drive = 0;  ///< drive channels that a sample must have
  int n_steer = 0;  ///< steering channels that a sample must have (0: ignored if there are any)
  int n_rows = 0;   ///< m
  bool constant_A = false;  ///< A depends on x_WI only, not on the sample
  /// Row noise is independent between consecutive groups of this many rows (1: diagonal); divides
  /// m.
  int noise_block = 1;
  std::vector<IntrinsicSpec> intrinsics;  ///< order of x_WI
  std::vector<NoiseSpec> noises;          ///< drive and steering sources first, slip last
};

/// The nominal values of x_WI, each in its unit.
inline Intrinsics nominal_intrinsics(const ModelDescription& description) {
  Intrinsics x(static_cast<Eigen::Index>(description.intrinsics.size()));
  for (Eigen::Index i = 0; i < x.size(); ++i) {
    x[i] = description.intrinsics[static_cast<std::size_t>(i)].nominal;
  }
  return x;
}

/// A, b and whatever the model wants to keep from rows() for the calls that follow on this sample.
struct RowSystem {
  RowMatrix A;                                ///< m x 3
  RowVector b;                                ///< m, m/s
  std::array<double, 4 * kMaxDrives> kept{};  ///< the model's own, e.g. cosines and sines
};

/// Derivatives of the rows by the intrinsics. Only the declared row ranges of J are written; the
/// rest stays zero.
struct IntrinsicDerivatives {
  RowJacobian J;          ///< m x n: d(b - A xi)/d x_WI
  TwistRowsJacobian DtE;  ///< 3 x n: column k is (dA/dx_k)^T e
};

/// Derivatives by the noise sources, in the order of ModelDescription::noises, each per unit noise.
struct NoiseDerivatives {
  RowJacobian J;          ///< m x q: d(b - A xi)/d n
  TwistRowsJacobian DtE;  ///< 3 x q: column k is (dA/dn_k)^T e
};

/// A wheeled base. Every call is const and may run concurrently on one object; results depend on
/// the arguments alone. Outputs belong to the host and are already sized (J: m x n or m x q); they
/// start as zeros and keep what the last call wrote, so an entry that is always zero need not be
/// written.
class VIWO_API KinematicModel {
 public:
  virtual ~KinematicModel();

  /// Called once after construction.
  virtual void describe(ModelDescription& out) const = 0;

  /// A and b at a sample. With constant_A the host may pass an `out` whose A is already that of
  /// `x_WI` (`A_is_current`); then A need not be written again.
  /// kRejected: the sample is outside of what the model can handle.
  virtual Status rows(const EncoderSample& y, const Intrinsics& x_WI, bool A_is_current,
                      RowSystem& out) const = 0;

  /// d(b - A xi)/d x_WI and (dA/d x_WI)^T e.
  ///
  /// `rows` is what rows() gave for this sample; `b` is the signal at which to differentiate:
  /// either rows.b, the measured one, or A xi, the fitted one. At the fitted signal the derivative
  /// is that for encoders which had measured exactly what the twist predicts; it keeps directions
  /// that cannot be observed free of spurious information (docs/math/wheel_odometry.md, W-9).
  virtual void intrinsic_derivatives(const EncoderSample& y, const Intrinsics& x_WI,
                                     const RowSystem& rows, const RowVector& b, const Twist& xi,
                                     const RowVector& e, IntrinsicDerivatives& out) const = 0;

  /// The same by the noise sources: by the encoder channels as they are read (y grows by n), and by
  /// slip as a velocity added to b.
  virtual void noise_derivatives(const EncoderSample& y, const Intrinsics& x_WI,
                                 const RowSystem& rows, const RowVector& b, const Twist& xi,
                                 const RowVector& e, NoiseDerivatives& out) const = 0;

  /// Inverse kinematics for simulators: the encoder channels of a base that moves with twist xi
  /// such that b - A xi = slip. On entry `y` holds the previous sample, which decides between
  /// equivalent wheel configurations. kUnsupported: none offered; kRejected: this base cannot move
  /// like that.
  virtual Status inverse(const Twist& xi, const Intrinsics& x_WI, const RowVector& slip,
                         EncoderSample& y) const;

  /// Rewrites the intrinsics of a base for another odometry frame O' on it. `g` = [yaw, x, y] is
  /// the pose of O' in O. Evaluation needs it to compare an estimate, made with the gauge entries
  /// held, with a truth in which they differ. kUnsupported: the frame is fixed by the model itself.
  virtual Status move_frame(const Eigen::Vector3d& g, Intrinsics& x_WI) const;
};

}  // namespace viwo
