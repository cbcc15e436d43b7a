// Sensors that are read while others work.
#include <atomic>
#include <chrono>
#include <memory>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "stream.hpp"
#include "viwo/api/status.hpp"

namespace viwo {
namespace {

/// Gives `n` tracked images, then ends, or throws.
class Counting final : public Sensor {
 public:
  explicit Counting(int n, bool throws = false) : n_(n), throws_(throws) {}
  SampleTypes yields() const override { return sample_types<FeatureSample>(); }
  Status next(Measurement& out) override {
    if (given_ == n_ && throws_) throw InputError("broken beyond single data");
    if (given_ == n_) return Status::kEnd;
    FeatureSample image;
    image.t_ns = given_ / 2;  // two cameras
    image.camera = given_ % 2;
    ++given_;
    out = image;
    return Status::kOk;
  }
  void rejections(std::vector<RejectionCount>& out) const override {
    out.push_back({"a reason", given_, "somewhere"});
  }
  int given() const { return given_; }

 private:
  int n_;
  bool throws_;
  std::atomic<int> given_ = 0;
};

SensorStream stream_of(std::shared_ptr<Sensor> sensor) {
  SensorStream stream;
  stream.name = "tracks";
  stream.sensor = std::move(sensor);
  return stream;
}

TEST(Prefetch, GivesAllInOrderThenEnds) {
  Prefetch stream(stream_of(std::make_shared<Counting>(1000)));
  for (int i = 0; i < 1000; ++i) {
    const Measurement* head = stream.head();
    ASSERT_NE(head, nullptr);
    EXPECT_EQ(head, stream.head()) << "a head stays until pop()";
    EXPECT_EQ(stamp_ns(*head), i / 2);
    stream.pop();
  }
  EXPECT_EQ(stream.head(), nullptr);
  EXPECT_EQ(stream.head(), nullptr);
  stream.stop();
  EXPECT_EQ(stream.ms_per_stamp().size(), 500U);
  ASSERT_EQ(stream.rejections().size(), 1U);
  EXPECT_EQ(stream.rejections()[0].count, 1000);
}

TEST(Prefetch, ReadsAFewAheadAndNotMore) {
  const auto sensor = std::make_shared<Counting>(1000);
  Prefetch stream(stream_of(sensor));
  for (int i = 0; i < 200 && sensor->given() < 17; ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  EXPECT_GT(sensor->given(), 1);
  EXPECT_LE(sensor->given(), 17);
  stream.stop();  // does not wait for the rest
  EXPECT_LE(sensor->given(), 18);
}

TEST(Prefetch, WhatTheSensorThrowsComesBehindWhatItGave) {
  Prefetch stream(stream_of(std::make_shared<Counting>(3, true)));
  for (int i = 0; i < 3; ++i) {
    ASSERT_NE(stream.head(), nullptr);
    stream.pop();
  }
  EXPECT_THROW(stream.head(), InputError);
  EXPECT_EQ(stream.head(), nullptr);
}

TEST(Replay, PlaysWhatIsInMemory) {
  auto measurements = std::make_shared<std::vector<Measurement>>();
  measurements->push_back(ImuSample{.t_ns = 5});
  measurements->push_back(StateSample{.t_ns = 6});
  Replay replay(measurements);
  Measurement out;
  ASSERT_EQ(replay.next(out), Status::kOk);
  EXPECT_EQ(stamp_ns(out), 5);
  ASSERT_EQ(replay.next(out), Status::kOk);
  EXPECT_NE(out.get_if<StateSample>(), nullptr);
  EXPECT_EQ(replay.next(out), Status::kEnd);
  EXPECT_EQ(replay.next(out), Status::kEnd);
}

}  // namespace
}  // namespace viwo
