// Association and alignment: known transforms come back, optima cannot be beaten, faults are named.
#include <limits>
#include <numbers>
#include <random>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "message_of.hpp"
#include "trajectories.hpp"
#include "viwo/eval/alignment.hpp"
#include "viwo/eval/association.hpp"

namespace viwo::eval {
namespace {

using testing::error_of;

constexpr double kGap_s = 1.5;

double cost(const Association& common, const RigidTransform& T_EtoR) {
  double sum = 0.;
  for (const PosePair& pair : common.pairs) {
    sum += ((T_EtoR * pair.estimate).p_BinW - pair.reference.p_BinW).squaredNorm();
  }
  return sum;
}

TEST(Association, InterpolatesTheReferenceAndCountsWhatIsLeftOut) {
  Trajectory reference = arc(0., 1., 11);                         // 0 s .. 1 s, x = 10 t
  reference.erase(reference.begin() + 4, reference.begin() + 9);  // gap from 0.3 s to 0.9 s
  Trajectory estimate;
  for (const std::int64_t t_ms : {-10, 0, 50, 275, 500, 600, 930, 1000, 1001, 2000}) {
    estimate.push_back({t_ms * 1'000'000, Eigen::Vector3d::Zero(), Eigen::Quaterniond::Identity()});
  }
  const Association common = associate(reference, estimate, 0.2);
  EXPECT_EQ(common.n_outside, 3);
  EXPECT_EQ(common.n_in_gap, 2);
  ASSERT_EQ(common.pairs.size(), 5U);
  EXPECT_NEAR(common.pairs[1].reference.p_BinW.x(), 0.5, 1e-12);
  EXPECT_NEAR(common.pairs[2].reference.p_BinW.x(), 2.75, 1e-12);
  EXPECT_NEAR(common.pairs[3].reference.p_BinW.x(), 9.3, 1e-12);
  EXPECT_EQ(common.pairs[3].estimate.t_ns, 930'000'000);
}

TEST(Association, WithoutOverlapNamesBothTimeRanges) {
  Trajectory reference = arc(0., 1., 21);
  Trajectory estimate = arc(0., 1., 11);
  for (StampedPose& pose : estimate) pose.t_ns += 1'700'000'000'250'000'000;
  EXPECT_EQ(error_of([&] { associate(reference, estimate, kGap_s); }),
            "no pose of the estimate lies in the time of the reference: reference from 0.000 s to "
            "2.000 s, estimate from 1700000000.250 s to 1700000001.250 s");
}

TEST(Association, WithNothingButGapsSaysSo) {
  const Trajectory reference{{0, {0., 0., 0.}, Eigen::Quaterniond::Identity()},
                             {10'000'000'000, {1., 0., 0.}, Eigen::Quaterniond::Identity()}};
  const Trajectory estimate{{-500'000'000, {0., 0., 0.}, Eigen::Quaterniond::Identity()},
                            {5'000'000'000, {0., 0., 0.}, Eigen::Quaterniond::Identity()}};
  EXPECT_EQ(error_of([&] { associate(reference, estimate, kGap_s); }),
            "the reference has no pose near any pose of the estimate: its gaps are longer "
            "than 1.5 s (reference from 0.000 s to 10.000 s, estimate from -0.500 s to 5.000 s) - "
            "viwo evaluate --max-gap SECONDS, evaluation.reference_max_gap_s of a run");
}

TEST(Association, RefusesTrajectoriesThatAreNotOnes) {
  const Trajectory good = arc(0., 1., 5);
  EXPECT_EQ(error_of([&] { associate({}, good, kGap_s); }), "the reference trajectory is empty");
  EXPECT_EQ(error_of([&] { associate(good, {}, kGap_s); }), "the estimate trajectory is empty");
  Trajectory bad = good;
  bad[2].p_BinW.y() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(error_of([&] { associate(good, bad, kGap_s); }),
            "pose 3 of the estimate is not finite");
  bad = good;
  bad[3].t_ns = bad[2].t_ns;
  EXPECT_EQ(error_of([&] { associate(bad, good, kGap_s); }),
            "pose 4 of the reference is not later than the one before it (0.200 s after 0.200 s)");
  bad = good;
  bad[1].q_BtoW.coeffs().setZero();
  EXPECT_EQ(error_of([&] { associate(good, bad, kGap_s); }),
            "the quaternion of pose 2 of the estimate does not have unit norm");
}

TEST(Alignment, RecoversAKnownTransform) {
  std::mt19937_64 random(11);
  const Trajectory estimate = random_trajectory(30, random);
  const Eigen::Vector3d t(10., -20., 3.);
  for (const Alignment mode : {Alignment::kStart, Alignment::kYawPosition, Alignment::kSe3}) {
    for (int i = 0; i < 20; ++i) {
      const Eigen::Quaterniond q =
          mode == Alignment::kYawPosition ? about_z(-3.1 + 0.3 * i) : random_rotation(random);
      const Association common = associate(moved(estimate, q, t), estimate, kGap_s);
      const RigidTransform T_EtoR = align(common.pairs, mode);
      EXPECT_LT(T_EtoR.q_EtoR.angularDistance(q), 1e-7) << name(mode);
      EXPECT_LT((T_EtoR.p_EinR - t).norm(), 1e-11) << name(mode);
    }
  }
}

TEST(Alignment, NoneLeavesTheEstimateAlone) {
  const Trajectory estimate = arc(0.1, 1., 5);
  const Association common =
      associate(moved(estimate, about_z(1.), {1., 2., 3.}), estimate, kGap_s);
  const RigidTransform T_EtoR = align(common.pairs, Alignment::kNone);
  EXPECT_EQ(T_EtoR.q_EtoR.coeffs(), Eigen::Quaterniond::Identity().coeffs());
  EXPECT_EQ(T_EtoR.p_EinR, Eigen::Vector3d::Zero());
}

/// Neither of the closed forms is beaten by any of many transforms near to or far from it.
void expect_unbeaten(const Association& common, Alignment mode, std::mt19937_64& random) {
  const RigidTransform best = align(common.pairs, mode);
  EXPECT_NEAR(best.q_EtoR.norm(), 1., 1e-12);
  const double best_cost = cost(common, best);
  std::normal_distribution<double> gauss;
  for (int i = 0; i < 3000; ++i) {
    const double size = std::pow(10., -(i % 6));
    RigidTransform other = best;
    Eigen::Vector3d axis = random_point(random).normalized();
    if (mode == Alignment::kYawPosition) axis = Eigen::Vector3d::UnitZ();
    const Eigen::Quaterniond step(Eigen::AngleAxisd(size * gauss(random), axis));
    other.q_EtoR = step * other.q_EtoR;
    // The translation that is best for this rotation, so that the rotation decides.
    other.p_EinR.setZero();
    Eigen::Vector3d mean_error = Eigen::Vector3d::Zero();
    for (const PosePair& pair : common.pairs) {
      mean_error += (other * pair.estimate).p_BinW - pair.reference.p_BinW;
    }
    other.p_EinR = -mean_error / static_cast<double>(common.pairs.size());
    if (i % 2 == 1) other.p_EinR += size * random_point(random);
    ASSERT_GE(cost(common, other), best_cost * (1. - 1e-12)) << name(mode) << " size " << size;
  }
}

TEST(Alignment, OfNoisyDataIsTheLeastSquaresOptimum) {
  std::mt19937_64 random(12);
  Trajectory reference = random_trajectory(40, random);
  Trajectory estimate = moved(reference, random_rotation(random), {1., 2., 3.});
  for (StampedPose& pose : estimate) pose.p_BinW += 0.3 * random_point(random);
  const Association common = associate(reference, estimate, kGap_s);
  expect_unbeaten(common, Alignment::kSe3, random);
  expect_unbeaten(common, Alignment::kYawPosition, random);
}

TEST(Alignment, OfAMirroredEstimateIsStillAProperRotation) {
  std::mt19937_64 random(13);
  const Trajectory reference = random_trajectory(40, random);
  Trajectory estimate = reference;
  for (StampedPose& pose : estimate) pose.p_BinW.z() *= -1.;
  const Association common = associate(reference, estimate, kGap_s);
  expect_unbeaten(common, Alignment::kSe3, random);
}

TEST(Alignment, OfARobotThatStandsTakesTheYawFromTheOrientations) {
  std::mt19937_64 random(14);
  Trajectory reference;
  for (int i = 0; i < 50; ++i) {
    reference.push_back(
        {i * std::int64_t{100'000'000}, 0.002 * random_point(random), about_z(0.7)});
  }
  Trajectory estimate = moved(reference, about_z(-2.), {5., 5., 0.});
  for (StampedPose& pose : estimate) pose.p_BinW += 0.002 * random_point(random);
  const Association common = associate(reference, estimate, kGap_s);
  const RigidTransform T_EtoR = align(common.pairs, Alignment::kYawPosition);
  EXPECT_LT(T_EtoR.q_EtoR.angularDistance(about_z(2.)), 1e-7);
}

TEST(Alignment, InSixDegreesRefusesAStraightLine) {
  const Trajectory reference = moved(arc(0., 0.1, 50), about_z(0.3), {1., 1., 0.});
  const Association common = associate(reference, arc(0., 0.1, 50), kGap_s);
  EXPECT_EQ(error_of([&] { align(common.pairs, Alignment::kSe3); }),
            "alignment 'se3' is not determined: all positions are in one point or on one line; use "
            "'yaw_position' or 'start'");
  EXPECT_LT(align(common.pairs, Alignment::kYawPosition).q_EtoR.angularDistance(about_z(0.3)),
            1e-7);
}

}  // namespace
}  // namespace viwo::eval
