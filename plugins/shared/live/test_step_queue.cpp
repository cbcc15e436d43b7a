// What is played in step: the order of a bag, room, and cells of a log.
#include <chrono>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "live_cells.hpp"
#include "step_queue.hpp"

namespace viwo::live {
namespace {

using namespace std::chrono_literals;
using Taken = MeasurementQueue::Taken;

bag::TopicOptions topics() {
  bag::TopicOptions options;
  options.imu_topic = "/imu";
  options.pose_topic = "/pose";
  options.image_topics = {"/cam0", "/cam1"};
  return options;
}
constexpr std::size_t kImu = 0, kPose = 1, kCam0 = 2, kCam1 = 3;

ImuSample imu_at(std::int64_t t_ns) {
  ImuSample sample;
  sample.t_ns = t_ns;
  return sample;
}
PoseSample pose_at(std::int64_t t_ns) {
  PoseSample sample;
  sample.t_ns = t_ns;
  return sample;
}

/// All that can be taken: "i5 c1@7", then what the queue says.
std::string taken(StepQueue& queue) {
  std::string text;
  Measurement out;
  while (true) {
    switch (queue.pop(out, 0ms)) {
      case Taken::kNothing:
        return text + "waits";
      case Taken::kEnded:
        return text + "ended";
      case Taken::kMeasurement:
        break;
    }
    if (const auto* image = out.get_if<ImageSample>()) {
      text += "c" + std::to_string(image->camera) + "@";
    } else {
      text += out.get_if<ImuSample>() != nullptr ? "i" : "p";
    }
    text += std::to_string(stamp_ns(out)) + " ";
  }
}

TEST(StepQueue, GivesTheOrderOfABagWhateverCameFirst) {
  StepQueue queue(wanted_topics(topics()), 4);
  queue.push(ImageSample{5, 1, nullptr}, kCam1);
  queue.push(imu_at(4), kImu);
  queue.push(imu_at(5), kImu);
  EXPECT_EQ(taken(queue), "waits");
  queue.push(pose_at(5), kPose);
  queue.push(ImageSample{5, 0, nullptr}, kCam0);
  EXPECT_EQ(taken(queue), "i4 p5 waits") << "a pose may come that is of 5, too";
  queue.push(pose_at(9), kPose);
  EXPECT_EQ(taken(queue), "i5 waits");
  queue.finish(kImu);
  EXPECT_EQ(taken(queue), "c0@5 waits");
  queue.finish(kCam0);
  EXPECT_EQ(taken(queue), "c1@5 waits");
  queue.finish(kCam1);
  EXPECT_EQ(taken(queue), "p9 waits");
  queue.finish(kPose);
  EXPECT_EQ(taken(queue), "ended");
}

TEST(StepQueue, GivesWhatIsThereWhenItIsEnded) {
  StepQueue queue(wanted_topics(topics()), 4);
  queue.push(imu_at(4), kImu);
  queue.end();
  queue.push(imu_at(5), kImu);
  EXPECT_EQ(taken(queue), "i4 ended");
}

TEST(StepQueue, HasRoomAsFarAsNothingWaits) {
  StepQueue queue(wanted_topics(topics()), 2);
  for (std::int64_t t = 1; t <= 39; ++t) queue.push(ImageSample{t, 0, nullptr}, kCam0);
  EXPECT_TRUE(queue.has_room(kCam0)) << "others are waited for";
  EXPECT_EQ(queue.deadlock(), "");
  queue.push(ImageSample{40, 0, nullptr}, kCam0);
  EXPECT_FALSE(queue.has_room(kCam0));
  EXPECT_EQ(queue.deadlock(), "topic '/cam0' waits for '/imu'");
  queue.push(imu_at(1), kImu);
  queue.finish(kPose);
  queue.finish(kCam1);
  EXPECT_EQ(queue.deadlock(), "");
  EXPECT_FALSE(queue.has_room(kCam0)) << "two images can be given, and wait";
  EXPECT_TRUE(queue.has_room(kImu));
}

TEST(StepQueue, HasRoomForOneWhereImagesFillTheMemory) {
  StepQueue queue(wanted_topics(topics()), 2);
  EXPECT_TRUE(queue.has_room(kCam0, true)) << "another may wait for it";
  queue.push(ImageSample{1, 0, nullptr}, kCam0);
  EXPECT_FALSE(queue.has_room(kCam0, true));
  EXPECT_TRUE(queue.has_room(kCam0));
}

log::EncoderReading reading(std::int64_t t_ms, double drive) {
  log::EncoderReading reading;
  reading.t_ns = 1'000'000 * t_ms;
  reading.n_drive = reading.n_steer = 1;
  reading.drive[0] = drive;
  reading.steer_rad[0] = 0.1 * drive;
  return reading;
}

TEST(LogCells, AreThoseOfALogOfTheSameReadingsToTheBit) {
  for (const bool is_angle : {false, true}) {
    std::vector<log::EncoderReading> readings;
    std::int64_t t_ms = 100;
    for (int k = 0; k < 50; ++k) {
      t_ms += 9 + k % 3;  // the usual spacing, 10 ms, is also that before the gap
      if (k == 26) t_ms += 400;
      readings.push_back(reading(t_ms, 1. / (3. + k)));
      readings.back().is_start = k == 26;
    }
    const auto expected = log::samples_from(readings, is_angle, 0.2, 1);
    LogCells cells(is_angle, 0.2);
    std::vector<EncoderSample> found;
    for (const log::EncoderReading& one : readings) {
      if (const auto cell = cells.add(one)) found.push_back(*cell);
    }
    if (const auto cell = cells.finish()) found.push_back(*cell);
    ASSERT_EQ(found.size(), expected.size()) << is_angle;
    for (std::size_t i = 0; i < found.size(); ++i) {
      EXPECT_EQ(found[i].t_ns, expected[i].t_ns) << is_angle << " " << i;
      EXPECT_EQ(found[i].begin_ns, expected[i].begin_ns) << is_angle << " " << i;
      EXPECT_EQ(found[i].end_ns, expected[i].end_ns) << is_angle << " " << i;
      EXPECT_EQ(found[i].drive_rad_per_s[0], expected[i].drive_rad_per_s[0]);
      EXPECT_EQ(found[i].steer_rad[0], expected[i].steer_rad[0]);
    }
  }
}

}  // namespace
}  // namespace viwo::live
