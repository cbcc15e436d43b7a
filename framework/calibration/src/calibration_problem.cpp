#include "calibration_problem.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Dense>

#include "viwo/math/se2.hpp"

namespace viwo::calibration {
namespace {

/// Half the step of the central difference by the clock offset: a fraction of a sample.
constexpr double kClockStep_s = 1e-3;

PreintegrationOptions preintegration_of(const CalibrationRecording& recording,
                                        const CalibrationOptions& options) {
  PreintegrationOptions preintegration = recording.setup.preintegration;
  preintegration.parity = options.parity;
  return preintegration;
}

}  // namespace

MotionOfBody motion_of_body(const Eigen::Vector3d& g, const PlanarExtrinsics& extrinsics) {
  const Eigen::Vector2d t = extrinsics.head<2>();
  const Eigen::Matrix2d R_theta = R2(g[0]);
  const Eigen::Matrix2d R_E = R2(extrinsics[2]);
  const Eigen::Vector2d Rp = R_E * g.tail<2>();
  MotionOfBody motion;
  motion.h << g[0], t - R_theta * t + Rp;
  motion.by_g.setZero();
  motion.by_g(0, 0) = 1.;
  motion.by_g.block<2, 1>(1, 0) = -J2() * R_theta * t;
  motion.by_g.block<2, 2>(1, 1) = R_E;
  motion.by_extrinsics.setZero();
  motion.by_extrinsics.block<2, 2>(1, 0) = Eigen::Matrix2d::Identity() - R_theta;
  motion.by_extrinsics.block<2, 1>(1, 2) = J2() * Rp;
  return motion;
}

RecordingProblem::RecordingProblem(const CalibrationRecording& recording,
                                   const CalibrationOptions& options)
    : recording_(recording),
      options_(options),
      n_(recording.setup.model->n_intrinsics()),
      preintegrator_(recording.setup.model, preintegration_of(recording, options)) {
  const RunData& data = recording.data;
  const std::string where = "recording '" + recording.label.name + "'";
  if (data.reference.empty()) throw InputError(where + " has no reference to calibrate against");
  const auto offset_ns =
      static_cast<std::int64_t>(std::llround(recording.setup.reference_time_offset_s * 1e9));
  // Room for the clock offset on both sides.
  const auto margin_ns =
      static_cast<std::int64_t>(std::llround(4e9 * options.clock_offset_sigma_s)) + 2'000'000;
  const std::int64_t begin_ns =
      std::max(data.wheels().front().begin_ns + offset_ns + margin_ns, data.reference.front().t_ns);
  const std::int64_t end_ns =
      std::min(data.wheels().back().end_ns + offset_ns - margin_ns, data.reference.back().t_ns);
  const double duration_s = seconds_between(begin_ns, end_ns);
  if (!(duration_s > 0.)) throw InputError(where + ": wheels and reference have no time in common");
  const int count = options.segment_s > 0.
                        ? std::max(1, static_cast<int>(std::lround(duration_s / options.segment_s)))
                        : 1;
  std::vector<StampedPose> ends;
  for (int k = 0; k <= count; ++k) {
    const std::int64_t t_ns = begin_ns + (end_ns - begin_ns) * k / count;
    // A segment end in a gap of the reference is left out: its neighbours become one.
    if (const auto pose = interpolate(data.reference, t_ns, recording.setup.reference_max_gap_s)) {
      stamps_ns_.push_back(t_ns - offset_ns);
      ends.push_back(*pose);
    }
  }
  if (ends.size() < 2) throw InputError(where + ": the reference has gaps at all segment ends");
  for (std::size_t k = 1; k < ends.size(); ++k) {
    reference_.push_back(between(planar(ends[k - 1]), planar(ends[k])));
  }
  for (auto* segments : {&segments_, &later_, &earlier_}) segments->resize(reference_.size());
}

void RecordingProblem::integrate(const CalibrationPoint& point,
                                 std::vector<PreintegratedPose>& segments) {
  preintegrator_.set_intrinsics(point.x_WI);
  const auto shift_ns = static_cast<std::int64_t>(std::llround(point.clock_offset_s * 1e9));
  guarded(recording_.setup.kinematics.info, "preintegration", [&] {
    for (std::size_t k = 0; k < segments.size(); ++k) {
      preintegrator_.integrate(recording_.data.wheels(), stamps_ns_[k] - shift_ns,
                               stamps_ns_[k + 1] - shift_ns, segments[k]);
    }
  });
}

void RecordingProblem::evaluate(const CalibrationPoint& point, bool jacobian,
                                RecordingResiduals& out) {
  // A solver asks for the residuals of a point, then for their derivatives, which are there.
  if (!integrated_ || !(*integrated_ == point)) {
    integrate(point, segments_);
    integrated_ = point;
  }
  const bool clock = options_.clock_offset_sigma_s > 0.;
  if (jacobian && clock) {
    CalibrationPoint shifted = point;
    shifted.clock_offset_s = point.clock_offset_s + kClockStep_s;
    integrate(shifted, later_);
    shifted.clock_offset_s = point.clock_offset_s - kClockStep_s;
    integrate(shifted, earlier_);
  }
  out.pose.setZero(n_pose());
  out.J_pose.setZero(n_pose(), n_ + 4);
  const Eigen::Vector3d whitening(1. / noise_.yaw_rad, 1. / noise_.position_m,
                                  1. / noise_.position_m);
  ParityInformation parity;
  parity.reset(n_);
  for (std::size_t k = 0; k < segments_.size(); ++k) {
    const auto row = static_cast<Eigen::Index>(3 * k);
    const MotionOfBody motion = motion_of_body(segments_[k].g, point.extrinsics);
    Eigen::Vector3d error = motion.h - reference_[k];
    error[0] = wrap_angle(error[0]);
    out.pose.segment<3>(row) = whitening.asDiagonal() * error;
    parity.Lambda += segments_[k].parity.Lambda;
    parity.eta += segments_[k].parity.eta;
    if (!jacobian) continue;
    const Eigen::Matrix3d by_g = whitening.asDiagonal() * motion.by_g;
    out.J_pose.block(row, 0, 3, n_) = by_g * segments_[k].J_g_WI;
    out.J_pose.block<3, 3>(row, n_) = whitening.asDiagonal() * motion.by_extrinsics;
    if (clock) {
      out.J_pose.block<3, 1>(row, n_ + 3) =
          by_g * (later_[k].g - earlier_[k].g) / (2. * kClockStep_s);
    }
  }
  out.parity.setZero(n_parity());
  out.J_parity.setZero(n_parity(), n_ + 4);
  if (!options_.parity) return;
  // r = D^-1/2 V^T eta and J = D^1/2 V^T with Lambda = V D V^T have the gradient and the curvature
  // of the parity cost; directions without information have no residual (CAL-4).
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(parity.Lambda);
  const double smallest = 1e-9 * eigen.eigenvalues()[n_ - 1];
  for (int i = 0; i < n_; ++i) {
    const double d = eigen.eigenvalues()[i];
    if (!(d > smallest)) continue;
    const Eigen::VectorXd v = eigen.eigenvectors().col(i);
    out.parity[i] = v.dot(parity.eta) / std::sqrt(d) / noise_.parity_scale;
    out.J_parity.row(i).head(n_) = std::sqrt(d) / noise_.parity_scale * v.transpose();
  }
}

}  // namespace viwo::calibration
