// Which results are not to be trusted, and what is suspicious.
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "viwo/run/warnings.hpp"

namespace viwo {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

TEST(Doubts, AreOfAnEstimateThatIsWorseThanNone) {
  RunResult result;
  result.status = RunStatus::kOk;
  for (int i = 0; i < 100; ++i) {
    const double angle = 0.1 * i;
    result.reference.push_back({i, {std::cos(angle), std::sin(angle), 0.}});
  }
  // Good on short segments, of the time before it was lost.
  result.accuracy.emplace();
  result.accuracy->rpe = {{.length_m = 0.5, .count = 100, .mean_m = 0.01}};
  result.accuracy->path_length_m = 10.;
  const auto doubts = [&result](double ate_m) {
    result.doubts.clear();
    result.accuracy->ate_m = ate_m;
    doubt(result);
    return result.doubts;
  };
  EXPECT_THAT(doubts(1.2), ElementsAre(HasSubstr("off by 1.2 m, root mean square")));
  EXPECT_THAT(doubts(0.9), ElementsAre());
  // A tenth of a long way in a small room is no contradiction.
  result.accuracy->path_length_m = 100.;
  EXPECT_THAT(doubts(1.2), ElementsAre());
}

// Segments that turn are off by less than their length, and both stay near their middles.
TEST(Doubts, AreOfAReferenceInOtherUnits) {
  const auto doubts = [](double scale, std::int64_t first, std::int64_t gap = 0) {
    RunResult result;
    result.status = RunStatus::kOk;
    for (std::int64_t i = 0; i < 100; ++i) {
      const double angle = 0.1 * static_cast<double>(i), size = i < first ? 100. : scale;
      const bool is_in_gap = i > 2 && i < gap;
      if (!is_in_gap) {
        result.reference.push_back(
            {100'000'000 * i, {size * std::cos(angle), size * std::sin(angle), 0.}});
      }
      if (i < first) continue;
      result.estimate.push_back({100'000'000 * i, {std::cos(angle), std::sin(angle), 0.}});
    }
    result.accuracy.emplace();
    result.accuracy->rpe = {{.length_m = 0.5, .count = 100, .mean_m = 0.2}};
    result.accuracy->path_length_m = 10.;
    doubt(result);
    return result.doubts;
  };
  EXPECT_THAT(doubts(1000., 0), ElementsAre(HasSubstr("it goes 981 m from its middle")));
  EXPECT_THAT(doubts(2., 0), ElementsAre());
  // What it does before there is an estimate is not compared.
  EXPECT_THAT(doubts(1., 20), ElementsAre());
  EXPECT_THAT(doubts(1., 0, 97), ElementsAre());
}

TEST(Doubts, AreOfAnEstimateThatTheFilterItselfHardlyKnows) {
  RunResult result;
  result.status = RunStatus::kOk;
  result.updates.resize(1);
  result.updates[0].total.applied = 100;
  for (int i = 0; i <= 10; ++i) result.estimate.push_back({i, {0.1 * i, 0., 0.}});
  const auto doubts = [&result](double grown_m, const WheelsWay& wheels_way = {}) {
    result.doubts.clear();
    result.end_sigma.grown_m = grown_m;
    doubt(result, wheels_way);
    return result.doubts;
  };
  EXPECT_THAT(doubts(0.4), ElementsAre(HasSubstr("to 0.4 m only, of a way of 1 m")));
  EXPECT_THAT(doubts(0.25), ElementsAre());
  for (StampedPose& pose : result.estimate) pose.p_BinW *= 100.;
  EXPECT_THAT(doubts(10.), ElementsAre());
  // One that has run away has gone far: the wheels say how far it was, if they were there.
  result.duration_s = 10.;
  EXPECT_THAT(doubts(10., {10., 2.}), ElementsAre(HasSubstr("to 10 m only, of a way of 2 m")));
  EXPECT_THAT(doubts(10., {5., 2.}), ElementsAre());
  // What is not known better after ten minutes at rest.
  EXPECT_THAT(doubts(0.6, {10., 2.}), ElementsAre(HasSubstr("to 0.6 m only")));
  result.duration_s = 600.;
  EXPECT_THAT(doubts(0.6, {600., 2.}), ElementsAre());
  result.accuracy.emplace();
  result.accuracy->path_length_m = 3.;
  EXPECT_THAT(doubts(10.), ElementsAre(HasSubstr("to 10 m only, of a way of 3 m")));
  result.accuracy.reset();
  result.estimate.resize(1);  // who stands, and knows it
  EXPECT_THAT(doubts(0.05), ElementsAre());
}

TEST(Doubts, AreOfAFilterThatEndsFarOffAndIsNoBetterOnTheWay) {
  RunResult result;
  result.status = RunStatus::kOk;
  for (int i = 0; i < 100; ++i) result.reference.push_back({i, {10. * i, 0., 0.}});
  result.accuracy.emplace();
  result.accuracy->path_length_m = 1000.;
  const auto doubts = [&result](double part, double end_m, bool is_filter) {
    result.doubts.clear();
    result.accuracy->rpe = {{.length_m = 100., .count = 100, .mean_m = 100. * part},
                            {.length_m = 250., .count = 50, .mean_m = 250. * part}};
    result.accuracy->end_m = end_m;
    result.updates.resize(is_filter ? 1 : 0);
    doubt(result);
    return result.doubts;
  };
  EXPECT_THAT(doubts(0.13, 150., true), ElementsAre(HasSubstr("after 1000 m it is off by 150 m")));
  // Lost at the end, or on the way, or by slip that nothing but wheels measures.
  EXPECT_THAT(doubts(0.05, 150., true), ElementsAre());
  EXPECT_THAT(doubts(0.13, 60., true), ElementsAre());
  EXPECT_THAT(doubts(0.13, 150., false), ElementsAre());
}

TEST(Suspicions, AreOfAPartAndHaveTimesSinceTheStartOfTheRun) {
  const auto place = [](const std::string& first) {
    const RejectionCount count{"what", 30, first, 100};
    const std::string line = suspicions({&count, 1}, {}, 1'400'000'000'500'000'000).at(0);
    return line.substr(0, line.find(": check"));
  };
  EXPECT_EQ(place("stamp 1400000003000000000 ns"), "what - 30 of 100, t = 2.500 s");
  EXPECT_EQ(place("t = 1400000003.000 s .. t = 1400000010.125 s"),
            "what - 30 of 100, t = 2.500 s .. t = 9.625 s");
  EXPECT_EQ(place("t = 0.25"), "what - 30 of 100, t = -1400000000.250 s");
  EXPECT_EQ(place("data.csv:17"), "what - 30 of 100, data.csv:17");
  const std::vector<RejectionCount> counts = {
      {"some", 30, "", 60}, {"all", 30, "t = 1", 30}, {"few", 19, "", 19}, {"unsaid", 30, "", 0}};
  EXPECT_THAT(refused_altogether(counts, 0), ElementsAre(HasSubstr("all - 30 of 30, t = 1")));
  EXPECT_THAT(suspicions(counts, {}, 0), ElementsAre(HasSubstr("some - 30 of 60")));
}

}  // namespace
}  // namespace viwo
