// When the ROS master goes away under a sensor that waits. A program of its own: a process cannot
// join another master later.
#include <chrono>
#include <thread>

#include <gtest/gtest.h>

#include "ros_system.hpp"
#include "sensor_under_test.hpp"

namespace viwo {
namespace {

using namespace std::chrono_literals;
using std::chrono::steady_clock;

class Ros1Master : public testing::LiveTest {};

TEST_F(Ros1Master, GoneWhileNothingComesEndsTheSensorAndIsSaid) {
  const auto sensor = testing::make_ros1_topics(", imu_topic: /imu0");
  const std::string uri = ros_->uri();
  std::thread killer([] {
    std::this_thread::sleep_for(500ms);
    ros_->kill_master();
  });
  const auto begin = steady_clock::now();
  Measurement out;
  EXPECT_EQ(sensor->next(out), Status::kEnd);
  killer.join();
  EXPECT_LT(steady_clock::now() - begin, 15s);
  EXPECT_TRUE(testing::said().has("the ROS master at " + uri +
                                  " is gone and nothing comes: no further measurements"))
      << testing::said().all();
}

}  // namespace
}  // namespace viwo
