// Preintegration: encoder samples of an interval to one relative planar pose, its Jacobian by the
// intrinsics, its covariance and the parity information. Knows nothing of a particular base.
// Equations: docs/math/wheel_odometry.md.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <span>

#include <Eigen/Core>

#include "viwo/wheel/twist_solver.hpp"

namespace viwo {

struct PreintegrationOptions {
  TwistOptions twist;
  /// Samples whose parity residual is less likely than this are not believed: their motion is
  /// bridged and their parity residual left out. 0: no gate.
  double parity_gate_probability = 0.;
  /// Accumulate the parity information.
  bool parity = true;
};

/// Relative pose of O between two instants. g = [theta, x, y]: yaw (counter-clockwise positive) and
/// position of O at the end, in O at the start.
struct PreintegratedPose {
  Eigen::Vector3d g = Eigen::Vector3d::Zero();    ///< rad, m, m
  IntrinsicJacobian J_g_WI;                       ///< 3 x n: d g / d x_WI
  Eigen::Matrix3d P_g = Eigen::Matrix3d::Zero();  ///< covariance from the encoder noise
  ParityInformation parity;
  double duration_s = 0.;     ///< time integrated
  double path_length_m = 0.;  ///< integral of the speed of O
  double bridged_s = 0.;      ///< part without believable samples, bridged from the neighbours
  std::int64_t samples = 0;   ///< samples whose stamp lies in the interval
  std::int64_t gated = 0;     ///< samples not believed for their parity residual
  std::int64_t rejected = 0;  ///< samples that the model or the solver refused
  std::int64_t rank_deficient = 0;  ///< samples whose rows do not tell the whole twist

  void reset(int n_intrinsics);
};

/// `total` followed by `next`, whose noise is independent (W-8).
void append(PreintegratedPose& total, const PreintegratedPose& next);

/// Integrates intervals of a time-ordered sequence of samples. One object per thread; no allocation
/// after construction.
class Preintegrator {
 public:
  Preintegrator(std::shared_ptr<const WheelModel> model, const PreintegrationOptions& options);

  /// As TwistSolver has them.
  void set_intrinsics(const Intrinsics& x_WI) { solver_.set_intrinsics(x_WI); }
  void move_intrinsics(const Intrinsics& x_WI) { solver_.move_intrinsics(x_WI); }
  const Intrinsics& intrinsics() const { return solver_.intrinsics(); }
  const WheelModel& model() const { return solver_.model(); }

  /// Motion from begin_ns to end_ns in the wheel clock. The samples that the ends fall into are cut
  /// there so that their pieces add up (W-11); holes between cells are bridged with the mean of
  /// their neighbours. Returns false, with the part that is covered, when
  /// the samples do not reach over the whole interval. What is not believed at the start of an
  /// interval that continues the one before is bridged from there, also when the same interval is
  /// integrated again; else it moves as what is believed first.
  bool integrate(std::span<const EncoderSample> samples, std::int64_t begin_ns, std::int64_t end_ns,
                 PreintegratedPose& out);

 private:
  /// Noise of a piece relative to one sample: variance, and covariance with the piece before; how
  /// much its parity counts, and as how many samples it does.
  struct PieceNoise {
    double variance = 1.;
    double with_previous = 0.;
    double parity = 1.;
    int samples = 1;
  };
  void begin_at(std::int64_t begin_ns);
  void find_motion(std::span<const EncoderSample> samples, std::int64_t end_ns);
  void add_piece(const EncoderSample& y, double dt, PieceNoise noise, PreintegratedPose& out);
  void bridge(double dt, const TwistSolution* unbelieved, PreintegratedPose& out);
  void step(const TwistSolution& solution, double dt, PieceNoise noise, PreintegratedPose& out);

  PreintegrationOptions options_;
  TwistSolver solver_;
  double parity_samples_ = 0.;  // samples of this interval whose parity is told
  double parity_gate_ = 0.;
  int parity_gate_dof_ = 0;
  std::array<TwistSolution, 2> solutions_;  // of this sample, and the last one that passed
  std::size_t believed_ = 0;                // index of the latter
  bool has_believed_ = false;
  double owed_s_ = 0.;  // begins the interval and waits for a twist to be believed
  std::int64_t reached_ns_ = std::numeric_limits<std::int64_t>::min();  // end of the last interval
  // The last interval's begin, and what was believed there.
  std::int64_t begun_ns_ = std::numeric_limits<std::int64_t>::min();
  TwistSolution believed_there_;
  bool has_believed_there_ = false;
  Eigen::Matrix3d last_gain_;  // d g / d xi of the last piece, for correlated neighbours
};

}  // namespace viwo
