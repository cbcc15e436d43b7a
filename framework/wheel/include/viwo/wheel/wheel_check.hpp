// Which wheel lies: the rows of a sample that the others contradict are left out of it, one wheel
// at a time, as long as what remains agrees. Equations: docs/math/wheel_odometry.md, W-12, W-13.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "viwo/api/noise_scale.hpp"
#include "viwo/api/rejections.hpp"
#include "viwo/wheel/twist_solver.hpp"

namespace viwo {

class WheelCheck {
 public:
  /// Samples whose parity residual is less likely than `probability` are looked into; 0: none.
  WheelCheck(std::shared_ptr<const WheelModel> model, double probability);

  /// Whether there is anything to look into: a probability, and enough rows.
  bool is_on() const { return !gates_.empty(); }

  /// The intrinsics and their covariance, for the samples to come.
  void set_calibration(const Intrinsics& x_WI, const IntrinsicMatrix& P);

  /// Marks the channels of `y` that the others contradict. No allocation.
  void check(EncoderSample& y);

  /// How large the parity noise is in units of that of the encoders (what lies is not in it).
  const NoiseScale& noise() const { return noise_; }
  /// Channels that were left out, with times; appended to `out`.
  void rejections(std::vector<RejectionCount>& out) const;

 private:
  /// A wheel: channels whose rows are left out together.
  struct Suspect {
    NoiseKind kind = NoiseKind::kDrive;
    int channel = 0;
    RowRange rows{};  ///< that it enters
    std::int64_t left_out = 0;
    std::int64_t first_ns = 0, last_ns = 0;
  };
  struct Verdict {
    double chi2 = 0.;
    int dof = 0;
  };

  Verdict judge(const EncoderSample& y);
  double gate(int dof) const { return gates_[static_cast<std::size_t>(dof)]; }
  bool agrees(const Verdict& verdict) const;
  Suspect* of_same_wheel(const EncoderSample& rest, Suspect& suspect);
  Suspect* least_agreeable(const EncoderSample& y, int least_dof, Verdict& without);

  TwistSolver solver_;
  std::vector<Suspect> suspects_;
  std::vector<double> gates_;  ///< by degrees of freedom; empty: off
  IntrinsicMatrix P_;
  NoiseScale noise_;
  std::int64_t samples_ = 0;
  const Suspect* liar_ = nullptr;   ///< of the sample before
  bool is_nobody_ = false;          ///< the sample before was one without a wheel that explains it
  std::int64_t contradicting_ = 0;  ///< samples without a wheel that explains it
  std::int64_t first_contradicting_ns_ = 0;
  TwistSolution solution_;
  ParityInformation parity_;
};

}  // namespace viwo
