// Fixes of a body on the IMU from outside: positions (GNSS) or poses (motion capture), each at its
// own instant between two clones. Equations: model.md.
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "fix.hpp"
#include "tally.hpp"
#include "viwo/api/plugin.hpp"
#include "viwo/math/arrays.hpp"
#include "viwo/math/so3.hpp"

namespace viwo {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using namespace pose_reference;

/// The host has room for so many factors of one update in an epoch.
constexpr double kMostFixes = 16.;

struct Params {
  std::string use = "position";
  double sigma_position_m = 0.02;
  double sigma_height_m = 0.;
  double sigma_orientation_rad = 0.01;
  Eigen::Vector3d p_BinI_m{0., 0., 0.};
  Eigen::Vector3d rpy_ItoB_rad{0., 0., 0.};
  double yaw_WtoG_rad = 0.;
  Eigen::Vector3d p_WinG_m{0., 0., 0.};
  int max_per_epoch = 5;
  double max_span_s = 0.5;
  double gate_probability = 0.001;

  void bind(ParamBinder& b) {
    b(VIWO_PARAM(use),
      {.choices = "position|pose",
       .help = "what of a fix is believed: position (GNSS), or position and orientation "
               "(motion capture)"});
    b(VIWO_PARAM(sigma_position_m),
      {.unit = "m", .above = 0., .help = "noise of the position, per axis"});
    b(VIWO_PARAM(sigma_height_m),
      {.unit = "m",
       .min = 0.,
       .help = "noise of the vertical axis, if it is another; 0: sigma_position_m"});
    b(VIWO_PARAM(sigma_orientation_rad),
      {.unit = "rad", .above = 0., .help = "use pose: noise of the orientation, per axis of B"});
    b(VIWO_PARAM(p_BinI_m),
      {.unit = "m", .help = "lever arm: where B (antenna, marker frame) is seen from the IMU"});
    b(VIWO_PARAM(rpy_ItoB_rad),
      {.unit = "rad",
       .min = -3.2,
       .max = 3.2,
       .help = "how the IMU is turned in B: R_ItoB = Rz(third) Ry(second) Rx(first)"});
    b(VIWO_PARAM(yaw_WtoG_rad),
      {.unit = "rad",
       .min = -3.2,
       .max = 3.2,
       .help = "how the world W of the fixes is turned in G, about the vertical"});
    b(VIWO_PARAM(p_WinG_m), {.unit = "m", .help = "where the origin of W is in G"});
    b(VIWO_PARAM(max_per_epoch),
      {.min = 1.,
       .max = kMostFixes,
       .help = "of more fixes in an epoch so many are used, evenly spread"});
    b(VIWO_PARAM(max_span_s),
      {.unit = "s", .above = 0., .help = "fixes between clones further apart are left out"});
    b(VIWO_PARAM(gate_probability),
      {.min = 0.,
       .max = 0.5,
       .help = "fixes less likely than this are weighed down (F-32) and counted; 0: none"});
  }
};

class PoseReference final : public Update {
 public:
  PoseReference(const Params& params, const HostServices& /*services*/)
      : params_(params),
        with_orientation_(params.use == "pose"),
        max_per_epoch_(static_cast<std::size_t>(params.max_per_epoch)),
        p_WinG_(params.p_WinG_m) {
    const double height = params.sigma_height_m;
    const double position = params.sigma_position_m;
    sigma_.head<3>().setConstant(params.sigma_orientation_rad);
    sigma_.tail<3>() << position, position, height > 0. ? height : position;
    R_WtoG_ = exp_so3({0., 0., params.yaw_WtoG_rad});
    const Vector3d rpy = params.rpy_ItoB_rad;
    lever_.R_ItoB =
        exp_so3({0., 0., rpy.z()}) * exp_so3({0., rpy.y(), 0.}) * exp_so3({rpy.x(), 0., 0.});
    lever_.p_BinI = params.p_BinI_m;
  }

  void declare(Declarations& host) override {
    fixes_ = host.stream({.type = &sample_type<PoseSample>()});
  }

  void update(const FilterView& filter, const EpochData& data, FactorSink& sink) override {
    const auto fixes = data.samples<PoseSample>(fixes_);
    const std::size_t n = fixes.size();
    const std::size_t used = std::min(n, max_per_epoch_);
    too_many_.add(static_cast<std::int64_t>(n - used), data.end_ns);
    for (std::size_t i = 0; i < used; ++i) {
      // The last of each of `used` equal parts: all of them when there are few.
      const PoseSample& fix = fixes[(i + 1) * n / used - 1];
      const auto clones = brackets_.around(filter.clones, fix.t_ns, params_.max_span_s);
      if (clones) emit(*clones, fix, sink);
    }
  }

  void rejections(std::vector<RejectionCount>& out) const override {
    brackets_.append_to(out);
    bad_quaternion_.append_to(out);
    too_many_.append_to(out);
  }

 private:
  void emit(const Bracket& clones, const PoseSample& fix, FactorSink& sink) {
    const Eigen::Quaterniond q = to_quaternion(fix.q_BtoW_xyzw);
    if (with_orientation_ && !(std::abs(q.norm() - 1.) < 1e-3)) {
      bad_quaternion_.add(1, fix.t_ns);
      return;
    }
    const auto& [first, last, period_s, u] = clones;
    const BodyPose body = body_between(at_estimate(first), at_estimate(last), period_s, u, lever_);
    BodyJacobian J;
    body_between(at_first_estimate(first), at_first_estimate(last), period_s, u, lever_, &J);

    const int rows = with_orientation_ ? 6 : 3;
    ResidualFactor& factor = sink.add_residual();
    factor.columns.add(first.column, kPoseSize);
    factor.columns.add(last.column, kPoseSize);
    factor.set_rows(rows);
    factor.gate_probability = params_.gate_probability;
    factor.heavy_tailed = true;
    factor.H = J.bottomRows(rows);
    factor.R.diagonal() = sigma_.tail(rows).cwiseAbs2();
    // (PR-7)
    factor.residual.tail<3>() = R_WtoG_ * to_vector(fix.p_BinW_m) + p_WinG_ - body.p_BinG;
    if (!with_orientation_) return;
    // (PR-8)
    const Matrix3d R_BtoG = R_WtoG_ * q.normalized().toRotationMatrix();
    factor.residual.head<3>() = -log_so3(R_BtoG.transpose() * body.R_GtoB.transpose());
  }

  Params params_;
  StreamId fixes_;
  bool with_orientation_;
  std::size_t max_per_epoch_;
  Eigen::Matrix<double, 6, 1> sigma_;  // orientation, position
  Vector3d p_WinG_;
  Matrix3d R_WtoG_;
  Lever lever_;

  Brackets brackets_;
  Tally bad_quaternion_{"fix whose quaternion has not unit norm"};
  Tally too_many_{"fix beyond max_per_epoch"};
};

VIWO_REGISTER(Update, PoseReference, "pose_reference", "1.0.0",
              "positions or poses of a body on the IMU, as GNSS or motion capture gives them",
              "Apache-2.0", Params);

}  // namespace
}  // namespace viwo
