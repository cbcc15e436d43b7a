#include <gmock/gmock.h>

#include "trajectories.hpp"
#include "viwo/eval/hints.hpp"

namespace viwo::eval {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

/// As a reader of x y z w takes a file with w x y z.
Trajectory misread(Trajectory trajectory) {
  for (StampedPose& pose : trajectory) {
    const Eigen::Quaterniond q = pose.q_BtoW;
    pose.q_BtoW.coeffs() << q.w(), q.x(), q.y(), q.z();
  }
  return trajectory;
}

std::vector<std::string> hints_of(const Trajectory& reference, const Trajectory& estimate) {
  return hints(reference, estimate, {}, evaluate(reference, estimate));
}

TEST(Hints, NameTheFileThatHasTheOtherOrderOfQuaternions) {
  const Trajectory truth = arc(0.3, 0.1, 100);
  Trajectory estimate = truth;
  for (StampedPose& pose : estimate) pose.q_BtoW = pose.q_BtoW * about_z(0.02);
  EXPECT_THAT(
      hints_of(truth, misread(estimate)),
      ElementsAre(HasSubstr("by 1.15 deg where the quaternions of the estimate are w x y z")));
  EXPECT_THAT(
      hints_of(misread(truth), estimate),
      ElementsAre(HasSubstr("by 1.15 deg where the quaternions of the reference are w x y z")));
}

TEST(Hints, AreNoneWhereOrientationsAgreeOrNothingMakesThem) {
  std::mt19937_64 random(1);
  const Trajectory truth = random_trajectory(50, random);
  Trajectory unlike = truth;
  for (StampedPose& pose : unlike) pose.q_BtoW = random_rotation(random);
  EXPECT_THAT(hints_of(truth, truth), IsEmpty());
  EXPECT_THAT(hints_of(truth, unlike), IsEmpty());
}

TEST(Hints, AreOfAWorldWhoseZIsNotUp) {
  const Trajectory truth = arc(0.3, 0.1, 100);
  const Eigen::Quaterniond lying(Eigen::AngleAxisd(0.5 * M_PI, Eigen::Vector3d::UnitX()));
  Trajectory y_up = truth, off = truth;
  for (StampedPose& pose : y_up) {
    pose.p_BinW = lying * pose.p_BinW;
    pose.q_BtoW = lying * pose.q_BtoW;
  }
  EXPECT_THAT(hints_of(y_up, truth), ElementsAre(HasSubstr("the z of one of them is not up")));
  for (std::size_t i = 0; i < off.size(); ++i) off[i].p_BinW.x() *= 1.5;
  EXPECT_THAT(hints_of(truth, off), IsEmpty());
  Trajectory straight = arc(0., 0.1, 100), far = straight;  // which no tilt makes fit
  for (StampedPose& pose : far) pose.p_BinW *= 2.;
  EXPECT_THAT(hints_of(straight, far), IsEmpty());
}

TEST(Hints, AreOfOtherUnits) {
  const Trajectory truth = arc(0.3, 0.1, 100);
  Trajectory millimetres = truth;
  for (StampedPose& pose : millimetres) pose.p_BinW *= 1e3;
  EXPECT_THAT(hints_of(truth, millimetres), ElementsAre(HasSubstr("from its middle")));
  EXPECT_THAT(hints_of(millimetres, truth), ElementsAre(HasSubstr("another unit of one")));
}

}  // namespace
}  // namespace viwo::eval
