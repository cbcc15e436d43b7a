// Channels that the others contradict over a recording: for long, often, across holes of the log.
#include <cmath>
#include <memory>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "viwo/math/stamp.hpp"
#include "viwo/wheel/contradicted_channels.hpp"
#include "wheel_fixture.hpp"

namespace viwo {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;
using testing::load_model;
using testing::sample_motion;

Twist eight(double t) { return {0.6, 0.1 * std::sin(t), 0.8 * std::sin(0.7 * t)}; }

class ContradictedChannels : public ::testing::Test {
 protected:
  std::vector<ContradictedChannel> found() const {
    const int n = model_->n_intrinsics();
    return contradicted_channels(samples_, model_, model_->nominal(), IntrinsicMatrix::Zero(n, n));
  }
  std::int64_t begin_ns() const { return samples_.front().begin_ns; }

  std::shared_ptr<const WheelModel> model_ = load_model(testing::swerve("four_wis_wid"));
  std::vector<EncoderSample> samples_ = sample_motion(*model_, eight, 20., 50.);
};

TEST_F(ContradictedChannels, AreNoneOfWheelsThatAgree) { EXPECT_THAT(found(), IsEmpty()); }

TEST_F(ContradictedChannels, AreToldWithTheirLongestTime) {
  for (EncoderSample& sample : samples_) {
    const double t_s = seconds_between(begin_ns(), sample.t_ns);
    if (t_s > 5. && t_s < 7.) sample.drive_rad_per_s[1] = 0.;
  }
  ASSERT_EQ(found().size(), 1u);
  const ContradictedChannel channel = found().front();
  EXPECT_EQ(channel.name, "drive_2");
  EXPECT_NEAR(channel.longest_s, 2., 0.05);
  EXPECT_NEAR(channel.share, 0.1, 0.01);
  EXPECT_THAT(text_of(channel, begin_ns()), HasSubstr("from t = 5.0"));
}

TEST_F(ContradictedChannels, AreToldWhereEveryOtherReadingIsWrong) {
  for (std::size_t i = 0; i < samples_.size(); i += 2) samples_[i].drive_rad_per_s[1] = 0.;
  ASSERT_EQ(found().size(), 1u);
  EXPECT_NEAR(found().front().share, 0.5, 0.02);
  EXPECT_LT(found().front().longest_s, 0.1);
  EXPECT_GE(found().front().from_ns, begin_ns());
}

/// One reading before a hole of three seconds and one after it are not three seconds.
TEST_F(ContradictedChannels, DoNotLastAcrossAHole) {
  std::vector<EncoderSample> with_hole;
  for (EncoderSample sample : samples_) {
    const double t_s = seconds_between(begin_ns(), sample.t_ns);
    if (t_s > 10. && t_s < 13.) continue;
    if (t_s > 9.98 && t_s < 13.02) sample.drive_rad_per_s[1] = 0.;
    with_hole.push_back(sample);
  }
  samples_ = with_hole;
  EXPECT_THAT(found(), IsEmpty());
}

}  // namespace
}  // namespace viwo
