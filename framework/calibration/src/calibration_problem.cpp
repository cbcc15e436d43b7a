#include "calibration_problem.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <numbers>
#include <string>
#include <tuple>
#include <vector>

#include <Eigen/Dense>

#include "holes.hpp"
#include "recording_name.hpp"
#include "viwo/math/chi2.hpp"
#include "viwo/math/se2.hpp"
#include "viwo/math/significant.hpp"
#include "viwo/math/stamp.hpp"
#include "viwo/plausibility/periods.hpp"

namespace viwo::calibration {
namespace {

/// Half the step of the central difference by the clock offset: a fraction of a sample.
constexpr double kClockStep_s = 1e-3;
/// Length of the pieces whose straight lines add up to the path of a distance.
constexpr double kPathPiece_s = 0.05;
/// Probability of a normal residual that counts in full.
constexpr double kBelievable = 0.999;
/// Longest piece whose parity gradient is told.
constexpr double kParityPiece_s = 1.;

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
  const auto wheels = recording.data.wheels();
  const Trajectory& poses = recording.motion.poses;
  const std::int64_t offset_ns = to_ns(recording.motion.offset_s);
  std::int64_t begin_ns = wheels.front().begin_ns, end_ns = wheels.back().end_ns;
  if (!poses.empty()) {
    // Room for the clock offset on both sides.
    const std::int64_t margin_ns = to_ns(4. * options.prior_sigma_clock_offset_s) + 2'000'000;
    begin_ns = std::max(begin_ns + margin_ns, poses.front().t_ns - offset_ns);
    end_ns = std::min(end_ns - margin_ns, poses.back().t_ns - offset_ns);
  }
  if (!(seconds_between(begin_ns, end_ns) > 0.)) {
    fail(recording.label, ": wheels and reference have no time in common");
  }
  constexpr double kPiece_s = 0.1;  // that is looked at
  if (const std::string fault = fault_of_times(wheels, kPiece_s); !fault.empty()) {
    fail(recording.label, ": the encoder samples " + fault);
  }
  for (const StampedPose& pose : poses) {
    const double before = yaw_.empty() ? 0. : yaw_.back();
    yaw_.push_back(before + wrap_angle(yaw(pose) - before));
  }
  cut(begin_ns, end_ns);
  if (!poses.empty()) compare_with_reference();
  segments_.resize(stamps_ns_.size() - 1);
  squares_.assign(motions_.size(), 0.);
  weights_.assign(motions_.size(), 1.);
  leave_out_holes();
  for (std::size_t k = 0; k < motions_.size(); ++k) {
    kinds_.push_back(ResidualKind::kYaw);
    if (rows_per_segment() == 3) kinds_.insert(kinds_.end(), 2, ResidualKind::kPosition);
  }
  if (options.parity)
    kinds_.insert(kinds_.end(), static_cast<std::size_t>(n_), ResidualKind::kParity);
  if (recording.motion.distance_m) kinds_.push_back(ResidualKind::kDistance);
  if (recording.motion.turn_rad) kinds_.push_back(ResidualKind::kTurn);
}

/// Where the segments end.
void RecordingProblem::cut(std::int64_t begin_ns, std::int64_t end_ns) {
  if (options_.segments == calibration::Segments::kPoses) {
    const std::int64_t offset_ns = to_ns(recording_.motion.offset_s);
    for (const StampedPose& pose : recording_.motion.poses) {
      const std::int64_t t_ns = pose.t_ns - offset_ns;
      if (t_ns >= begin_ns && t_ns <= end_ns) stamps_ns_.push_back(t_ns);
    }
    if (stamps_ns_.size() > 1) return;
    stamps_ns_.clear();
  }
  const bool whole =
      options_.segments == calibration::Segments::kWhole || !(options_.segment_s > 0.);
  const double duration_s = seconds_between(begin_ns, end_ns);
  const auto count = whole
                         ? std::int64_t{1}
                         : std::max<std::int64_t>(1, std::llround(duration_s / options_.segment_s));
  // (end_ns - begin_ns) * k / count, which may be too large a product.
  const std::lldiv_t part = std::lldiv(end_ns - begin_ns, count);
  for (std::int64_t k = 0; k <= count; ++k) {
    stamps_ns_.push_back(begin_ns + part.quot * k + part.rem * k / count);
  }
  move_to_poses(begin_ns, end_ns);
}

/// A straight line between two poses cuts corners, always to the inside: segments end where a pose
/// was taken. The wheels are integrated to any time.
void RecordingProblem::move_to_poses(std::int64_t begin_ns, std::int64_t end_ns) {
  const std::int64_t offset_ns = to_ns(recording_.motion.offset_s);
  const Trajectory& poses = recording_.motion.poses;
  const auto before = [](const StampedPose& pose, std::int64_t t_ns) { return pose.t_ns < t_ns; };
  const auto first = std::lower_bound(poses.begin(), poses.end(), begin_ns + offset_ns, before);
  const auto past = std::lower_bound(first, poses.end(), end_ns + offset_ns + 1, before);
  if (past - first < 2) return;
  for (std::int64_t& stamp_ns : stamps_ns_) {
    const std::int64_t t_ns = stamp_ns + offset_ns;
    auto nearest = std::lower_bound(first, past - 1, t_ns, before);
    if (nearest != first && t_ns - (nearest - 1)->t_ns < nearest->t_ns - t_ns) --nearest;
    stamp_ns = nearest->t_ns - offset_ns;
  }
  stamps_ns_.erase(std::unique(stamps_ns_.begin(), stamps_ns_.end()), stamps_ns_.end());
}

std::optional<Eigen::Vector3d> RecordingProblem::reference_at(std::int64_t t_ns) const {
  const MotionReference& motion = recording_.motion;
  const auto pose = interpolate(motion.poses, t_ns, motion.max_gap_s);
  if (!pose) return std::nullopt;
  const auto after =
      std::lower_bound(motion.poses.begin(), motion.poses.end(), t_ns,
                       [](const StampedPose& one, std::int64_t stamp) { return one.t_ns < stamp; });
  const double near = yaw_[static_cast<std::size_t>(after - motion.poses.begin())];
  Eigen::Vector3d planar_pose = planar(*pose);
  planar_pose[0] = near + wrap_angle(planar_pose[0] - near);
  return planar_pose;
}

/// Motion of the reference over each segment. Where there are no two poses to end at, an end in a
/// gap of the reference is left out.
void RecordingProblem::compare_with_reference() {
  std::vector<std::int64_t> known_ns;
  std::vector<Eigen::Vector3d> ends;
  for (const std::int64_t t_ns : stamps_ns_) {
    if (const auto pose = reference_at(t_ns + to_ns(recording_.motion.offset_s))) {
      known_ns.push_back(t_ns);
      ends.push_back(*pose);
    }
  }
  if (ends.size() < 2) {
    const bool is_gyro = recording_.motion.kind == ReferenceKind::kGyro;
    fail(recording_.label,
         ": at all ends of segments the " + std::string(is_gyro ? "gyro" : "reference") +
             " has gaps of more than " + significant(recording_.motion.max_gap_s, 3) + " s" +
             (is_gyro ? "" : " (evaluation.reference_max_gap_s)"));
  }
  stamps_ns_ = std::move(known_ns);
  for (std::size_t k = 1; k < ends.size(); ++k) {
    motions_.push_back(between(ends[begin_of(k - 1)], ends[k]));
  }
}

void RecordingProblem::leave_out_holes() {
  const std::vector<Hole> holes = holes_of(recording_);
  for (std::size_t k = 0; k < weights_.size(); ++k) {
    const std::int64_t begin_ns = stamps_ns_[begin_of(k)], end_ns = stamps_ns_[k + 1];
    for (const Hole& hole : holes) {
      if (hole.begin_ns < end_ns && hole.end_ns > begin_ns) weights_[k] = 0.;
    }
  }
}

void RecordingProblem::integrate(const CalibrationPoint& point) {
  preintegrator_.move_intrinsics(point.x_WI);
  const std::int64_t shift_ns = to_ns(point.clock_offset_s);
  parity_.reset(n_);
  parity_gradients_.clear();
  guarded(recording_.setup.kinematics.info, "preintegration", [&] {
    for (std::size_t k = 0; k < segments_.size(); ++k) {
      const std::int64_t begin_ns = stamps_ns_[k], length_ns = stamps_ns_[k + 1] - begin_ns;
      const std::int64_t pieces = 1 + length_ns / to_ns(kParityPiece_s);
      segments_[k].reset(n_);
      for (std::int64_t i = 0; i < pieces; ++i) {
        preintegrator_.integrate(recording_.data.wheels(),
                                 begin_ns + length_ns * i / pieces - shift_ns,
                                 begin_ns + length_ns * (i + 1) / pieces - shift_ns, piece_);
        append(segments_[k], piece_);
        parity_.Lambda += piece_.parity.Lambda;
        parity_.eta += piece_.parity.eta;
        parity_gradients_.push_back(piece_.parity.eta);
      }
    }
  });
  if (!from_start()) return;
  for (std::size_t k = 1; k < segments_.size(); ++k) {
    piece_ = segments_[k - 1];
    append(piece_, segments_[k]);
    std::swap(piece_, segments_[k]);
  }
}

/// A segment that is shifted begins and ends elsewhere, and is between as it was.
void RecordingProblem::differentiate_by_clock(const CalibrationPoint& point) {
  const std::int64_t shift_ns = to_ns(point.clock_offset_s), step_ns = to_ns(kClockStep_s);
  std::vector<Eigen::Vector3d> before, after;  // of each end, over the step
  guarded(recording_.setup.kinematics.info, "preintegration", [&] {
    for (const std::int64_t stamp_ns : stamps_ns_) {
      const std::int64_t t_ns = stamp_ns - shift_ns;
      preintegrator_.integrate(recording_.data.wheels(), t_ns - step_ns, t_ns, piece_);
      before.push_back(piece_.g);
      preintegrator_.integrate(recording_.data.wheels(), t_ns, t_ns + step_ns, piece_);
      after.push_back(piece_.g);
    }
  });
  by_clock_.resize(segments_.size());
  for (std::size_t k = 0; k < segments_.size(); ++k) {
    const std::size_t begin = begin_of(k), end = k + 1;
    const Eigen::Vector3d& g = segments_[k].g;
    const Eigen::Vector3d back = between(before[end], Eigen::Vector3d::Zero());
    const Eigen::Vector3d later = compose(compose(before[begin], g), back);
    const Eigen::Vector3d earlier = compose(between(after[begin], g), after[end]);
    by_clock_[k] = (later - earlier) / (2. * kClockStep_s);
  }
}

void RecordingProblem::evaluate(const CalibrationPoint& point, bool jacobian,
                                RecordingResiduals& out) {
  const bool clock = options_.prior_sigma_clock_offset_s > 0. && !motions_.empty();
  // A solver asks for the residuals of a point, then for their derivatives, which are there.
  if (!integrated_ || !(*integrated_ == point)) {
    integrate(point);
    integrated_ = point;
  }
  if (jacobian && clock) differentiate_by_clock(point);
  out.r.setZero(static_cast<Eigen::Index>(kinds_.size()));
  out.J.setZero(out.r.size(), n_unknowns());
  int row = 0;
  for (std::size_t k = 0; k < motions_.size(); ++k, row += rows_per_segment()) {
    add_segment(row, k, point, jacobian, out);
  }
  if (options_.parity) {
    add_parity(row, out);
    row += n_;
  }
  add_measured_by_hand(row, point, out);
}

void RecordingProblem::add_segment(int row, std::size_t k, const CalibrationPoint& point,
                                   bool jacobian, RecordingResiduals& out) {
  const bool clock = options_.prior_sigma_clock_offset_s > 0.;
  const int rows = rows_per_segment();
  const Eigen::Vector3d whitening(1. / noise_.yaw_rad, 1. / noise_.position_m,
                                  1. / noise_.position_m);
  const MotionOfBody motion = motion_of_body(segments_[k].g, point.extrinsics);
  const double duration_s = seconds_between(stamps_ns_[begin_of(k)], stamps_ns_[k + 1]);
  Eigen::Vector3d error = motion.h - motions_[k];
  const bool gyro = recording_.motion.kind == ReferenceKind::kGyro;
  if (gyro) error[0] += point.gyro_bias_rad_per_s * duration_s;  // (CAL-10)
  out.r.segment(row, rows) = whitening.cwiseProduct(error).head(rows);
  squares_[k] = out.r.segment(row, rows).squaredNorm();
  out.r.segment(row, rows) *= std::sqrt(weights_[k]);
  if (!jacobian) return;
  const Eigen::Matrix3d by_g = whitening.asDiagonal() * motion.by_g;
  Eigen::Matrix<double, 3, Eigen::Dynamic> J(3, n_unknowns());
  J.leftCols(n_) = by_g * segments_[k].J_g_WI;
  J.block<3, 3>(0, n_) = whitening.asDiagonal() * motion.by_extrinsics;
  J.rightCols<2>().setZero();
  if (clock) J.col(n_ + 3) = by_g * by_clock_[k];
  if (gyro) J(0, n_ + 4) = whitening[0] * duration_s;
  out.J.middleRows(row, rows) = std::sqrt(weights_[k]) * J.topRows(rows);
}

void RecordingProblem::add_turns(double gyro_bias_rad_per_s, TurnAgreement& out) const {
  const bool gyro = recording_.motion.kind == ReferenceKind::kGyro;
  const double bias = gyro ? gyro_bias_rad_per_s : 0.;
  for (std::size_t k = 0; k < motions_.size(); ++k) {
    if (!is_compared(k)) continue;
    const bool first = !from_start() || k == 0;
    const double duration_s = seconds_between(stamps_ns_[k], stamps_ns_[k + 1]);
    out.add(segments_[k].g[0] - (first ? 0. : segments_[k - 1].g[0]),
            motions_[k][0] - (first ? 0. : motions_[k - 1][0]) - bias * duration_s);
  }
}

void RecordingProblem::weigh_segments() {
  if (weights_.empty()) return;
  const double most = chi2_quantile(kBelievable, rows_per_segment());
  for (std::size_t k = 0; k < weights_.size(); ++k) {
    if (!is_compared(k)) continue;
    weights_[k] = squares_[k] <= most ? 1. : most / squares_[k];
  }
}

int RecordingProblem::n_weighed_down() const {
  return static_cast<int>(std::count_if(weights_.begin(), weights_.end(),
                                        [](double weight) { return weight > 0. && weight < 1.; }));
}

int RecordingProblem::n_with_holes() const {
  return static_cast<int>(std::count(weights_.begin(), weights_.end(), 0.));
}

/// r = D^-1/2 V^T eta and J = D^1/2 V^T with Lambda = V D V^T have the gradient and the curvature
/// of the parity cost; directions without information have no residual (CAL-4).
void RecordingProblem::add_parity(int row, RecordingResiduals& out) const {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(parity_.Lambda);
  const double smallest = 1e-9 * eigen.eigenvalues()[n_ - 1];
  for (int i = 0; i < n_; ++i) {
    const double d = eigen.eigenvalues()[i];
    if (!(d > smallest)) continue;
    const Eigen::VectorXd v = eigen.eigenvectors().col(i);
    out.r[row + i] = v.dot(parity_.eta) / std::sqrt(d) / noise_.parity_scale;
    out.J.row(row + i).head(n_) = std::sqrt(d) / noise_.parity_scale * v.transpose();
  }
}

/// The path of O, of straight pieces that are short (CAL-13), and its turn (CAL-16).
void RecordingProblem::add_measured_by_hand(int row, const CalibrationPoint& point,
                                            RecordingResiduals& out) {
  const auto& [distance_m, turn_rad] =
      std::tie(recording_.motion.distance_m, recording_.motion.turn_rad);
  if (!distance_m && !turn_rad) return;
  const auto wheels = recording_.data.wheels();
  const std::int64_t step_ns = to_ns(kPathPiece_s);
  preintegrator_.move_intrinsics(point.x_WI);
  double path_m = 0., yaw_rad = 0.;
  Eigen::RowVectorXd J_path = Eigen::RowVectorXd::Zero(n_), J_yaw = J_path;
  guarded(recording_.setup.kinematics.info, "preintegration", [&] {
    for (std::int64_t t_ns = wheels.front().begin_ns; t_ns < wheels.back().end_ns;
         t_ns += step_ns) {
      preintegrator_.integrate(wheels, t_ns, std::min(t_ns + step_ns, wheels.back().end_ns),
                               piece_);
      yaw_rad += piece_.g[0];
      J_yaw += piece_.J_g_WI.row(0);
      const double length_m = piece_.g.tail<2>().norm();
      if (!(length_m > 0.)) continue;
      path_m += length_m;
      J_path += piece_.g.tail<2>().transpose() / length_m * piece_.J_g_WI.bottomRows<2>();
    }
  });
  const auto add = [&](double error, const Eigen::RowVectorXd& J, double sigma) {
    out.r[row] = error / sigma;
    out.J.row(row++).head(n_) = J / sigma;
  };
  if (distance_m) add(path_m - *distance_m, J_path, options_.sigma_distance_m);
  if (turn_rad) {
    add(yaw_rad - *turn_rad, J_yaw, options_.sigma_turn_deg * std::numbers::pi / 180.);
  }
}

}  // namespace viwo::calibration
