// What sensors gave, by sensor and kind.
#include <vector>

#include <gtest/gtest.h>

#include "has_next.hpp"
#include "viwo/feed/recorded.hpp"
#include "viwo/feed/run_data.hpp"

namespace viwo {
namespace {

EncoderSample encoders(std::int64_t t_ns) {
  EncoderSample sample;
  sample.t_ns = t_ns;
  return sample;
}

TEST(Recorded, KeepsTheSamplesOfEachSensorApartInTheirOrder) {
  Recorded recorded;
  recorded.add("wheels0", encoders(1));
  recorded.add("imu0", ImuSample{.t_ns = 2});
  recorded.add("wheels1", encoders(3));
  recorded.add("wheels0", encoders(4));
  ASSERT_EQ(recorded.of<EncoderSample>("wheels0").size(), 2U);
  EXPECT_EQ(recorded.of<EncoderSample>("wheels0")[0].t_ns, 1);
  EXPECT_EQ(recorded.of<EncoderSample>("wheels0")[1].t_ns, 4);
  ASSERT_EQ(recorded.of<EncoderSample>("wheels1").size(), 1U);
  EXPECT_EQ(recorded.of<EncoderSample>("wheels1")[0].t_ns, 3);
  EXPECT_TRUE(recorded.of<EncoderSample>("imu0").empty());
  EXPECT_TRUE(recorded.of<FeatureSample>().empty());
  ASSERT_EQ(recorded.tracks().size(), 3U);
  EXPECT_EQ(recorded.tracks()[1].sensor, "imu0");
  EXPECT_EQ(recorded.tracks()[1].samples->type(), sample_type<ImuSample>());
}

TEST(Recorded, WithoutANameIsOfTheFirstSensorThatGaveTheKind) {
  Recorded recorded;
  recorded.add("imu0", ImuSample{.t_ns = 2});
  recorded.add("wheels1", encoders(3));
  recorded.add("wheels0", encoders(4));
  ASSERT_EQ(recorded.of<EncoderSample>().size(), 1U);
  EXPECT_EQ(recorded.of<EncoderSample>()[0].t_ns, 3);
  EXPECT_EQ(recorded.find("", sample_type<EncoderSample>()),
            recorded.find("wheels1", sample_type<EncoderSample>()));
  EXPECT_EQ(recorded.find("wheels2", sample_type<EncoderSample>()), nullptr);
}

TEST(Recorded, ReplacesWhatASensorGaveOfAKind) {
  Recorded recorded;
  recorded.add("sim", encoders(1));
  recorded.add("sim", ImuSample{.t_ns = 2});
  recorded.add("other", encoders(3));
  recorded.set("sim", std::vector{encoders(5), encoders(6)});
  ASSERT_EQ(recorded.of<EncoderSample>("sim").size(), 2U);
  EXPECT_EQ(recorded.of<EncoderSample>("sim")[0].t_ns, 5);
  EXPECT_EQ(recorded.of<EncoderSample>("other").size(), 1U);
  EXPECT_EQ(recorded.of<ImuSample>("sim").size(), 1U);
  recorded.set<EncoderSample>("sim", {});
  EXPECT_TRUE(recorded.of<EncoderSample>("sim").empty());
}

// kRejected is an answer of others: to take it for the end would lose all that follows.
TEST(HasNext, RefusesAnAnswerThatIsNone) {
  class Answers final : public Sensor {
   public:
    explicit Answers(Status status) : status_(status) {}
    SampleTypes yields() const override { return {}; }
    Status next(Measurement& /*out*/) override { return status_; }

   private:
    Status status_;
  };
  Measurement out;
  Answers goes_on(Status::kOk), ends(Status::kEnd), rejects(Status::kRejected);
  EXPECT_TRUE(has_next({}, goes_on, out));
  EXPECT_FALSE(has_next({}, ends, out));
  EXPECT_THROW(has_next({}, rejects, out), PluginFailure);
}

TEST(RunData, HasTheWheelsOfTheFirstWheelSet) {
  RunData data;
  data.recorded.add("wheels1", encoders(1));
  data.recorded.add("wheels0", encoders(2));
  data.wheels_name = "wheels0";
  ASSERT_EQ(data.wheels().size(), 1U);
  EXPECT_EQ(data.wheels()[0].t_ns, 2);
}

}  // namespace
}  // namespace viwo
