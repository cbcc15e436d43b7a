// The queue between receiving and taking, and the order of the images of several cameras.
#include <chrono>
#include <string>
#include <thread>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "live_queue.hpp"
#include "rejections.hpp"

namespace viwo::live {
namespace {

using namespace std::chrono_literals;
using ::testing::ElementsAre;
using testing::rejections_of;
using Taken = LiveQueue::Taken;

constexpr std::int64_t kMs = 1'000'000;

/// What an ImageOrder gives for images of a camera at a time in ms, "camera@time", as text; "!" for
/// one that it drops.
std::string ordered(ImageOrder& order, const std::vector<std::pair<int, std::int64_t>>& images) {
  std::string text;
  for (const auto& [camera, t_ms] : images) {
    std::vector<ImageSample> out;
    if (!order.add({t_ms * kMs, camera, nullptr}, out)) text += "! ";
    for (const ImageSample& image : out) {
      text += std::to_string(image.camera) + "@" + std::to_string(image.t_ns / kMs) + " ";
    }
  }
  return text;
}

TEST(ImageOrder, PassesTheImagesOfOneCameraOnAtOnce) {
  ImageOrder order(1);
  EXPECT_EQ(ordered(order, {{0, 10}}), "0@10 ");
  EXPECT_EQ(ordered(order, {{0, 20}}), "0@20 ");
}

TEST(ImageOrder, BringsPairsTogetherWhicheverComesFirst) {
  ImageOrder order(2);
  EXPECT_EQ(ordered(order, {{0, 10}}), "");
  EXPECT_EQ(ordered(order, {{1, 10}}), "0@10 1@10 ");
  EXPECT_EQ(ordered(order, {{1, 20}, {1, 30}}), "");
  EXPECT_EQ(ordered(order, {{0, 20}}), "0@20 1@20 ");
  EXPECT_EQ(ordered(order, {{0, 30}}), "0@30 1@30 ");
}

TEST(ImageOrder, LetsAnImageGoWhosePartnerIsLost) {
  ImageOrder order(2);
  EXPECT_EQ(ordered(order, {{0, 10}, {0, 20}}), "");
  EXPECT_EQ(ordered(order, {{1, 20}}), "0@10 0@20 1@20 ");
}

TEST(ImageOrder, MergesCamerasThatAreNotSynchronised) {
  ImageOrder order(2);
  EXPECT_EQ(ordered(order, {{0, 10}, {1, 15}, {0, 20}, {1, 25}, {0, 30}}), "0@10 1@15 0@20 1@25 ");
}

TEST(ImageOrder, KnowsPairsWhoseStampsDifferALittle) {
  ImageOrder order(2);
  EXPECT_EQ(ordered(order, {{0, 100}, {1, 102}}), "0@100 1@102 ") << "both, at once";
  EXPECT_EQ(ordered(order, {{1, 202}}), "");
  EXPECT_EQ(ordered(order, {{0, 200}}), "0@200 1@202 ");
  EXPECT_EQ(ordered(order, {{0, 300}, {1, 304}}), "0@300 ") << "further apart: not a pair";
}

TEST(ImageOrder, DoesNotWaitForACameraThatIsSilentUntilItComesBack) {
  ImageOrder order(2);
  EXPECT_EQ(ordered(order, {{0, 10}, {0, 20}, {0, 30}}), "");
  EXPECT_EQ(ordered(order, {{0, 40}}), "0@10 0@20 0@30 0@40 ");
  EXPECT_EQ(ordered(order, {{0, 50}}), "0@50 ");
  EXPECT_EQ(ordered(order, {{1, 45}}), "! ") << "later ones are gone";
  EXPECT_EQ(ordered(order, {{0, 60}}), "") << "the other camera is there again";
  EXPECT_EQ(ordered(order, {{1, 60}}), "0@60 1@60 ");
}

ImuSample imu(std::int64_t t_ns) {
  ImuSample sample;
  sample.t_ns = t_ns;
  return sample;
}

TEST(LiveQueue, GivesWhatCameInItsOrderAndThenTheEnd) {
  LiveQueue queue(2);
  queue.push(imu(1));
  queue.push(ImageSample{2, 0, nullptr});
  queue.end();
  queue.push(imu(3));  // too late
  Measurement out;
  ASSERT_EQ(queue.pop(out, 0ms), Taken::kMeasurement);
  EXPECT_EQ(stamp_ns(out), 1);
  ASSERT_EQ(queue.pop(out, 0ms), Taken::kMeasurement);
  EXPECT_EQ(stamp_ns(out), 2);
  EXPECT_EQ(queue.pop(out, 0ms), Taken::kEnded);
  EXPECT_THAT(rejections_of(queue), ElementsAre());
}

TEST(LiveQueue, DropsTheOldestImagesWhenItIsFullAndNothingElse) {
  LiveQueue queue(4);
  for (const std::int64_t t : {10, 20, 30}) {
    for (int k = 0; k < 100; ++k) queue.push(imu(t * kMs));
    queue.push(ImageSample{t * kMs, 0, nullptr});
    queue.push(ImageSample{(t + 1) * kMs, 1, nullptr});
  }
  queue.end();
  int n_imu = 0;
  std::string images;
  Measurement out;
  while (queue.pop(out, 0ms) == Taken::kMeasurement) {
    if (const auto* image = out.get_if<ImageSample>()) {
      images += std::to_string(image->camera) + "@" + std::to_string(image->t_ns / kMs) + " ";
    } else {
      ++n_imu;
    }
  }
  EXPECT_EQ(n_imu, 300);
  EXPECT_EQ(images, "0@20 1@21 0@30 1@31 ");
  EXPECT_THAT(
      rejections_of(queue),
      ElementsAre("image dropped: images come faster than they are taken | 2 | stamp 10000000 ns"));
}

TEST(LiveQueue, DropsTheOldestOfAllElseWhenHardlyAnythingIsTaken) {
  LiveQueue queue(2, 3);
  queue.push(ImageSample{0, 0, nullptr});
  for (std::int64_t t = 1; t <= 5; ++t) queue.push(imu(t));
  std::vector<std::int64_t> taken;
  Measurement out;
  while (queue.pop(out, 0ms) == Taken::kMeasurement) taken.push_back(stamp_ns(out));
  EXPECT_EQ(taken, (std::vector<std::int64_t>{0, 3, 4, 5}));
  EXPECT_THAT(rejections_of(queue),
              ElementsAre("measurement dropped: they come faster than they are taken | 2 | stamp "
                          "1 ns"));
}

TEST(LiveQueue, HasRoomAgainForImagesThatWereTaken) {
  LiveQueue queue(2);
  Measurement out;
  for (std::int64_t t = 1; t <= 10; ++t) {
    queue.push(ImageSample{t * kMs, 0, nullptr});
    ASSERT_EQ(queue.pop(out, 0ms), Taken::kMeasurement);
    EXPECT_EQ(stamp_ns(out), t * kMs);
  }
  EXPECT_THAT(rejections_of(queue), ElementsAre());
}

TEST(LiveQueue, WakesWhoWaitsAtTheEnd) {
  LiveQueue queue(2);
  std::thread ender([&queue] {
    std::this_thread::sleep_for(50ms);
    queue.end();
  });
  Measurement out;
  const auto begin = std::chrono::steady_clock::now();
  EXPECT_EQ(queue.pop(out, 20s), Taken::kEnded);
  EXPECT_LT(std::chrono::steady_clock::now() - begin, 10s);
  ender.join();
  LiveQueue empty(2);
  EXPECT_EQ(empty.pop(out, 1ms), Taken::kNothing);
}

}  // namespace
}  // namespace viwo::live
