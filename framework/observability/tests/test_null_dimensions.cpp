// Null spaces of whole systems along motions: their dimensions, and that they are what theory says.
#include <algorithm>
#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "analysis.hpp"
#include "viwo/observability/null_space.hpp"
#include "viwo/observability/observability_matrix.hpp"

namespace viwo {
namespace {

using namespace observability;
using testing::analyse;
using testing::find;
using ::testing::HasSubstr;

/// Everything of configs/observability/degenerate_motions.yaml, computed once.
const ObservabilityReport& degenerate_motions() {
  static const ObservabilityReport kReport = analyse("observability/degenerate_motions.yaml");
  return kReport;
}

/// A point enters by normal equations, and leaves the root of rounding, 1e-6 for one of little
/// parallax: more or less of it by the processor.
constexpr double kClear = 100.;

struct Expected {
  const char* motion;
  int held, free;                 // unobservable directions of the whole system
  int wheels_alone;               // of the sixteen intrinsics
  int wheels_and_mount;           // with the planar mount
  std::vector<const char*> sets;  // named sets that make up the null space
};

void expect_rows(const char* variant, const std::vector<Expected>& rows) {
  for (const Expected& row : rows) {
    const ObservabilityResult& result = find(degenerate_motions(), row.motion, variant);
    EXPECT_EQ(result.held.unobservable, row.held) << row.motion;
    EXPECT_EQ(result.free.unobservable, row.free) << row.motion;
    EXPECT_EQ(result.wheels_alone, row.wheels_alone) << row.motion;
    EXPECT_EQ(result.wheels_and_mount, row.wheels_and_mount) << row.motion;
    EXPECT_EQ(result.free.state_size, 47) << row.motion;
    EXPECT_EQ(result.held.state_size, 44) << row.motion;
    EXPECT_GT(result.held.gap, kClear) << row.motion;
    EXPECT_GT(result.free.gap, kClear) << row.motion;
    for (const char* set : row.sets) {
      const ExplainedDirections& explained = find(result.free, set);
      EXPECT_EQ(explained.hidden, explained.dimension) << row.motion << ": " << set;
      EXPECT_LT(explained.max_angle_rad, 1e-8) << row.motion << ": " << set;
    }
  }
}

constexpr const char* kGlobal = "global position and yaw";
constexpr const char* kGauge = "placement of O";
constexpr const char* kVertical = "p_IinO along the axis";
constexpr const char* kTilt = "tilt of the mount";
constexpr const char* kConstant = "constant steering";
constexpr const char* kPositions = "wheel positions";
constexpr const char* kBias = "tilt and accelerometer bias";

// The paper's table, for twist and parity: general motion 4 + 3, and what each degeneracy adds.
TEST(NullDimensions, OfTwistAndParityAreThoseOfTheTable) {
  expect_rows(
      "full",
      {{"general", 4, 7, 0, 3, {kGlobal, kGauge}},
       {"general_on_flat_ground", 7, 10, 0, 3, {kGlobal, kGauge, kVertical, kTilt}},
       {"figure_eight", 7, 10, 0, 3, {kGlobal, kGauge, kVertical, kTilt}},
       {"crab_varying", 17, 20, 8, 11, {kGlobal, kGauge, kPositions, "p_IinO", kTilt, kBias}},
       {"straight", 18, 21, 8, 11, {kGlobal, kGauge, kPositions, "p_IinO", "t_OtoI", kTilt, kBias}},
       {"lateral", 18, 21, 8, 11, {kGlobal, kGauge, kPositions, "p_IinO", "t_OtoI", kTilt, kBias}},
       {"constant_steering", 15, 18, 8, 11, {kGlobal, kGauge, kConstant, kVertical, kTilt}},
       {"circle", 16, 19, 8, 11, {kGlobal, kGauge, kConstant, kVertical, kTilt, "t_OtoI"}},
       {"spin", 16, 19, 8, 11, {kGlobal, kGauge, kConstant, kVertical, kTilt, "t_OtoI"}},
       {"pivot_about_wheel_1", 15, 18, 8, 11, {kGlobal, kGauge, kConstant, "wheel 1", kVertical}},
       {"stationary", 27, 30, 16, 19, {kGlobal, kGauge, "all of the calibration"}}});
  for (const ObservabilityResult& result : degenerate_motions().results) {
    if (degenerate_motions().setup.variants[result.variant].name != "full") continue;
    EXPECT_EQ(result.free.unexplained, 0);
  }
}

// The least-squares twist alone, the paper's measurement: seven numbers of sixteen under any
// motion.
TEST(NullDimensions, OfTheTwistAloneAreThoseOfTheTable) {
  expect_rows("twist_only", {{"general", 13, 16, 9, 12, {kGlobal, kGauge}},
                             {"general_on_flat_ground", 16, 19, 9, 12, {kGlobal, kGauge, kTilt}},
                             {"figure_eight", 17, 20, 10, 13, {kGlobal, kGauge, kTilt}},
                             {"crab_varying", 21, 24, 12, 15, {kGlobal, kGauge, kPositions}},
                             {"straight", 23, 26, 13, 16, {kGlobal, kGauge, kPositions}},
                             {"constant_steering", 20, 23, 13, 16, {kGlobal, kGauge, kConstant}},
                             {"circle", 21, 24, 13, 16, {kGlobal, kGauge, kConstant}},
                             {"spin", 21, 24, 13, 16, {kGlobal, kGauge, kConstant}}});
}

// Drive rows alone: the four offsets under every motion, and on a rectangle one direction more.
TEST(NullDimensions, OfDriveRowsAloneHaveTheSteeringOffsetsUnderEveryMotion) {
  const std::pair<const char*, int> rows[] = {{"general", 5},   {"figure_eight", 5},
                                              {"spin", 13},     {"constant_steering", 13},
                                              {"straight", 14}, {"crab_varying", 13}};
  for (const auto& [motion, wheels_alone] : rows) {
    const ObservabilityResult& result = find(degenerate_motions(), motion, "drive_only");
    EXPECT_EQ(result.wheels_alone, wheels_alone) << motion;
    const ExplainedDirections& offsets = find(result.free, "steering offsets");
    EXPECT_EQ(offsets.hidden, 4) << motion;
    EXPECT_LT(offsets.max_angle_rad, 1e-9) << motion;
  }
  // Those of the world, and the five (WO-22).
  EXPECT_EQ(find(degenerate_motions(), "general", "drive_only").held.unobservable, 4 + 5);
}

TEST(NullDimensions, SetsThatAMotionExcitesAreNotHidden) {
  const Observability& general = find(degenerate_motions(), "general", "full").free;
  for (const char* set : {kPositions, "steering offsets", kConstant, "wheel 1", "wheel 4", "p_IinO",
                          kVertical, kTilt, "t_OtoI", kBias}) {
    EXPECT_EQ(find(general, set).hidden, 0) << set;
    EXPECT_GT(find(general, set).max_angle_rad, 0.1) << set;
  }
}

TEST(NullDimensions, SayWhichParametersCannotBeTold) {
  const auto& parameters = [](const char* motion, const char* variant) -> const auto& {
    return find(degenerate_motions(), motion, variant).parameters;
  };
  const auto hidden = [&](const char* motion, const char* variant) {
    std::vector<std::string> names;
    for (const ObservedParameter& parameter : parameters(motion, variant)) {
      if (!parameter.observable) names.push_back(parameter.name);
    }
    return names;
  };
  EXPECT_TRUE(hidden("general", "full").empty());
  EXPECT_EQ(parameters("general", "full").size(), 20u);
  EXPECT_THAT(hidden("general_on_flat_ground", "full"),
              ::testing::UnorderedElementsAre("theta_ItoO_x", "theta_ItoO_y", "p_IinO_x",
                                              "p_IinO_y", "p_IinO_z"));
  EXPECT_THAT(hidden("general", "drive_only"),
              ::testing::IsSupersetOf({"delta_o2", "delta_o3", "delta_o4"}));
  EXPECT_THAT(hidden("straight", "full"),
              ::testing::IsSupersetOf({"x_2", "x_3", "x_4", "y_2", "y_3", "y_4", "t_OtoI"}));
  // What is learned is told by how much: offsets under the full constraint and with drive rows.
  const auto ratio = [&](const char* motion, const char* variant, const std::string& name) {
    for (const ObservedParameter& parameter : parameters(motion, variant)) {
      if (parameter.name == name) return parameter.sigma_ratio;
    }
    return -1.;
  };
  EXPECT_LT(ratio("general", "full", "delta_o2"), 0.05);
  EXPECT_GT(ratio("general", "drive_only", "delta_o2"), 0.999);
  EXPECT_GT(ratio("straight", "full", "x_2"), 0.999);
  EXPECT_LT(ratio("general", "full", "x_2"), 0.1);
}

TEST(NullDimensions, OfADifferentialDriveComeFromTheSameTool) {
  const ObservabilityReport report = analyse("observability/differential.yaml");
  const std::pair<const char*, int> rows[] = {{"general", 4},   {"figure_eight", 7},
                                              {"straight", 13}, {"circle", 11},
                                              {"spin", 11},     {"stationary", 17}};
  for (const auto& [motion, unobservable] : rows) {
    const ObservabilityResult& result = find(report, motion, "differential");
    EXPECT_EQ(result.held.unobservable, unobservable) << motion;
    EXPECT_EQ(result.free.unobservable, unobservable) << motion << ": no gauge to free";
    EXPECT_GT(result.held.gap, kClear) << motion;
  }
  EXPECT_EQ(find(report, "straight", "differential").wheels_alone, 1);
  EXPECT_EQ(find(find(report, "straight", "differential").free, "baseline").hidden, 1);
}

/// Forwards factors with columns of the intrinsics that are wrong by a part `error`.
class Disturbed final : public EstimatorObserver {
 public:
  Disturbed(ObservabilityMatrix& matrix, double error) : matrix_(matrix), error_(error) {}
  void on_clone(const Filter& filter, const ImuMatrix& Phi) override {
    matrix_.on_clone(filter, Phi);
  }
  void on_factor(const Filter& filter, const UpdateEntry& update,
                 const ResidualFactor& factor) override {
    ResidualFactor wrong = factor;
    for (Eigen::Index i = 0; i < wrong.H.size(); ++i) {
      wrong.H(i) *= 1. + error_ * gaussian_(rng_);
    }
    matrix_.on_factor(filter, update, wrong);
  }
  void on_factor(const Filter& filter, const UpdateEntry& update,
                 const InformationFactor& factor) override {
    matrix_.on_factor(filter, update, factor);
  }

 private:
  ObservabilityMatrix& matrix_;
  double error_;
  std::mt19937_64 rng_{1};
  std::normal_distribution<double> gaussian_;
};

/// Unobservable directions of a short general motion when the Jacobians are that much wrong.
int unobservable_with(double jacobian_error) {
  const config::Node run = resolve_placeholders(
      load_run_configuration(testing::configuration("runs/viwo_swerve.yaml"),
                             {"sensors.simulator0.duration_s=10", "sensors.simulator0.features=50",
                              "sensors.simulator0.ramp_s=0", "wheels.hold_gauge=false"}));
  RunSetup setup = read_run(run, testing::registry(), {}, true);
  setup.filter->options.runner.frozen = true;
  const RunData data = collect(setup);
  std::optional<ObservabilityMatrix> matrix;
  std::optional<Disturbed> disturbed;
  RunHooks hooks;
  hooks.on_start = [&](const Estimator& estimator) {
    matrix.emplace(estimator.filter(), FeatureOptions());
    disturbed.emplace(*matrix, jacobian_error);
    return &*disturbed;
  };
  run_filter(setup, data, hooks);
  const Eigen::MatrixXd M = matrix->triangle() * matrix->prior_sigma().asDiagonal();
  return matrix->size() - null_space(M, 5e-5).rank;
}

TEST(NullDimensions, ShrinkWhenJacobiansAreWrong) {
  EXPECT_EQ(unobservable_with(0.), 7);
  EXPECT_LT(unobservable_with(0.01), 5);
}

}  // namespace
}  // namespace viwo
