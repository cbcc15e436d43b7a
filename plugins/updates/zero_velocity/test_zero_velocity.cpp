// Standstill: what is taken for one and what is not, derivatives, consistency.
#include <gtest/gtest.h>

#include "allocations.hpp"
#include "filter_fixture.hpp"
#include "message_of.hpp"
#include "viwo/testing/jacobian.hpp"

namespace viwo {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr std::int64_t kMs = 1'000'000;
constexpr double kRateHz = 200.;

/// IMU, image and encoder data of epochs of 0.1 s of a robot that stands, or creeps along x.
class Robot {
 public:
  explicit Robot(double speed_m_per_s, double vibration = 1., int cameras = 1)
      : speed_(speed_m_per_s), vibration_(vibration), cameras_(cameras) {
    for (int i = 0; i < 60; ++i) {
      const VectorXd n = testing::gaussian(3, rng_);
      points_.emplace_back(2. * n[0], n[1], 3. + std::abs(n[2]));
    }
  }

  int first_reading = 0;  ///< of ten in an epoch

  EpochData epoch(int k, bool images, const testing::UpdateHost& host) {
    const ImuNoise noise;
    imu_.clear();
    for (int i = 0; i <= 20; ++i) {
      ImuSample sample;
      sample.t_ns = 100 * (k - 1) * kMs + 5 * i * kMs;
      const VectorXd n = vibration_ * std::sqrt(kRateHz) * testing::gaussian(6, rng_);
      for (int a = 0; a < 3; ++a) {
        const auto axis = static_cast<std::size_t>(a);
        sample.gyro_rad_per_s[axis] = 0.01 + noise.gyro_rad_per_s_sqrt_hz * n[a];
        sample.accel_m_per_s2[axis] = noise.accel_m_per_s2_sqrt_hz * n[3 + a];
      }
      sample.accel_m_per_s2[2] += 9.81;
      imu_.push_back(sample);
    }
    image_.points.clear();
    image_.t_ns = 100 * k * kMs;
    image_.camera = k % cameras_;
    for (std::size_t i = 0; i < points_.size(); ++i) {
      const VectorXd n = testing::gaussian(2, rng_);
      const Vector3d p = points_[i] - Vector3d(speed_ * 0.1 * k, 0., 0.);
      image_.points.push_back({static_cast<std::int64_t>(60 - i), 400. * p.x() / p.z() + n[0],
                               400. * p.y() / p.z() + n[1]});
    }
    encoders_.clear();
    for (int i = first_reading; i < 10; ++i) {
      EncoderSample sample;
      sample.begin_ns = 100 * (k - 1) * kMs + 10 * i * kMs;
      sample.end_ns = sample.begin_ns + 10 * kMs;
      sample.t_ns = sample.begin_ns + 5 * kMs;
      sample.n_drive = 4;
      sample.drive_rad_per_s.fill(speed_ / 0.025);
      encoders_.push_back(sample);
    }
    EpochData data = host.epoch(encoders_, std::span(&image_, images ? 1 : 0));
    data.begin_ns = 100 * (k - 1) * kMs;
    data.end_ns = 100 * k * kMs;
    data.imu = imu_;
    return data;
  }

 private:
  double speed_, vibration_;
  int cameras_;  ///< that take turns
  std::mt19937_64 rng_{17};
  std::vector<Vector3d> points_;
  std::vector<ImuSample> imu_;
  FeatureSample image_;
  std::vector<EncoderSample> encoders_;
};

testing::SmallFilter standing_filter(double sigma_v) {
  testing::SmallFilter filter;
  filter.clones.resize(2);
  filter.layout();
  filter.P.setIdentity();
  filter.P *= 1e-6;
  filter.P.diagonal().segment<3>(kVelocityColumn).setConstant(sigma_v * sigma_v);
  return filter;
}

/// Epochs of three seconds in which a factor came, and passed its own gate against `filter`.
int believed(const std::string& more, Robot robot, bool images, testing::SmallFilter filter,
             int* given = nullptr) {
  const auto update = testing::load_update("{type: zero_velocity" + more + "}");
  filter.start(*update);
  int count = 0;
  for (int k = 1; k <= 30; ++k) {
    FactorSink sink(1, 60);
    update->update(filter.view(), robot.epoch(k, images, filter), sink);
    if (given != nullptr) *given += static_cast<int>(sink.residuals().size());
    for (const ResidualFactor& factor : sink.residuals()) {
      const Eigen::MatrixXd H =
          testing::SmallFilter::spread(factor.columns, factor.H, filter.P.rows());
      const Eigen::MatrixXd S = H * filter.P * H.transpose() + factor.R;
      const double chi2 = factor.residual.dot(S.llt().solve(factor.residual));
      count += chi2 < 21.67 ? 1 : 0;  // 99 % of 9
      EXPECT_EQ(factor.gate_probability, 0.01);
    }
  }
  return count;
}

TEST(ZeroVelocity, SeesAStandstillWithTheImuAlone) {
  EXPECT_EQ(believed("", Robot(0.), false, standing_filter(0.01)), 30);
}

TEST(ZeroVelocity, DoesNotTakeSlowMotionForAStandstillWithTheImuAlone) {
  testing::SmallFilter unsure = standing_filter(0.1);
  EXPECT_EQ(believed("", Robot(0.05), false, unsure), 0);
  testing::SmallFilter sure = standing_filter(0.009);
  sure.imu.v_IinG = sure.imu.v_IinG_fej = Vector3d(0.05, 0., 0.);
  sure.clones[1].p_IinG = sure.clones[1].p_IinG_fej = Vector3d(0.005, 0., 0.);
  int given = 0;
  EXPECT_EQ(believed("", Robot(0.05), false, sure, &given), 0);
  EXPECT_EQ(given, 0) << "even motion contradicts nothing";
  // Wheels that stand while the filter moves do.
  EXPECT_EQ(believed(", detector: wheels", Robot(0.), false, sure, &given), 0);
  EXPECT_EQ(given, 30);
}

TEST(ZeroVelocity, SeesAStandstillAndSlowMotionInImagesWhateverTheFilterKnows) {
  const testing::SmallFilter unsure = standing_filter(1.);
  EXPECT_EQ(believed("", Robot(0.), true, unsure), 20);  // the first second is the window
  EXPECT_EQ(believed("", Robot(0.05), true, unsure), 0);
}

TEST(ZeroVelocity, SeesThemInTheImagesOfOneOfTwoCamerasThatTakeTurns) {
  const testing::SmallFilter unsure = standing_filter(1.);
  EXPECT_EQ(believed("", Robot(0., 1., 2), true, unsure), 10);
  EXPECT_EQ(believed("", Robot(0.05, 1., 2), true, unsure), 0);
  // A filter that would notice does not wait for the other camera.
  EXPECT_EQ(believed("", Robot(0., 1., 2), true, standing_filter(0.01)), 25);
}

TEST(ZeroVelocity, SeesAStandstillAndSlowMotionInTheWheels) {
  const testing::SmallFilter unsure = standing_filter(1.);
  EXPECT_EQ(believed(", detector: wheels", Robot(0.), false, unsure), 30);
  EXPECT_EQ(believed(", detector: wheels", Robot(0.05), false, unsure), 0);
  Robot late(0.);  // the last tenth of each epoch
  late.first_reading = 9;
  EXPECT_EQ(believed(", detector: wheels", late, false, unsure), 0);
}

TEST(ZeroVelocity, DoesNotBelieveAShakingImu) {
  EXPECT_EQ(believed(", detector: wheels", Robot(0., 5.), false, standing_filter(0.01)), 0);
}

TEST(ZeroVelocity, HasTheDerivativesOfItsResidualAtFirstEstimates) {
  std::mt19937_64 rng(2);
  for (int trial = 0; trial < 20; ++trial) {
    testing::SmallFilter filter = standing_filter(0.001);
    VectorXd random = VectorXd::Zero(filter.P.rows());
    random.head(27) = testing::gaussian(27, rng);
    filter.plus(random);
    filter.first_estimates();
    Robot robot(0.);
    const auto update = testing::load_update("{type: zero_velocity, gate_probability: 0}");
    filter.start(*update);
    const EpochData data = robot.epoch(2, false, filter);
    const auto factor = [&](const testing::SmallFilter& at) {
      FactorSink sink(1, 60);
      update->update(at.view(), data, sink);
      EXPECT_EQ(sink.residuals().size(), 1u);
      return sink.residuals()[0];
    };
    const auto residual = [&](const VectorXd& d) -> VectorXd {
      testing::SmallFilter moved = filter;
      moved.plus(d);
      return factor(moved).residual;
    };
    const auto size = filter.P.rows();
    const ResidualFactor here = factor(filter);
    const Eigen::MatrixXd H = testing::SmallFilter::spread(here.columns, here.H, size);
    EXPECT_EQ(testing::jacobian_mismatch(
                  -H, testing::central_difference(residual, VectorXd::Zero(size)), {}, 1e-6),
              "");
    testing::SmallFilter moved = filter;
    moved.plus(0.01 * random);
    EXPECT_TRUE(factor(moved).H == here.H);
    moved.first_estimates();
    EXPECT_FALSE(factor(moved).H == here.H);
  }
}

TEST(ZeroVelocity, IsConsistentAndWithAWrongSignNot) {
  std::mt19937_64 rng(8);
  double right = 0., wrong = 0.;
  constexpr int kRuns = 50;
  const std::vector<int> columns = [] {
    std::vector<int> c;
    for (int i = 0; i < 3; ++i) c.push_back(kVelocityColumn + i);
    for (int i = kImuSize; i < kImuSize + 12; ++i) c.push_back(i);
    return c;
  }();
  const std::string yaml =
      "{type: zero_velocity, sigma_velocity_m_per_s: 0.002, sigma_rotation_rad: 0.0005, "
      "sigma_position_m: 0.001, gate_probability: 0}";
  for (int run = 0; run < kRuns; ++run) {
    testing::SmallFilter filter = standing_filter(0.005);
    const auto size = filter.P.rows();
    // The truth stands but for what the sigmas allow.
    testing::SmallFilter truth = filter;
    const VectorXd n = testing::gaussian(9, rng);
    truth.imu.v_IinG = 0.002 * n.head<3>();
    truth.clones[1].R_GtoI = exp_so3(0.0005 * n.segment<3>(3));
    truth.clones[1].p_IinG = 0.001 * n.tail<3>();
    filter.imu = truth.imu;
    filter.clones = truth.clones;
    const VectorXd drawn = filter.P.diagonal().cwiseSqrt().cwiseProduct(
        testing::gaussian(static_cast<int>(size), rng));
    filter.plus(-drawn);
    filter.first_estimates();
    FactorSink sink(1, 60);
    Robot robot(0.);
    const auto update = testing::load_update(yaml);
    filter.start(*update);
    update->update(filter.view(), robot.epoch(2, false, filter), sink);
    ASSERT_EQ(sink.residuals().size(), 1u);
    const auto nees_after = [&](bool flip) {
      testing::SmallFilter updated = filter;
      FactorSink copy(1, 60);
      ResidualFactor& factor = copy.add_residual();
      factor = sink.residuals()[0];
      if (flip) factor.residual = -factor.residual;
      updated.apply(copy);
      VectorXd error = VectorXd::Zero(size);
      error.segment<3>(kVelocityColumn) = truth.imu.v_IinG - updated.imu.v_IinG;
      for (std::size_t i = 0; i < 2; ++i) {
        const int c = updated.clones[i].column;
        error.segment<3>(c) =
            -log_so3(truth.clones[i].R_GtoI * updated.clones[i].R_GtoI.transpose());
        error.segment<3>(c + 3) = truth.clones[i].p_IinG - updated.clones[i].p_IinG;
      }
      double sum = 0.;
      Eigen::MatrixXd C(15, 15);
      VectorXd e(15);
      for (int i = 0; i < 15; ++i) {
        e[i] = error[columns[static_cast<std::size_t>(i)]];
        for (int k = 0; k < 15; ++k) {
          C(i, k) =
              updated.P(columns[static_cast<std::size_t>(i)], columns[static_cast<std::size_t>(k)]);
        }
      }
      sum = e.dot(C.ldlt().solve(e)) / 15.;
      return sum;
    };
    right += nees_after(false) / kRuns;
    wrong += nees_after(true) / kRuns;
  }
  // 99 % bounds of chi-square / dof for 750 degrees of freedom.
  EXPECT_GT(right, 0.87);
  EXPECT_LT(right, 1.14);
  EXPECT_GT(wrong, 1.5);
}

TEST(ZeroVelocity, DoesNotAllocateInTheSteadyState) {
  if (!testing::counts_allocations()) GTEST_SKIP() << "malloc belongs to the sanitizer";
  testing::SmallFilter filter = standing_filter(0.01);
  const auto update = testing::load_update("{type: zero_velocity}");
  filter.start(*update);
  Robot robot(0.);
  FactorSink sink(1, 60);
  long allocated = 0;
  for (int k = 1; k <= 30; ++k) {
    const EpochData data = robot.epoch(k, true, filter);
    sink.clear();
    const FilterView view = filter.view();
    const long before = testing::allocations();
    update->update(view, data, sink);
    if (k > 2) allocated += testing::allocations() - before;
  }
  EXPECT_EQ(allocated, 0);
}

TEST(ZeroVelocity, WantsAWheelSetForTheDetectorWheels) {
  const auto update = testing::load_update("{type: zero_velocity, detector: wheels}");
  testing::UpdateHost no_wheels;
  EXPECT_EQ(testing::error_of([&] { update->declare(no_wheels); }),
            "needs wheels: there is no section 'kinematics'");
}

}  // namespace
}  // namespace viwo
