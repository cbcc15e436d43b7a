// Rooms: where blocks stand, what follows from the seed, and motions that do not fit.
#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include "message_of.hpp"
#include "some_room.hpp"

namespace viwo::rendering {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

TEST(TexturedRoom, BlocksStandClearOfThePathInsideTheRoomAndFollowFromTheSeed) {
  const RoomOptions options = some_options();
  const auto path = some_path();
  const TexturedRoom room = make_room(options, path);
  EXPECT_EQ(room.blocks.size(), 40U);
  int near = 0;
  for (const Block& block : room.blocks) {
    const Vector3d centre = block.centre.cast<double>(), half = block.half.cast<double>();
    const double yaw =
        std::atan2(static_cast<double>(block.sine), static_cast<double>(block.cosine));
    double nearest = 1e9;
    for (const Vector3d& p : path) {
      const Vector2d in_block =
          Eigen::Rotation2Dd(-yaw).toRotationMatrix() * (p - centre).head<2>();
      const Vector2d outside = (in_block.cwiseAbs() - half.head<2>()).cwiseMax(0.);
      nearest = std::min(nearest, outside.norm());
    }
    EXPECT_GE(nearest, options.clearance_m - 1e-6);
    EXPECT_LE(nearest, options.reach_m);
    near += nearest < 1.5 ? 1 : 0;
    for (const int sx : {-1, 1}) {
      for (const int sy : {-1, 1}) {
        const Vector2d corner = centre.head<2>() + Eigen::Rotation2Dd(yaw).toRotationMatrix() *
                                                       Vector2d(sx * half.x(), sy * half.y());
        EXPECT_LE((corner - options.centre_m).cwiseAbs().maxCoeff(), 4. + 1e-6);
      }
    }
    EXPECT_GE(centre.z() - half.z(), options.floor_m - 1e-6);
    EXPECT_LE(centre.z() + half.z(), options.floor_m + options.height_m + 1e-6);
  }
  EXPECT_GT(near, 5);
  const TexturedRoom again = make_room(options, path);
  RoomOptions other_options = options;
  other_options.seed = 2;
  const TexturedRoom other = make_room(other_options, path);
  for (std::size_t i = 0; i < room.blocks.size(); ++i) {
    EXPECT_EQ(room.blocks[i].centre, again.blocks[i].centre);
    EXPECT_NE(room.blocks[i].centre, other.blocks[i].centre);
  }
}

TEST(TexturedRoom, RefusesAMotionThatLeavesItAndSaysHowLargeItMustBe) {
  const std::vector<Vector3d> path{{0., 0., 0.2}, {3.95, 1., 0.2}};
  const auto refusal = [&](const RoomOptions& options) {
    return testing::error_of([&] { make_room(options, path); });
  };
  RoomOptions options;
  options.texture_size = 8;
  EXPECT_EQ(refusal(options),
            "the cameras leave the room or come closer than 0.1 m to it: along x they move from 0 "
            "to 3.95 m, the room reaches from -4 to 4 m");
  options.size_m.x() = 10.;
  EXPECT_EQ(refusal(options), "");
  options.floor_m = 0.15;
  EXPECT_EQ(refusal(options),
            "the cameras leave the room or come closer than 0.1 m to it: along z they move from "
            "0.2 to 0.2 m, the room reaches from 0.15 to 3.15 m");
}

}  // namespace
}  // namespace viwo::rendering
