// Standstill: when the IMU is quiet and wheels, images or the filter itself say that the base does
// not creep, the velocity is zero and the last two clones are the same pose. Equations: model.md.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "encoders.hpp"
#include "still_images.hpp"
#include "tally.hpp"
#include "viwo/api/plugin.hpp"
#include "viwo/math/chi2.hpp"
#include "viwo/math/so3.hpp"

namespace viwo {
namespace {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::Vector3d;

struct Params {
  std::string detector = "imu";
  double max_noise_ratio = 3.;
  double max_drive_rad_per_s = 0.02;
  double max_disparity_px = 2.5;
  int min_points = 10;
  double window_s = 1.;
  double slowest_m_per_s = 0.05;
  double slowest_rad_per_s = 0.02;
  double sigma_velocity_m_per_s = 0.001;
  double sigma_rotation_rad = 1e-5;
  double sigma_position_m = 1e-5;
  double gate_probability = 0.01;

  void bind(ParamBinder& b) {
    b(VIWO_PARAM(detector),
      {.choices = "imu|wheels",
       .help = "what tells a standstill from slow, even motion: images or else the filter's "
               "own certainty (imu), or drive rates of a wheel set (wheels)"});
    b(VIWO_PARAM(max_noise_ratio),
      {.min = 1.,
       .help = "IMU samples of an epoch may scatter by this factor more than their noise"});
    b(VIWO_PARAM(max_drive_rad_per_s),
      {.unit = "rad/s", .above = 0., .help = "detector wheels: drive rate of a wheel that stands"});
    b(VIWO_PARAM(max_disparity_px),
      {.unit = "px",
       .above = 0.,
       .help = "detector imu: median distance of the points of two images that are "
               "window_s apart; above 1.7 times the noise of a point"});
    b(VIWO_PARAM(min_points),
      {.min = 3,
       .max = 1000,
       .help = "detector imu: points that two images must share to be compared"});
    b(VIWO_PARAM(window_s),
      {.unit = "s", .above = 0., .help = "detector imu: how long the images must not have moved"});
    b(VIWO_PARAM(slowest_m_per_s),
      {.unit = "m/s",
       .above = 0.,
       .help = "detector imu without images: the slowest motion; a standstill is only "
               "believed when the filter knows its velocity to a quarter of it"});
    b(VIWO_PARAM(slowest_rad_per_s),
      {.unit = "rad/s",
       .above = 0.,
       .help = "the same for the slowest rotation and the gyroscope bias"});
    b(VIWO_PARAM(sigma_velocity_m_per_s),
      {.unit = "m/s", .above = 0., .help = "how still a standing base is: velocity, per axis"});
    b(VIWO_PARAM(sigma_rotation_rad),
      {.unit = "rad",
       .above = 0.,
       .help = "how still a standing base is: rotation from epoch to epoch, per axis"});
    b(VIWO_PARAM(sigma_position_m),
      {.unit = "m",
       .above = 0.,
       .help = "how still a standing base is: displacement from epoch to epoch, per axis"});
    b(VIWO_PARAM(gate_probability),
      {.min = 0.,
       .max = 0.5,
       .help = "standstills less likely than this to the filter are not believed; 0: none"});
  }
};

constexpr int kMostRows = 9, kMostColumns = 6 + 2 * kPoseSize;

/// The IMU must have so many samples in an epoch to be judged quiet.
constexpr std::size_t kFewestSamples = 5;

class ZeroVelocity final : public Update {
 public:
  ZeroVelocity(const Params& params, const HostServices& /*services*/)
      : params_(params),
        use_wheels_(params.detector == "wheels"),
        images_(params.max_disparity_px, params.min_points, params.window_s) {}

  void declare(Declarations& host) override {
    if (use_wheels_) {
      wheels_ = declare_wheels(host);
      encoders_ = declare_encoders(host, wheels_);
    } else {
      features_ = host.stream({.type = &sample_type<FeatureSample>(), .optional = true});
    }
  }

  void start(const UpdateSetup& /*setup*/) override { images_.reserve(); }

  void update(const FilterView& filter, const EpochData& data, FactorSink& sink) override {
    if (filter.clones.empty()) return;
    if (!quiet(data.imu, filter.imu_noise)) {
      images_.forget();
      return;
    }
    bool is_seen = true;
    if (use_wheels_) {
      if (!wheels_stand(filter, data)) return;
    } else {
      switch (images_.compare(data.samples<FeatureSample>(features_))) {
        case StillImages::kMoved:
          images_moved_.add(1, data.end_ns);
          return;
        case StillImages::kTooEarly:
          return;
        case StillImages::kStill:
          break;
        case StillImages::kUnknown:
          if (!would_notice(filter)) return;
          is_seen = false;
          break;
      }
    }
    emit(filter, factor_);
    // Then motion is no contradiction: nothing but the filter has said that there is none.
    if (!is_seen && !is_likely(filter)) return;
    sink.add_residual() = factor_;
  }

  void rejections(std::vector<RejectionCount>& out) const override { images_moved_.append_to(out); }

 private:
  /// (ZV-1): the samples scatter around their mean as their noise does.
  bool quiet(std::span<const ImuSample> imu, const ImuNoise& noise) const {
    if (imu.size() < kFewestSamples) return false;
    const double span_s = seconds_between(imu.front().t_ns, imu.back().t_ns);
    if (!(span_s > 0.)) return false;
    const auto n = static_cast<double>(imu.size());
    const double rate_hz = (n - 1.) / span_s;
    const auto scatters = [&](const std::array<double, 3> ImuSample::*channel, double density) {
      Vector3d sum = Vector3d::Zero();
      for (const ImuSample& sample : imu) sum += Vector3d((sample.*channel).data());
      const Vector3d mean = sum / n;
      double squares = 0.;
      for (const ImuSample& sample : imu) {
        squares += (Vector3d((sample.*channel).data()) - mean).squaredNorm();
      }
      const double limit =
          params_.max_noise_ratio * params_.max_noise_ratio * density * density * rate_hz;
      return !(squares <= 3. * (n - 1.) * limit);
    };
    return !scatters(&ImuSample::gyro_rad_per_s, noise.gyro_rad_per_s_sqrt_hz) &&
           !scatters(&ImuSample::accel_m_per_s2, noise.accel_m_per_s2_sqrt_hz);
  }

  /// No wheel has turned since the last epoch; there must be a sample that says so.
  bool wheels_stand(const FilterView& filter, const EpochData& data) const {
    const std::int64_t offset_ns = std::llround(1e9 * filter.block(wheels_.clock).numbers()[0]);
    const std::int64_t from_ns = data.begin_ns - offset_ns;
    const std::int64_t to_ns = data.end_ns - offset_ns;
    std::int64_t seen_ns = 0;
    for (const EncoderSample& sample : data.samples<EncoderSample>(encoders_)) {
      if (sample.end_ns <= from_ns || sample.begin_ns >= to_ns) continue;
      for (int i = 0; i < sample.n_drive; ++i) {
        const double rate = sample.drive_rad_per_s[static_cast<std::size_t>(i)];
        if (!(std::abs(rate) <= params_.max_drive_rad_per_s)) return false;
      }
      seen_ns += std::min(sample.end_ns, to_ns) - std::max(sample.begin_ns, from_ns);
    }
    // Most of the epoch must have been seen; samples may be a little late.
    return 2 * seen_ns >= to_ns - from_ns;
  }

  /// (ZV-2): the slowest motion would not pass the gate.
  bool would_notice(const FilterView& filter) const {
    const FilterView::Covariance P = filter.P();
    const auto largest_sigma = [&](int column) {
      return std::sqrt(P.diagonal().segment<3>(column).maxCoeff());
    };
    return 4. * largest_sigma(kVelocityColumn) < params_.slowest_m_per_s &&
           4. * largest_sigma(kGyroBiasColumn) < params_.slowest_rad_per_s;
  }

  /// Whether the factor passes its gate.
  bool is_likely(const FilterView& filter) {
    if (params_.gate_probability <= 0.) return true;
    const FilterView::Covariance P = filter.P();
    std::array<int, kMostColumns> columns{};
    std::size_t n = 0;
    for (const ColumnRange& block : factor_.columns.blocks()) {
      for (int i = 0; i < block.count; ++i) columns[n++] = block.first + i;
    }
    const auto size = static_cast<Index>(n);
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, kMostColumns,
                  kMostColumns>
        P_f(size, size);
    for (Index i = 0; i < size; ++i) {
      for (Index k = 0; k < size; ++k) {
        P_f(i, k) = P(columns[static_cast<std::size_t>(i)], columns[static_cast<std::size_t>(k)]);
      }
    }
    const Index rows = factor_.residual.size();
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, kMostRows, kMostColumns>
        HP = factor_.H.lazyProduct(P_f);
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, kMostRows, kMostRows> S =
        factor_.R;
    S += HP.lazyProduct(factor_.H.transpose());
    Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor, kMostRows, 1> white =
        factor_.residual;
    S.llt().matrixL().solveInPlace(white);
    if (rows != gate_rows_) {
      gate_rows_ = rows;
      gate_ = chi2_quantile(1. - params_.gate_probability, static_cast<double>(rows));
    }
    return white.squaredNorm() <= gate_;
  }

  void emit(const FilterView& filter, ResidualFactor& factor) const {
    const CloneState& now = filter.clones.back();
    const bool two = filter.clones.size() > 1;
    factor.columns.clear();
    const int theta = factor.columns.add(kThetaColumn, 3);
    const int velocity = factor.columns.add(kVelocityColumn, 3);
    int first = 0, last = 0;
    if (two) {
      first = factor.columns.add(filter.clones[filter.clones.size() - 2].column, kPoseSize);
      last = factor.columns.add(now.column, kPoseSize);
    }
    factor.set_rows(two ? 9 : 3);
    factor.gate_probability = params_.gate_probability;
    const auto square = [](double x) { return x * x; };

    // (ZV-3)
    const ImuState& imu = filter.imu;
    factor.residual.head<3>() = -imu.R_GtoI * imu.v_IinG;
    factor.H.block<3, 3>(0, theta) = skew(imu.R_GtoI_fej * imu.v_IinG_fej);
    factor.H.block<3, 3>(0, velocity) = imu.R_GtoI_fej;
    factor.R.diagonal().head<3>().setConstant(square(params_.sigma_velocity_m_per_s));
    if (!two) return;

    // (ZV-4)
    const CloneState& before = filter.clones[filter.clones.size() - 2];
    factor.residual.segment<3>(3) = -log_so3(now.R_GtoI * before.R_GtoI.transpose());
    const Vector3d phi = log_so3(now.R_GtoI_fej * before.R_GtoI_fej.transpose());
    factor.H.block<3, 3>(3, first) = right_jacobian_inverse_so3(phi);
    factor.H.block<3, 3>(3, last) = -right_jacobian_inverse_so3(-phi);
    factor.R.diagonal().segment<3>(3).setConstant(square(params_.sigma_rotation_rad));
    // (ZV-5)
    factor.residual.tail<3>() = -before.R_GtoI * (now.p_IinG - before.p_IinG);
    factor.H.block<3, 3>(6, first) = skew(before.R_GtoI_fej * (now.p_IinG_fej - before.p_IinG_fej));
    factor.H.block<3, 3>(6, first + 3) = -before.R_GtoI_fej;
    factor.H.block<3, 3>(6, last + 3) = before.R_GtoI_fej;
    factor.R.diagonal().tail<3>().setConstant(square(params_.sigma_position_m));
  }

  Params params_;
  bool use_wheels_;
  WheelsBlocks wheels_;
  StreamId encoders_, features_;
  StillImages images_;
  ResidualFactor factor_;
  double gate_ = 0.;
  Index gate_rows_ = 0;
  Tally images_moved_{"quiet IMU, but the images move"};
};

VIWO_REGISTER(Update, ZeroVelocity, "zero_velocity", "1.0.0",
              "a base that stands has no velocity and does not move between clones", "Apache-2.0",
              Params);

}  // namespace
}  // namespace viwo
