// What the wheel updates declare for one wheel set: the same, so that they share it.
#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "filter_fixture.hpp"
#include "viwo/estimator/declarations.hpp"

namespace viwo {
namespace {

const std::vector<std::string> kWithEncoders{"{type: wheel_odometry}", "{type: wheel_parity}",
                                             "{type: zero_velocity, detector: wheels}"};

/// The left wheel set of a base that has several.
class WheelDeclarations : public ::testing::Test {
 protected:
  WheelDeclarations() : model_(testing::load_model(testing::swerve("four_wis_wid"))) {
    prior_ = testing::free_wheels({}, model_.get(), 0.02);
    prior_.name = "left";
    prior_.sensor = "wheels_left";
  }

  testing::UpdateHost declared_by(const std::string& yaml) const {
    testing::UpdateHost host(Rig({}, prior_));
    testing::load_update(yaml)->declare(host);
    EXPECT_TRUE(host.rig().was_asked_for_wheels()) << yaml;
    return host;
  }

  std::shared_ptr<const WheelModel> model_;
  WheelsPrior prior_;
};

TEST_F(WheelDeclarations, AreTheSameBlocksInAllWheelUpdates) {
  std::vector<std::string> updates = kWithEncoders;
  updates.emplace_back("{type: planar_motion}");
  for (const std::string& yaml : updates) {
    const testing::UpdateHost host = declared_by(yaml);
    const auto expected = wheels_blocks(prior_);
    ASSERT_EQ(host.blocks.size(), expected.size()) << yaml;
    for (std::size_t i = 0; i < expected.size(); ++i) {
      EXPECT_TRUE(host.blocks[i].spec == expected[i]) << yaml << " " << expected[i].name;
    }
    EXPECT_EQ(host.blocks[0].spec.name, "wheels.left.extrinsics");
    EXPECT_EQ(host.streams.size(), yaml == "{type: planar_motion}" ? 0U : 1U);
  }
}

TEST_F(WheelDeclarations, AreTheEncodersOfTheWheelSetInItsClock) {
  for (const std::string& yaml : kWithEncoders) {
    const testing::UpdateHost host = declared_by(yaml);
    const StreamSpec& stream = host.streams.at(0);
    EXPECT_TRUE(*stream.type == sample_type<EncoderSample>()) << yaml;
    EXPECT_EQ(stream.sensor, "wheels_left") << yaml;
    EXPECT_EQ(stream.given, Given::kSinceOldestClone) << yaml;
    EXPECT_TRUE(stream.awaited && !stream.ends_epochs && !stream.optional) << yaml;
    ASSERT_EQ(stream.clocks.size(), 1U) << yaml;
    EXPECT_EQ(stream.clocks[0].constant_s, 0.) << yaml;
    const BlockId clock = stream.clocks[0].block;
    EXPECT_EQ(host.blocks.at(static_cast<std::size_t>(clock.index)).spec.name, "wheels.left.clock")
        << yaml;
  }
}

TEST_F(WheelDeclarations, AreSharedInAFilter) {
  DeclarationTable table;
  std::vector<std::string> updates = kWithEncoders;
  updates.emplace_back("{type: planar_motion}");
  for (const std::string& yaml : updates) {
    table.declare({yaml.substr(7, yaml.find_first_of(",}") - 7), testing::load_update(yaml),
                   std::make_shared<Rig>(std::vector<CameraPrior>(), prior_), ""});
  }
  EXPECT_EQ(table.blocks().size(), 3U);
  ASSERT_EQ(table.streams().size(), 1U);
  EXPECT_EQ(table.streams()[0].takers, "wheel_odometry, wheel_parity, zero_velocity");
  EXPECT_TRUE(table.streams()[0].keeps);
}

}  // namespace
}  // namespace viwo
