// Kinds of samples that two libraries know differently: an error that names both, when an object of
// the second is made.
#include <set>
#include <string>

#include <gtest/gtest.h>

#include "support.hpp"
#include "viwo/api/measurement.hpp"
#include "viwo/config/yaml.hpp"
#include "viwo/plugin_host/registry.hpp"
#include "viwo/testing/update_host.hpp"

namespace viwo {
namespace {

std::string file_of(const std::string& plugin) {
  return (kBadPlugins / ("libviwo_" + plugin + ".so")).string();
}

class Kinds : public ::testing::Test {
 protected:
  static config::Node section(const std::string& name) {
    return *config::parse("k: {type: " + name + "}", "run.yaml").find("k");
  }

  /// The errors of making a sensor.
  std::string sensor(const std::string& name) {
    config::Errors errors;
    const auto loaded = registry_.make_sensor(section(name), "sensors.s", 1, errors);
    EXPECT_EQ(loaded.object == nullptr, !errors.empty());
    return errors.text();
  }

  /// What an update's declare() throws.
  std::string update(const std::string& name) {
    config::Errors errors;
    const auto loaded = registry_.make_update(section(name), "updates.u", 1, errors);
    EXPECT_EQ(errors.text(), "");
    testing::UpdateHost host;
    return error_of([&] { loaded.object->declare(host); });
  }

  PluginRegistry registry_{{kBadPlugins}};
};

TEST_F(Kinds, OfViwoAreKnownAll) {
  const std::string header = text_of(std::filesystem::path(VIWO_TEST_SOURCE_DIR) /
                                     "framework/plugin_api/include/viwo/api/measurement.hpp");
  std::size_t registered = 0;
  for (std::size_t at = 0; (at = header.find("\nVIWO_SAMPLE(", at)) != std::string::npos; ++at) {
    ++registered;
  }
  std::set<std::string> names;
  for (const SampleType* type : built_in_sample_types()) names.insert(type->name);
  EXPECT_EQ(names.size(), registered) << "framework/plugin_host/src/sample_kinds.cpp";
  EXPECT_TRUE(names.contains("encoders"));
}

TEST_F(Kinds, OfOthersAreExchangedWhenTheyAreTheSame) {
  EXPECT_EQ(sensor("range"), "");
  EXPECT_EQ(update("range"), "");
  EXPECT_EQ(sensor("range"), "") << "once more";
}

TEST_F(Kinds, AreNotTakenForThoseOfViwo) {
  const std::string size = std::to_string(sizeof(EncoderSample));
  EXPECT_EQ(sensor("own_encoders"),
            "run.yaml:1:4  sensors.s: sensor plugin 'own_encoders' 0.1.0 (" +
                file_of("sensor_own_encoders") +
                ") has samples 'encoders' of version 1, 24 bytes, viwo itself of version 1, " +
                size +
                " bytes - build it against this viwo, or give its samples a name of their own");
}

TEST_F(Kinds, OfAnotherVersionAreRefusedWithBothFiles) {
  EXPECT_EQ(sensor("range"), "");
  EXPECT_EQ(update("range_2"),
            "update plugin 'range_2' 0.1.0 (" + file_of("update_range_2") +
                ") has samples 'range' of version 2, 24 bytes, sensor plugin 'range' 0.1.0 (" +
                file_of("sensor_range") +
                ") of version 1, 24 bytes - build both with the same definition of them");
  EXPECT_EQ(update("range"), "") << "those that fit go on";
}

TEST_F(Kinds, InAnotherLayoutAreRefusedWithBothFiles) {
  EXPECT_EQ(update("range_order"), "") << "it is the first";
  EXPECT_EQ(sensor("range"), "run.yaml:1:4  sensors.s: sensor plugin 'range' 0.1.0 (" +
                                 file_of("sensor_range") +
                                 ") has samples 'range' of version 1, 24 bytes, update plugin "
                                 "'range_order' 0.1.0 (" +
                                 file_of("update_range_order") +
                                 ") of version 1, 24 bytes in another layout - build both with "
                                 "the same definition of them");
}

}  // namespace
}  // namespace viwo
