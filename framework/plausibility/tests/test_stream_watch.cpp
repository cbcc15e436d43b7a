// Streams of samples with gaps, ends, hold-ups and stamps of other clocks.
#include <algorithm>
#include <cstdint>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "stream_watch.hpp"
#include "viwo/api/stamp_order.hpp"
#include "viwo/math/time_text.hpp"

namespace viwo {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

constexpr std::int64_t kMs = 1'000'000;
constexpr std::int64_t kStart = 1'400'000'000'000 * kMs;  // as stamps of real logs are
const std::string kCause = ": look at its cable, driver, bus and clock, or at what has recorded it";

/// An IMU that gives a sample every 5 ms, in a run in which others go on.
struct Bench {
  StreamWatch watch{"imu0", 0.2};
  std::int64_t now_ms = 0;

  void give(std::int64_t t_ms, int channel = 0) {
    now_ms = std::max(now_ms, t_ms);
    watch.add(kStart + t_ms * kMs, channel, kStart + now_ms * kMs);
  }
  void give(std::int64_t from_ms, std::int64_t to_ms, std::int64_t step_ms) {
    for (std::int64_t t = from_ms; t < to_ms; t += step_ms) give(t);
  }
  std::vector<std::string> at(std::int64_t t_ms) const {
    Findings found;
    watch.findings(kStart + t_ms * kMs, kStart, found);
    return texts(found);
  }
  std::vector<std::string> at_end(std::int64_t t_ms) const {
    Findings found;
    watch.findings(kStart + t_ms * kMs, kStart, "recording", found);
    return texts(found);
  }
  static std::vector<std::string> texts(const Findings& found) {
    std::vector<std::string> all;
    for (const Finding& finding : found) all.push_back(finding.text);
    return all;
  }
};

TEST(StreamWatch, HasNothingToSayOfAStreamThatGoesOn) {
  Bench bench;
  EXPECT_THAT(bench.at_end(0), IsEmpty());
  bench.give(0, 30'000, 5);
  EXPECT_THAT(bench.at(30'150), IsEmpty());
  EXPECT_THAT(bench.at_end(31'900), IsEmpty()) << "sensors are stopped one after the other";
}

TEST(StreamWatch, TellsAGapWhenItHappensWhenItIsOverAndAtTheEnd) {
  Bench bench;
  bench.give(0, 12'300, 5);
  EXPECT_THAT(bench.at(12'490), IsEmpty());
  EXPECT_THAT(bench.at(12'500), ElementsAre("imu0: no samples since t = 12.295 s: look at its "
                                            "cable, driver and bus"));
  bench.give(17'300, 20'000, 5);
  EXPECT_THAT(bench.at(20'000),
              ElementsAre("imu0: samples again, after 5 s without any from t = 12.295 s on"));
  EXPECT_THAT(bench.at_end(20'000),
              ElementsAre("imu0: no samples for 5 s from t = 12.295 s" + kCause));
}

TEST(StreamWatch, TellsHowManyGapsThereWere) {
  Bench bench;
  for (int i = 0; i < 20; ++i) bench.give(i * 1000, i * 1000 + (i == 7 ? 500 : 700), 5);
  EXPECT_THAT(bench.at_end(20'000),
              ElementsAre("imu0: no samples 19 times, 6 s in all, the longest for 0.51 s from "
                          "t = 7.495 s" +
                          kCause));
  EXPECT_THAT(bench.at(20'000), IsEmpty()) << "after ten of them one knows";
}

TEST(StreamWatch, TellsAnEarlyEnd) {
  Bench bench;
  bench.give(0, 24'000, 5);
  EXPECT_THAT(bench.at_end(30'195),
              ElementsAre("imu0: ended 6.2 s before the end of the recording (t = 23.995 s): look "
                          "at its cable and driver, or the log was cut"));
}

TEST(StreamWatch, DoesNotAskWhatIsWrittenOnChangeToGoOnAtRest) {
  Bench bench;
  bench.give(0, 20'000, 5);
  bench.watch.add(kStart + 20'000 * kMs, 0, kStart + 20'000 * kMs, true);
  EXPECT_THAT(bench.at_end(25'000), IsEmpty());
  EXPECT_THAT(bench.at_end(35'000), ::testing::SizeIs(1)) << "too long to know";
}

TEST(StreamWatch, JudgesByTheUsualPeriodWhateverTheOthersDo) {
  Bench slow;  // a gap of two seconds is two samples that were lost
  for (std::int64_t t = 0; t < 60'000; t += 500) {
    if (t < 20'000 || t > 22'000) slow.give(t);
  }
  EXPECT_THAT(slow.at_end(60'000), IsEmpty());
  Bench pair;  // of cameras
  for (std::int64_t t = 0; t < 10'000; t += 50) {
    if (t > 5000 && t < 5450) continue;
    pair.give(t, 0);
    pair.give(t + 1, 1);
  }
  EXPECT_THAT(pair.at_end(10'000), IsEmpty());
}

TEST(StreamWatch, TellsThatOneOfTwoCamerasHasEnded) {
  for (const std::int64_t apart_ms : {0, 1}) {
    Bench pair;
    for (std::int64_t t = 0; t < 20'000; t += 50) {
      pair.give(t, 0);
      if (t < 12'000) pair.give(t + apart_ms, 1);
    }
    const std::string since = time_text((11'950 + apart_ms) * kMs);
    const std::string text = "imu0: none of camera 1 since " + since +
                             ", others go on: look at its cable, driver and bus";
    EXPECT_THAT(pair.at(12'300), IsEmpty());
    EXPECT_THAT(pair.at(20'000), ElementsAre(text));
    EXPECT_THAT(pair.at_end(20'000), ElementsAre(text));
    pair.give(20'000, 1);
    EXPECT_THAT(pair.at_end(20'000), IsEmpty());
  }
}

TEST(StreamWatch, TellsThatNothingHasEverCome) {
  const Bench bench;
  EXPECT_THAT(bench.at(9'000), IsEmpty()) << "drivers take a while";
  EXPECT_THAT(
      bench.at(10'100),
      ElementsAre(
          "imu0: no samples: look at its cable, driver and bus, or at why all of it is rejected"));
  EXPECT_THAT(bench.at_end(1'000), IsEmpty());
  EXPECT_THAT(bench.at_end(12'000),
              ElementsAre("imu0: no samples in all of the recording: look "
                          "at its cable, driver and bus, or at why all of it is rejected"));
}

TEST(StreamWatch, NamesSamplesThatAreHeldUp) {
  Bench bench;
  for (int second = 0; second < 10; ++second) {
    const std::int64_t t = second * 1000;
    bench.give(t + 20, t + 900, 5);
    for (int i = 0; i < 20; ++i) bench.give(t + 1000 + i);
  }
  EXPECT_THAT(bench.at_end(10'020),
              ElementsAre("imu0: 9 times no samples for up to 0.11 s, then all of them at once: "
                          "they are held up by the driver or the bus, and stamped when they "
                          "arrive - stamp them when they are measured"));
  Bench lost;  // without what comes at once, samples are lost
  for (int second = 0; second < 10; ++second) {
    lost.give(second * 1000, second * 1000 + 900, 5);
  }
  EXPECT_THAT(lost.at_end(10'020), IsEmpty());
}

TEST(StreamWatch, IsNotDisturbedByOneStampFarAhead) {
  for (const std::int64_t ahead_ms : {2000, 3'600'000}) {
    Bench bench;
    bench.give(0, 10'000, 5);
    bench.watch.add(kStart + (10'000 + ahead_ms) * kMs, 0, kStart + 10'000 * kMs);
    bench.give(10'000, 20'000, 5);
    EXPECT_THAT(bench.at_end(20'000), IsEmpty()) << ahead_ms;
  }
  Bench broken;
  broken.give(0, 1000, 5);
  for (const std::int64_t stamp : {INT64_MAX, INT64_MIN}) broken.watch.add(stamp, 0, kStart);
  EXPECT_THAT(broken.at_end(1000), IsEmpty());
}

TEST(StreamWatch, DoesNotCountBeyondWhatAClockMayShow) {
  StreamWatch watch{"imu0", 0.2};
  std::int64_t now_ns = -kMaxStampNs;
  for (int i = 0; i < 200; ++i, now_ns += 5 * kMs) {
    watch.add(kMaxStampNs - kMs * (1000 - 5 * i), 0, now_ns);  // a clock 250 years ahead
  }
  for (int i = 0; i < 3; ++i) watch.add(-kMaxStampNs + kMs * 5 * i, 0, now_ns);
  Findings found;
  watch.findings(now_ns, -kMaxStampNs, "recording", found);
  EXPECT_THAT(Bench::texts(found), IsEmpty());
}

TEST(StreamWatch, FollowsAClockOfAnotherTimeAndOneThatIsSetBack) {
  Bench bench;
  bench.now_ms = 10'000;  // others are there
  const auto give = [&](std::int64_t from_ms, std::int64_t to_ms, std::int64_t off_ms) {
    for (bench.now_ms = from_ms; bench.now_ms < to_ms; bench.now_ms += 5) {
      bench.watch.add(kStart + (bench.now_ms + off_ms) * kMs, 0, kStart + bench.now_ms * kMs);
    }
  };
  give(10'000, 20'000, -3'000'000);
  give(20'000, 30'000, -3'100'000);
  EXPECT_THAT(bench.at_end(30'000), IsEmpty());
  EXPECT_THAT(bench.at(35'000), ElementsAre("imu0: no samples since t = 29.995 s: look at its "
                                            "cable, driver and bus"));
}

}  // namespace
}  // namespace viwo
