// ATE, RPE and end errors against closed forms.
#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "message_of.hpp"
#include "trajectories.hpp"
#include "viwo/eval/accuracy.hpp"

namespace viwo::eval {
namespace {

constexpr double kDegPerRad = 180. / std::numbers::pi;

TEST(Accuracy, OfTheSameTrajectoryInAnotherWorldIsPerfect) {
  std::mt19937_64 random(21);
  const Trajectory reference = arc(0.05, 0.1, 500);
  const Trajectory estimate = moved(reference, about_z(1.2), {3., 4., 5.});
  const Accuracy accuracy = evaluate(reference, estimate);
  EXPECT_EQ(accuracy.n_poses, 500);
  EXPECT_NEAR(accuracy.duration_s, 49.9, 1e-9);
  EXPECT_LT(accuracy.ate_m, 1e-12);
  EXPECT_LT(accuracy.ate_deg, 1e-5);
  EXPECT_LT(accuracy.rpe[0].rmse_m, 1e-12);
  EXPECT_LT(accuracy.end_m, 1e-12);
}

// The estimate drifts in yaw by kappa per metre while the robot goes straight: it describes an arc,
// and each segment of length L ends at [sin(kappa L)/kappa, (1 - cos(kappa L))/kappa].
TEST(Accuracy, OfAConstantYawDriftIsTheClosedForm) {
  constexpr double kKappa = 0.02;
  const Trajectory reference = moved(arc(0., 0.1, 401), about_z(0.5), {7., 8., 9.});
  const Trajectory estimate = arc(kKappa, 0.1, 401);
  const auto chord_error = [](double length) {
    const double x = std::sin(kKappa * length) / kKappa - length;
    const double y = (1. - std::cos(kKappa * length)) / kKappa;
    return std::hypot(x, y);
  };
  Options options;
  options.segment_lengths_m = {10., 25.};
  const Accuracy accuracy = evaluate(reference, estimate, options);
  EXPECT_NEAR(accuracy.path_length_m, 40., 1e-9);
  ASSERT_EQ(accuracy.rpe.size(), 2U);
  EXPECT_EQ(accuracy.rpe[0].count, 301);
  EXPECT_EQ(accuracy.rpe[1].count, 151);
  for (const SegmentErrors& errors : accuracy.rpe) {
    EXPECT_NEAR(errors.mean_m, chord_error(errors.length_m), 1e-9);
    EXPECT_NEAR(errors.rmse_m, chord_error(errors.length_m), 1e-9);
    EXPECT_NEAR(errors.mean_deg, kKappa * errors.length_m * kDegPerRad, 1e-9);
    EXPECT_NEAR(errors.rmse_deg, kKappa * errors.length_m * kDegPerRad, 1e-9);
  }
  EXPECT_NEAR(accuracy.end_m, chord_error(40.), 1e-9);
  EXPECT_NEAR(accuracy.end_deg, 0.8 * kDegPerRad, 1e-9);
  EXPECT_NEAR(accuracy.end_yaw_deg, 0.8 * kDegPerRad, 1e-9);
  ASSERT_EQ(accuracy.series.path_length_m.size(), 401U);
  EXPECT_NEAR(accuracy.series.path_length_m[200], 20., 1e-9);
  EXPECT_NEAR(accuracy.series.t_s[200], 20., 1e-9);
  EXPECT_NEAR(accuracy.series.position_error_m[200], chord_error(20.), 1e-9);
  EXPECT_NEAR(accuracy.series.yaw_error_deg[200], 0.4 * kDegPerRad, 1e-9);
}

TEST(Accuracy, SegmentsMayStartAtEveryTenthPose) {
  Options options;
  options.segment_stride = 10;
  options.segment_lengths_m = {10.};
  const Accuracy accuracy = evaluate(arc(0., 0.1, 401), arc(0.02, 0.1, 401), options);
  EXPECT_EQ(accuracy.rpe[0].count, 31);
}

TEST(Accuracy, MeanAndRmseOverSegmentsDifferWhereErrorsDo) {
  // Perfect for 10 m, then 3 % too long: segments of 10 m that begin at s gain 0.03 s.
  Trajectory reference = arc(0., 1., 21);
  Trajectory estimate = reference;
  for (StampedPose& pose : estimate) {
    pose.p_BinW.x() += 0.03 * std::max(0., pose.p_BinW.x() - 10.);
  }
  Options options;
  options.segment_lengths_m = {10.};
  const SegmentErrors errors = evaluate(reference, estimate, options).rpe[0];
  EXPECT_EQ(errors.count, 11);
  EXPECT_NEAR(errors.mean_m, 0.03 * 5., 1e-12);                     // mean of 0 .. 10
  EXPECT_NEAR(errors.rmse_m, 0.03 * std::sqrt(385. / 11.), 1e-12);  // squares of 0 .. 10: 385
  EXPECT_NEAR(errors.mean_deg, 0., 1e-12);
}

TEST(Accuracy, DriftBeyondHalfATurnKeepsItsSign) {
  Trajectory reference = arc(0., 0.1, 401);
  Trajectory estimate = reference;        // 40 m at -0.1 rad/m: -4 rad
  reference[200].q_BtoW = about_z(1e-5);  // it has orientations
  for (StampedPose& pose : estimate) pose.q_BtoW = about_z(-0.1 * pose.p_BinW.x());
  const Accuracy accuracy = evaluate(reference, estimate);
  EXPECT_NEAR(accuracy.end_yaw_deg, -4. * kDegPerRad, 1e-9);
  EXPECT_NEAR(accuracy.end_deg, (2. * std::numbers::pi - 4.) * kDegPerRad, 1e-9);
}

TEST(Accuracy, AteWithoutAlignmentIsTheOffset) {
  const Trajectory reference = arc(0.1, 0.1, 100);
  Trajectory estimate = reference;
  for (StampedPose& pose : estimate) {
    pose.p_BinW += Eigen::Vector3d(3., 4., 0.);
    pose.q_BtoW = pose.q_BtoW * about_z(0.01);
  }
  Options options;
  options.alignment = Alignment::kNone;
  const Accuracy accuracy = evaluate(reference, estimate, options);
  EXPECT_NEAR(accuracy.ate_m, 5., 1e-12);
  EXPECT_NEAR(accuracy.ate_deg, 0.01 * kDegPerRad, 1e-9);
}

TEST(Accuracy, AteAfterYawAndPositionIsTheScaleErrorOfACircle) {
  // A whole circle of radius 10, estimated 2 % too large and elsewhere: 0.2 m everywhere.
  Trajectory reference;
  for (int i = 0; i < 360; ++i) {
    const Eigen::Quaterniond q = about_z(i / kDegPerRad);
    reference.push_back({i * std::int64_t{100'000'000}, q * Eigen::Vector3d(10., 0., 0.), q});
  }
  Trajectory estimate = reference;
  for (StampedPose& pose : estimate) pose.p_BinW *= 1.02;
  estimate = moved(estimate, about_z(2.5), {-4., 3., 1.});
  const Accuracy accuracy = evaluate(reference, estimate);
  EXPECT_NEAR(accuracy.ate_m, 0.2, 1e-10);
  EXPECT_LT(accuracy.ate_deg, 1e-5);
}

TEST(Accuracy, IsOverTheCommonTimeOnly) {
  const Trajectory reference = arc(0., 0.1, 101);
  Trajectory estimate = arc(0., 0.1, 201);
  estimate.back().p_BinW.y() = 1e6;
  const Accuracy accuracy = evaluate(reference, estimate);
  EXPECT_EQ(accuracy.n_poses, 101);
  EXPECT_EQ(accuracy.n_outside, 100);
  EXPECT_LT(accuracy.ate_m, 1e-12);
}

TEST(Accuracy, AsJsonHasTheAgreedNamesAndNullForMissingSegments) {
  Options options;
  options.segment_lengths_m = {2.5, 10., 25.};
  const Accuracy accuracy = evaluate(arc(0., 0.1, 121), arc(0.02, 0.1, 121), options);
  const nlohmann::json json = to_json(accuracy);
  EXPECT_DOUBLE_EQ(json.at("ate_m").get<double>(), accuracy.ate_m);
  EXPECT_DOUBLE_EQ(json.at("ate_deg").get<double>(), accuracy.ate_deg);
  EXPECT_DOUBLE_EQ(json.at("rpe").at("2.5").at("m").get<double>(), accuracy.rpe[0].mean_m);
  EXPECT_DOUBLE_EQ(json.at("rpe").at("10").at("deg").get<double>(), accuracy.rpe[1].mean_deg);
  EXPECT_EQ(json.at("rpe").at("10").at("count"), 21);
  EXPECT_TRUE(json.at("rpe").at("25").is_null());
  EXPECT_DOUBLE_EQ(json.at("end").at("m").get<double>(), accuracy.end_m);
  EXPECT_DOUBLE_EQ(json.at("end").at("deg").get<double>(), accuracy.end_deg);
  EXPECT_EQ(json.at("alignment"), "yaw_position");
  EXPECT_EQ(json.at("poses"), 121);
}

TEST(Accuracy, IsOverLengthsThatThePathHasThreeOf) {
  const auto lengths = [](int poses) {
    std::vector<double> lengths_m;
    for (const SegmentErrors& e : evaluate(arc(0., 0.1, poses), arc(0., 0.1, poses)).rpe) {
      lengths_m.push_back(e.length_m);
      EXPECT_GT(e.count, 0);
    }
    return lengths_m;
  };
  EXPECT_EQ(lengths(311), (std::vector<double>{5., 10.}));  // of 31 m
  EXPECT_EQ(lengths(290), (std::vector<double>{2.5, 5.}));
  EXPECT_EQ(lengths(9), (std::vector<double>{0.1, 0.25}));
}

TEST(Accuracy, EndErrorLeavesOpenWhatTheAlignmentDoes) {
  // The estimate is tilted by 5 mrad at its start, and right from then on.
  const Trajectory reference = arc(0.02, 0.1, 401);  // 40 m
  Trajectory estimate = moved(reference, about_z(0.3), {1., 2., 3.});
  StampedPose& first = estimate.front();
  first.q_BtoW = first.q_BtoW * Eigen::AngleAxisd(0.005, Eigen::Vector3d::UnitY());
  Options options;
  EXPECT_LT(evaluate(reference, estimate, options).end_m, 1e-3);  // gravity is known to both
  options.alignment = Alignment::kSe3;
  EXPECT_GT(evaluate(reference, estimate, options).end_m, 0.005 * 30.);
  options.alignment = Alignment::kNone;
  EXPECT_GT(evaluate(reference, estimate, options).end_m, 3.);
}

// A prism, or GNSS: whatever the alignment, the orientations of such a reference mean nothing.
TEST(Accuracy, OfPositionsAloneIsThatOfPositions) {
  const Trajectory estimate = arc(0.2, 0.1, 401);
  Trajectory reference = moved(estimate, about_z(0.7), {1., -2., 0.5});
  for (std::size_t i = 0; i < reference.size(); ++i) {
    reference[i].q_BtoW.setIdentity();
    reference[i].p_BinW.z() += i % 2 == 0 ? 0.01 : -0.01;
  }
  for (const Alignment alignment : {Alignment::kStart, Alignment::kYawPosition, Alignment::kSe3}) {
    Options options;
    options.alignment = alignment;
    options.segment_lengths_m = {5.};
    const Accuracy accuracy = evaluate(reference, estimate, options);
    EXPECT_NEAR(accuracy.ate_m, 0.01, 1e-3) << name(alignment);
    EXPECT_LT(accuracy.rpe[0].mean_m, 0.021) << name(alignment);
    EXPECT_LT(accuracy.end_m, 0.021) << name(alignment);
    EXPECT_TRUE(std::isnan(accuracy.ate_deg));
    EXPECT_TRUE(std::isnan(accuracy.rpe[0].mean_deg));
    EXPECT_TRUE(std::isnan(accuracy.end_yaw_deg));
    EXPECT_TRUE(to_json(accuracy).at("end").at("yaw_deg").is_null());
  }
  // However far off: a circle is not gone round without turning.
  for (StampedPose& pose : reference) pose.p_BinW *= 1.3;
  EXPECT_GT(evaluate(reference, estimate).ate_m, 0.5);
  EXPECT_TRUE(std::isnan(evaluate(reference, estimate).end_yaw_deg));
  // What does not turn either has the orientation that it has.
  const Trajectory straight = arc(0., 0.1, 401);
  EXPECT_NEAR(evaluate(straight, moved(straight, about_z(0.1), {0., 0., 0.})).ate_deg, 0., 1e-6);
}

TEST(Accuracy, WithoutNumbersIsNullInJson) {
  Accuracy accuracy;
  accuracy.ate_m = std::numeric_limits<double>::quiet_NaN();
  accuracy.end_m = std::numeric_limits<double>::infinity();
  EXPECT_TRUE(to_json(accuracy).at("ate_m").is_null());
  EXPECT_TRUE(to_json(accuracy).at("end").at("m").is_null());
}

TEST(Accuracy, RefusesOptionsOutOfRange) {
  const Trajectory path = arc(0., 0.1, 50);
  const auto message = [&](const Options& options) {
    return testing::error_of([&] { evaluate(path, path, options); });
  };
  Options options;
  options.segment_lengths_m = {10., -2.5};
  EXPECT_EQ(message(options), "segment length -2.5 m must be positive and finite");
  options = {};
  options.segment_stride = 0;
  EXPECT_EQ(message(options), "segment_stride must be at least 1");
  options = {};
  options.max_reference_gap_s = 0.;
  EXPECT_EQ(message(options), "max_reference_gap_s must be positive");
}

}  // namespace
}  // namespace viwo::eval
