// The column of the clock: a derivative by time, of two instruments, that shares no noise with what
// it stands beside.
#include <cmath>

#include <gtest/gtest.h>

#include "calibration_runs.hpp"
#include "clock_rate.hpp"
#include "instrument.hpp"
#include "viwo/math/so3.hpp"

namespace viwo::wheel_odometry {
namespace {

constexpr std::int64_t kMs = 1'000'000;
constexpr std::int64_t kBeginNs = 1000 * kMs, kEndNs = 1100 * kMs;

class Sweep : public ::testing::Test {
 protected:
  Sweep()
      // Noise that goes neither with the speed nor with the direction is that of all thirds.
      : model_(testing::load_model(testing::swerve(
            "four_wis_wid", ", sigma_steer_rad: 1e-6, sigma_lateral_m_per_s: 2.55e-5"))),
        instrument_(model_, PreintegrationOptions{}) {
    instrument_.set_weights_at(model_->nominal());
  }

  std::vector<EncoderSample> drive(bool noise, std::uint64_t seed = 1,
                                   double rate_hz = 100.) const {
    const sim::PlanarMotion motion("icr_sweep", {.ramp_s = 1.});
    sim::EncoderSimulation simulation;
    simulation.duration_s = 1.5;
    simulation.noise = noise;
    simulation.rate_hz = rate_hz;
    return sim::simulate_encoders(model_->model(), model_->nominal(), motion, simulation, seed);
  }

  PreintegratedPose pose(const std::vector<EncoderSample>& samples, std::int64_t shift_ns = 0) {
    const auto pose =
        instrument_.pose({samples, kBeginNs + shift_ns, kEndNs + shift_ns}, model_->nominal());
    EXPECT_TRUE(pose.has_value());
    return pose.value_or(PreintegratedPose{});
  }

  std::optional<Eigen::Vector3d> rate(const std::vector<EncoderSample>& samples) {
    return instrument_.rate({samples, kBeginNs, kEndNs}, model_->nominal(), pose(samples));
  }

  std::shared_ptr<const WheelModel> model_;
  Instrument instrument_;
};

TEST_F(Sweep, RateIsTheDerivativeByTime) {
  const auto samples = drive(false);
  const Eigen::Vector3d numeric = (pose(samples, 10 * kMs).g - pose(samples, -10 * kMs).g) / 0.02;
  const auto analytic = rate(samples);
  ASSERT_TRUE(analytic.has_value());
  EXPECT_GT(numeric.norm(), 0.05);
  // Rates are taken as linear over the interval.
  EXPECT_LT((*analytic - numeric).norm(), 0.02 * numeric.norm());
}

TEST_F(Sweep, RateHasNoNoiseOfThePose) {
  constexpr int kDraws = 4000;
  const auto clean = drive(false);
  const Eigen::Vector3d g = pose(clean).g, true_rate = *rate(clean);
  const Eigen::Vector3d sooner = pose(clean, -50 * kMs).g;
  Eigen::Array3d pp = Eigen::Array3d::Zero(), rr = pp, pr = pp, ss = pp, ps = pp;
  for (int k = 0; k < kDraws; ++k) {
    const auto samples = drive(true, static_cast<std::uint64_t>(k));
    const Eigen::Array3d p = pose(samples).g - g;
    const Eigen::Array3d r = *rate(samples) - true_rate;
    // What it was: the interval, and the same one 50 ms sooner.
    const Eigen::Array3d s = p - (pose(samples, -50 * kMs).g - sooner).array();
    pp += p * p;
    rr += r * r;
    pr += p * r;
    ss += s * s;
    ps += p * s;
  }
  const Eigen::Array3d correlation = pr / (pp * rr).sqrt(), one_sided = ps / (pp * ss).sqrt();
  const double by_chance = 4. / std::sqrt(kDraws);
  for (int i = 0; i < 3; ++i) {
    EXPECT_LT(std::abs(correlation[i]), by_chance) << i;
    EXPECT_GT(one_sided[i], by_chance) << i;
  }
  // (WO-13)
  const Eigen::Array3d variance = 13.5 / 0.01 * pose(clean).P_g.diagonal().array();
  const Eigen::Array3d ratio = rr / kDraws / variance;
  EXPECT_TRUE((ratio > 0.8).all() && (ratio < 1.2).all()) << ratio.transpose();
}

TEST_F(Sweep, RateNeedsAllSamplesAndAFew) {
  auto samples = drive(false);
  const PreintegratedPose whole = pose(samples);
  const auto rate_of = [&] {
    return instrument_.rate({samples, kBeginNs, kEndNs}, model_->nominal(), whole);
  };
  EXPECT_TRUE(rate_of().has_value());
  samples.resize(103);
  EXPECT_FALSE(rate_of().has_value());
  // Of one sample for all of the interval both thirds are alike, whatever the base does.
  const auto slow = drive(false, 1, 20.);
  EXPECT_FALSE(rate(slow).has_value());
}

/// Two clones a tenth of a second apart, of an IMU that speeds up along x and turns faster.
Point speeding_up() {
  Point point;
  point.first.v_IinI = {1., 0., 0.};
  point.last.v_IinI = {1.05, 0., 0.};
  point.last.p_IinG = {0.1025, 0., 0.};
  point.last.w_IinI = {0., 0., 0.02};
  return point;
}

/// Of a gyro that says so, too, at 200 Hz.
std::vector<ImuSample> imu_of_an_epoch() {
  std::vector<ImuSample> samples(21);
  for (std::size_t k = 0; k < samples.size(); ++k) {
    samples[k].t_ns = static_cast<std::int64_t>(5 * k) * kMs;
    samples[k].gyro_rad_per_s = {0., 0., 1e-3 * static_cast<double>(k)};
  }
  return samples;
}

/// A filter that knows the bias of its accelerometer and the tilt as well as said.
class ClockRate : public ::testing::Test {
 protected:
  explicit ClockRate(double sigma_bias = 0., double sigma_tilt = 0.)
      : P_(Eigen::MatrixXd::Zero(kImuSize, kImuSize)) {
    P_.diagonal().segment<3>(kAccelBiasColumn).setConstant(sigma_bias * sigma_bias);
    P_.diagonal().segment<3>(kThetaColumn).setConstant(sigma_tilt * sigma_tilt);
    filter_.size = filter_.covariance_stride = kImuSize;
    filter_.covariance_data = P_.data();
  }

  Rate at(double sigma_of_wheels) const {
    return clock_rate({of_wheels_, 0.1, Eigen::Vector3d::Constant(std::pow(sigma_of_wheels, 2))},
                      speeding_up(), filter_, imu_);
  }

  Eigen::MatrixXd P_;
  FilterView filter_;
  const std::vector<ImuSample> imu_ = imu_of_an_epoch();
  const Eigen::Vector3d of_imu_{0.02, 0.05, 0.}, of_wheels_{0.03, 0.04, 0.01};
};

TEST_F(ClockRate, IsThatOfTheQuieterInstrument) {
  const ImuNoise& noise = filter_.imu_noise;
  EXPECT_TRUE(at(1.).g.isApprox(of_imu_, 1e-3));
  EXPECT_TRUE(at(1e-9).g.isApprox(of_wheels_, 1e-3));
  // A line through 21 readings; what the accelerometer adds up to.
  const double of_turn =
      200. * std::pow(0.1 * noise.gyro_rad_per_s_sqrt_hz, 2) / (770. * std::pow(0.005, 2));
  const double of_velocity = 0.1 * std::pow(noise.accel_m_per_s2_sqrt_hz, 2);
  const Eigen::Vector3d imu_alone(of_turn, of_velocity, of_velocity);
  EXPECT_TRUE(at(1.).variance.isApprox(imu_alone, 1e-3));
  const Rate missing = clock_rate({std::nullopt, 0.1, {}}, speeding_up(), filter_, imu_);
  EXPECT_TRUE(missing.g.isApprox(of_imu_, 1e-9));
  EXPECT_TRUE(missing.variance.isApprox(imu_alone, 1e-9));
  // As noisy as the gyro: half of each.
  const double same = std::sqrt(of_turn * 0.01 / 13.5);
  EXPECT_NEAR(at(same).g[0], 0.025, 1e-9);
  EXPECT_NEAR(at(same).variance[0], 0.5 * of_turn, 1e-12);
}

TEST_F(ClockRate, OfInstrumentsWithoutNoiseIsTheirMean) {
  filter_.imu_noise = {0., 0., 0., 0.};
  EXPECT_NEAR(at(0.).g[0], 0.025, 1e-12);
  EXPECT_TRUE(at(0.).variance.isZero(0.));
}

class ClockRateAtTheStart : public ClockRate {
 protected:
  ClockRateAtTheStart() : ClockRate(0.02, 0.005) {}
};

// Before the filter knows them, they are accelerations that are none.
TEST_F(ClockRateAtTheStart, KnowsOfTheBiasAndTheTilt) {
  filter_.imu_noise = {0., 0., 0., 0.};
  const double expected = 0.01 * (std::pow(0.02, 2) + std::pow(9.81 * 0.005, 2));
  const Rate alone = clock_rate({std::nullopt, 0.1, {}}, speeding_up(), filter_, imu_);
  EXPECT_NEAR(alone.variance[1], expected, 1e-9);
  EXPECT_NEAR(alone.variance[2], expected, 1e-9);
  EXPECT_EQ(alone.variance[0], 0.);
}

// After a rest the two are known together: what a tilt feigns the bias takes back.
TEST_F(ClockRateAtTheStart, KnowsWhatTheyHaveInCommon) {
  filter_.imu_noise = {0., 0., 0., 0.};
  Point at = speeding_up();
  at.mount.R_ItoO = exp_so3(Eigen::Vector3d(0.1, -0.2, 0.7));
  filter_.imu.R_GtoI = exp_so3(Eigen::Vector3d(-0.1, 0.3, 1.2));
  const double sigma = 0.005;
  P_.setZero();
  P_.block<3, 3>(kThetaColumn, kThetaColumn) = sigma * sigma * Eigen::Matrix3d::Identity();
  // The accelerometer read R g - b all the time.
  const Eigen::Matrix3d b_by_theta =
      skew(filter_.imu.R_GtoI * Eigen::Vector3d(0., 0., -filter_.gravity_m_per_s2));
  P_.block<3, 3>(kAccelBiasColumn, kAccelBiasColumn) =
      sigma * sigma * b_by_theta * b_by_theta.transpose();
  const auto variance = [&](double sign) {
    P_.block<3, 3>(kAccelBiasColumn, kThetaColumn) = sign * sigma * sigma * b_by_theta;
    P_.block<3, 3>(kThetaColumn, kAccelBiasColumn) = sign * sigma * sigma * b_by_theta.transpose();
    return clock_rate({std::nullopt, 0.1, {}}, at, filter_, imu_).variance;
  };
  EXPECT_LT(variance(1.).tail<2>().norm(), 1e-12);
  EXPECT_GT(variance(-1.).tail<2>().norm(), 1e-5);
}

TEST_F(ClockRate, OfReadingsThatAreNotOfTheIntervalIsUnknown) {
  const WheelRate longer{std::nullopt, 0.3, Eigen::Vector3d::Ones()};
  EXPECT_GT(clock_rate(longer, speeding_up(), filter_, imu_).variance.minCoeff(), 1.);
  const Rate rate =
      clock_rate({of_wheels_, 0.1, Eigen::Vector3d::Constant(1e-8)}, speeding_up(), filter_, {});
  EXPECT_TRUE(rate.g.isApprox(of_wheels_, 1e-6));
}

}  // namespace
}  // namespace viwo::wheel_odometry
