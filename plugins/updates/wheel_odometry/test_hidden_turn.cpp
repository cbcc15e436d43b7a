// The turn of O that rolling rows hide: where it is taken (WO-22).
#include <gtest/gtest.h>

#include "hidden_turn.hpp"
#include "wheel_fixture.hpp"

namespace viwo::wheel_odometry {
namespace {

TEST(HiddenTurn, GoesWithTheEstimateWhileWheelsAreLearnedAndThenStays) {
  const auto model = testing::load_model(testing::swerve("four_wis_wid_drive_only"));
  const Intrinsics nominal = model->nominal();
  Intrinsics moved = nominal;
  ASSERT_EQ(model->model().move_frame({0.05, 0.01, 0.}, moved), Status::kOk);
  HiddenTurn turn;
  const Intrinsics there = *turn.at(*model, nominal);
  for (int i = 0; i < 99; ++i) turn.add_turn();
  const Intrinsics elsewhere = *turn.at(*model, moved);
  EXPECT_GT((elsewhere - there).norm(), 0.01);
  turn.add_turn();
  EXPECT_EQ(*turn.at(*model, nominal), elsewhere);
}

TEST(HiddenTurn, IsNoneWhereTheModelHasNoOtherFrame) {
  const auto model = testing::load_model(
      "{type: differential, radius_left_m: 0.05, radius_right_m: 0.05, baseline_m: 0.4}");
  EXPECT_FALSE(HiddenTurn().at(*model, model->nominal()));
}

}  // namespace
}  // namespace viwo::wheel_odometry
