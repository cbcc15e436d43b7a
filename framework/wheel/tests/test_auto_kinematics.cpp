// Each hand-written model against its automatic twin: the same base from one templated
// auto_rows<T>().
#include <Eigen/Dense>
#include <gtest/gtest.h>

#include "viwo/api/auto_kinematics.hpp"
#include "viwo/wheel/preintegration.hpp"
#include "wheel_fixture.hpp"

namespace viwo {
namespace {

using testing::differential;
using testing::load_model;
using testing::swerve;

/// Copies the description of the hand-written model, without its sparsity.
ModelDescription description_of(const WheelModel& model) {
  ModelDescription description = model.description();
  for (auto& spec : description.intrinsics) spec.rows = {};
  for (auto& spec : description.noises) spec.rows = {};
  description.constant_A = false;
  description.noise_block = description.n_rows;
  return description;
}

/// The paper's rows in the wheel frames, eq. (forward_map): four rolling, four lateral.
class WheelFrameSwerve final : public AutoKinematics<WheelFrameSwerve> {
 public:
  explicit WheelFrameSwerve(const WheelModel& twin) : description_(description_of(twin)) {
    for (std::size_t j = 0; j < 4; ++j) {
      description_.noises[8 + j].rows = {4 + static_cast<int>(j), 1};
    }
  }
  void describe(ModelDescription& out) const override { out = description_; }

  template <class T>
  void auto_rows(std::span<const T> drive_rad_per_s, std::span<const T> steer_rad,
                 std::span<const T> x_WI, AutoRows<T>& out) const {
    using std::cos, std::sin;
    for (std::size_t j = 0; j < 4; ++j) {
      const T r = x_WI[j], x = x_WI[4 + j], y = x_WI[8 + j];
      const T delta = steer_rad[j] - x_WI[12 + j];
      const T c = cos(delta), s = sin(delta);
      const int i = static_cast<int>(j);
      out.A(i, 0) = c;
      out.A(i, 1) = s;
      out.A(i, 2) = x * s - y * c;
      out.b[j] = r * drive_rad_per_s[j];
      out.A(4 + i, 0) = -s;
      out.A(4 + i, 1) = c;
      out.A(4 + i, 2) = x * c + y * s;
    }
  }

 private:
  ModelDescription description_;
};

class AutoDriveOnly final : public AutoKinematics<AutoDriveOnly> {
 public:
  explicit AutoDriveOnly(const WheelModel& twin) : description_(description_of(twin)) {}
  void describe(ModelDescription& out) const override { out = description_; }

  template <class T>
  void auto_rows(std::span<const T> drive_rad_per_s, std::span<const T> steer_rad,
                 std::span<const T> x_WI, AutoRows<T>& out) const {
    using std::cos, std::sin;
    for (std::size_t j = 0; j < 4; ++j) {
      const T delta = steer_rad[j] - x_WI[12 + j];
      const int i = static_cast<int>(j);
      out.A(i, 0) = cos(delta);
      out.A(i, 1) = sin(delta);
      out.A(i, 2) = x_WI[4 + j] * sin(delta) - x_WI[8 + j] * cos(delta);
      out.b[j] = x_WI[j] * drive_rad_per_s[j];
    }
  }

 private:
  ModelDescription description_;
};

class AutoDifferential final : public AutoKinematics<AutoDifferential> {
 public:
  explicit AutoDifferential(const WheelModel& twin) : description_(description_of(twin)) {
    description_.noises[2].rows = {2, 1};
  }
  void describe(ModelDescription& out) const override { out = description_; }

  template <class T>
  void auto_rows(std::span<const T> drive_rad_per_s, std::span<const T> /*steer_rad*/,
                 std::span<const T> x_WI, AutoRows<T>& out) const {
    out.A(0, 0) = T(1.);
    out.A(0, 2) = -0.5 * x_WI[2];
    out.b[0] = x_WI[0] * drive_rad_per_s[0];
    out.A(1, 0) = T(1.);
    out.A(1, 2) = 0.5 * x_WI[2];
    out.b[1] = x_WI[1] * drive_rad_per_s[1];
    out.A(2, 1) = T(1.);
  }

 private:
  ModelDescription description_;
};

/// A noisy, disturbed drive of two seconds; the noise is `scale` times that of the model.
std::vector<EncoderSample> noisy_drive(const WheelModel& model, double scale) {
  const bool can_crab = model.description().n_steer > 0;
  const auto motion = [&](double t) {
    return Twist(0.4, can_crab ? 0.2 * std::sin(2. * t) : 0., 0.8 * std::cos(3. * t));
  };
  std::mt19937_64 rng(17);
  auto samples = testing::sample_motion(model, motion, 2., 50.);
  for (auto& sample : samples) {
    sample = testing::with_noise(model, motion(1e-9 * static_cast<double>(sample.t_ns)), sample,
                                 scale, rng);
  }
  return samples;
}

/// Poses, Jacobians and covariances of both over a noisy, disturbed drive. `parity_tolerance`: the
/// fitted reading of the automatic twin is exact to second order of the residual.
template <class Twin>
void compare(const std::string& yaml, bool weighted, double parity_tolerance) {
  const auto model = load_model(yaml);
  const auto twin = std::make_shared<const WheelModel>(std::make_shared<const Twin>(*model));
  const auto samples = noisy_drive(*model, 1.);
  PreintegratedPose by_hand, automatic;
  Preintegrator(model, {.twist = {.noise_weighted = weighted}})
      .integrate(samples, 0, 2'000'000'000, by_hand);
  Preintegrator(twin, {.twist = {.noise_weighted = weighted}})
      .integrate(samples, 0, 2'000'000'000, automatic);
  EXPECT_LT((by_hand.g - automatic.g).norm(), weighted ? 1e-5 : 1e-9);
  // With weights the derivative of the weights is left out, which in other rows is another term of
  // the order of the residual.
  const double tolerance = weighted ? 2e-2 : 1e-9;
  EXPECT_LT((by_hand.J_g_WI - automatic.J_g_WI).norm(), tolerance * by_hand.J_g_WI.norm());
  EXPECT_LT((by_hand.P_g - automatic.P_g).norm(), tolerance * by_hand.P_g.norm());
  EXPECT_NEAR(by_hand.parity.chi2, automatic.parity.chi2,
              parity_tolerance * (1. + by_hand.parity.chi2));
  EXPECT_LT((by_hand.parity.Lambda - automatic.parity.Lambda).norm(),
            parity_tolerance * (1e-9 + by_hand.parity.Lambda.norm()));
  EXPECT_EQ(by_hand.parity.dof, automatic.parity.dof);
}

TEST(AutomaticTwin, OfFourWisWidInWheelFrameRowsAgrees) {
  compare<WheelFrameSwerve>(swerve("four_wis_wid"), false, 2e-2);
  compare<WheelFrameSwerve>(swerve("four_wis_wid"), true, 2e-2);
}

TEST(AutomaticTwin, OfFourWisWidDriveOnlyAgrees) {
  compare<AutoDriveOnly>(swerve("four_wis_wid_drive_only"), false, 2e-2);
  compare<AutoDriveOnly>(swerve("four_wis_wid_drive_only"), true, 2e-2);
}

TEST(AutomaticTwin, OfDifferentialAgrees) {
  compare<AutoDifferential>(differential(), false, 1e-9);
  compare<AutoDifferential>(differential(), true, 1e-9);
}

TEST(AutomaticTwin, HasTheSameParityJacobianForSlipFreeSamples) {
  const auto model = load_model(swerve("four_wis_wid"));
  const auto twin =
      std::make_shared<const WheelModel>(std::make_shared<const WheelFrameSwerve>(*model));
  const auto motion = [](double t) {
    return Twist(0.4, 0.2 * std::sin(2. * t), 0.8 * std::cos(3. * t));
  };
  const auto samples = testing::sample_motion(*model, motion, 2., 50.);
  PreintegratedPose by_hand, automatic;
  Preintegrator(model, {}).integrate(samples, 0, 2'000'000'000, by_hand);
  Preintegrator(twin, {}).integrate(samples, 0, 2'000'000'000, automatic);
  EXPECT_LT((by_hand.parity.Lambda - automatic.parity.Lambda).norm(),
            1e-8 * by_hand.parity.Lambda.norm());
}

// What a wheel slides by is noise, and so is how much the nearest reading turns the rows of its
// frame: in derivatives, as in the residual, they would teach the size of the base, which no wheel
// contradicts.
TEST(AutomaticTwin, LearnsNothingElseFromWheelsThatSlide) {
  const auto model = load_model(swerve("four_wis_wid"));
  const auto twin =
      std::make_shared<const WheelModel>(std::make_shared<const WheelFrameSwerve>(*model));
  const auto samples = noisy_drive(*model, 2.);
  PreintegratedPose by_hand, automatic;
  Preintegrator(model, {}).integrate(samples, 0, 2'000'000'000, by_hand);
  Preintegrator(twin, {}).integrate(samples, 0, 2'000'000'000, automatic);
  // By what each moves the intrinsics, in prior sigmas.
  const Intrinsics prior = model->prior_sigma();
  const auto step = [&](const ParityInformation& parity) {
    Eigen::MatrixXd P = prior.asDiagonal() * parity.Lambda * prior.asDiagonal();
    P.diagonal().array() += 1.;
    return Eigen::VectorXd(P.llt().solve(prior.cwiseProduct(parity.eta)));
  };
  EXPECT_LT((step(by_hand.parity) - step(automatic.parity)).norm(), 0.05);
}

}  // namespace
}  // namespace viwo
