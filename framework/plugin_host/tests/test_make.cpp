// Objects from configuration: values, errors with positions, failures, lifetimes.
#include <array>
#include <set>
#include <stdexcept>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "support.hpp"
#include "viwo/config/yaml.hpp"
#include "viwo/plugin_host/registry.hpp"

namespace viwo {
namespace {

using config::Errors;
using config::Node;

Node section(const std::string& yaml) {
  return *config::parse("k: " + yaml, "configs/x.yaml").find("k");
}

/// The errors of making a kinematic model.
std::string errors_of(const std::string& yaml) {
  PluginRegistry registry({kBadPlugins});
  Errors errors;
  const auto loaded = registry.make_kinematics(section(yaml), "kinematics", 1, errors);
  EXPECT_EQ(loaded.object == nullptr, !errors.empty());
  return errors.text();
}

TEST(Make, AKinematicModelThatComputes) {
  PluginRegistry registry({kBadPlugins});
  Errors errors;
  const auto loaded =
      registry.make_kinematics(section("{type: moody, radius_m: 0.25}"), "k", 1, errors);
  ASSERT_EQ(errors.text(), "");
  EXPECT_EQ(loaded.info.name, "moody");
  EXPECT_EQ(loaded.resolved.find("radius_m")->scalar(), "0.25");
  ModelDescription description;
  loaded.object->describe(description);
  EXPECT_EQ(description.intrinsics.at(0).nominal, 0.25);
  EncoderSample sample;
  sample.drive_rad_per_s[0] = 8.;
  RowSystem rows;
  EXPECT_EQ(loaded.object->rows(sample, Intrinsics::Constant(1, 0.25), false, rows), Status::kOk);
  EXPECT_EQ(rows.b[0], 2.);
}

TEST(Make, ResolvedSectionMakesTheSameObject) {
  PluginRegistry registry({kBadPlugins});
  Errors errors;
  const auto first = registry.make_sensor(
      section("{type: ticks, file: a.csv, kinematics: {type: moody, radius_m: 0.5}}"), "s", 1,
      errors);
  ASSERT_EQ(errors.text(), "");
  const std::string file = (std::filesystem::current_path() / "configs/a.csv").string();
  const std::string yaml = config::to_yaml(first.resolved);
  EXPECT_EQ(yaml,
            "type: ticks\ncount: 2\nkinematics:\n  type: moody\n  radius_m: 0.5\n  mood: fine\n"
            "file: " +
                file + "\n");
  const auto second = registry.make_sensor(config::parse(yaml, "/else/y.yaml"), "s", 1, errors);
  ASSERT_EQ(errors.text(), "");
  EXPECT_EQ(second.resolved, first.resolved);
}

TEST(Make, ASensorKeepsItsModelsAndServices) {
  std::vector<std::string> messages;
  Loaded<Sensor> loaded;
  {
    PluginRegistry registry(
        {kBadPlugins}, [&](const PluginInfo& info, LogLevel level, std::string_view text) {
          messages.push_back(info.name + (level == LogLevel::kWarning ? " warns: " : ": ") +
                             std::string(text));
        });
    Errors errors;
    loaded = registry.make_sensor(section("{type: ticks, file: /f, kinematics: {type: moody}}"),
                                  "s", 20, errors);
    ASSERT_EQ(errors.text(), "");
  }
  Measurement measurement;
  ASSERT_EQ(loaded.object->next(measurement), Status::kOk);
  EXPECT_EQ(measurement.get_if<EncoderSample>()->drive_rad_per_s[0], 0.1 * 20.);
  EXPECT_EQ(loaded.object->next(measurement), Status::kOk);
  EXPECT_EQ(loaded.object->next(measurement), Status::kEnd);
  loaded = {};
  EXPECT_EQ(messages, (std::vector<std::string>{"ticks warns: file /f", "ticks: goodbye r"}));
}

TEST(Make, GivesEveryPluginItsSeedAndModelsNestedInItTheirOwn) {
  std::vector<std::string> seeds;
  PluginRegistry registry({kBadPlugins},
                          [&](const PluginInfo& info, LogLevel level, std::string_view text) {
                            if (level == LogLevel::kWarning || info.name == "ticks") return;
                            seeds.push_back(info.name + " " + std::string(text));
                          });
  Errors errors;
  registry.make_kinematics(section("{type: moody, mood: seed}"), "kinematics", 7, errors);
  registry.make_update(section("{type: failing, what: seed}"), "updates.u", 8, errors);
  registry.make_sensor(section("{type: ticks, kinematics: {type: moody, mood: seed}}"), "sensors.w",
                       9, errors);
  ASSERT_EQ(errors.text(), "");
  const auto nested = std::to_string(instance_seed(9, "kinematics", "sensors.w.kinematics"));
  EXPECT_EQ(seeds, (std::vector<std::string>{"moody 7", "failing 8", "moody " + nested}));
}

TEST(InstanceSeed, IsTheSameOnEveryMachine) {
  EXPECT_EQ(instance_seed(1, "update", "updates.wheel_odometry"), 0x5aa0d58584b98730u);
  EXPECT_EQ(instance_seed(0, "kinematics", "kinematics"), 0xbd7b5c5ef318ab62u);
}

TEST(InstanceSeed, IsAnotherOneForEveryRunKindAndPath) {
  std::set<std::uint64_t> seeds;
  for (std::uint64_t run = 0; run < 100; ++run) {
    for (const char* kind : {"kinematics", "update", "updates"}) {
      for (const char* path : {"", "a", "b", "a.b", "s.a"}) {
        seeds.insert(instance_seed(run, kind, path));
      }
    }
  }
  EXPECT_EQ(seeds.size(), 100u * 3 * 5);
}

TEST(Make, TwoSensorsDoNotSeeEachOther) {
  PluginRegistry registry({kBadPlugins}, [](const PluginInfo&, LogLevel, std::string_view) {});
  Errors errors;
  const auto a = registry.make_sensor(section("{type: ticks, count: 1}"), "s", 1, errors);
  const auto b = registry.make_sensor(section("{type: ticks, count: 1}"), "s", 2, errors);
  Measurement measurement;
  EXPECT_EQ(a.object->next(measurement), Status::kOk);
  EXPECT_EQ(a.object->next(measurement), Status::kEnd);
  EXPECT_EQ(b.object->next(measurement), Status::kOk);
  EXPECT_EQ(measurement.get_if<EncoderSample>()->drive_rad_per_s[0], 0.2);
}

TEST(Make, RegistryServesManyThreads) {
  PluginRegistry registry({kBadPlugins}, [](const PluginInfo&, LogLevel, std::string_view) {});
  std::array<int, 8> made{};
  std::vector<std::thread> threads;
  for (int& count : made) {
    threads.emplace_back([&] {
      for (int i = 0; i < 20; ++i) {
        Errors errors;
        if (registry.make_sensor(section("{type: ticks}"), "s", 1, errors).object) ++count;
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  for (const int count : made) EXPECT_EQ(count, 20);
}

TEST(Make, ReportsAMissingOrWrongType) {
  EXPECT_EQ(errors_of("[moody]"),
            "configs/x.yaml:1:4  kinematics: expected a section with 'type', got a list");
  EXPECT_EQ(errors_of("{type: [moody]}"),
            "configs/x.yaml:1:11  kinematics.type: expected the name of a plugin, got a list");
  EXPECT_EQ(errors_of("{radius_m: 1}").substr(0, 64),
            "configs/x.yaml:1:4  kinematics: 'type' is missing - known: bad_d");
}

TEST(Make, ReportsAnUnknownTypeWithThePlaceAndTheNearestName) {
  EXPECT_EQ(errors_of("{type: mody}"),
            "configs/x.yaml:1:11  kinematics.type: no kinematics plugin 'mody' - did you mean "
            "'moody'? (searched " +
                kBadPlugins.string() + ")");
  EXPECT_EQ(
      errors_of("{type: no_record}").substr(0, 51 + kBadPlugins.string().size()),
      ("configs/x.yaml:1:11  kinematics.type: refusing " + kBadPlugins.string() + "/libviwo_kin")
          .substr(0, 51 + kBadPlugins.string().size()));
}

TEST(Make, ReportsAllWrongParameters) {
  EXPECT_EQ(
      errors_of("{type: moody, radius_mm: 3, radius_m: 0, host_key: 1}"),
      "configs/x.yaml:1:18  kinematics (moody): unknown key 'radius_mm' - radius is in m, did "
      "you mean 'radius_m'?\n"
      "configs/x.yaml:1:42  kinematics.radius_m: 0 violates radius_m > 0 (wheel radius, m)\n"
      "configs/x.yaml:1:45  kinematics (moody): unknown key 'host_key' - known: radius_m, "
      "mood, type");
}

TEST(Make, LeavesTheCallersKeysAlone) {
  PluginRegistry registry({kBadPlugins});
  Errors errors;
  const std::array<std::string_view, 1> keys = {"host_key"};
  const auto loaded =
      registry.make_kinematics(section("{type: moody, host_key: 1}"), "k", 1, errors, keys);
  EXPECT_EQ(errors.text(), "");
  EXPECT_EQ(loaded.resolved.find("host_key"), nullptr);
}

TEST(Make, ReportsErrorsOfANestedModelWithItsPath) {
  PluginRegistry registry({kBadPlugins});
  Errors errors;
  const auto loaded = registry.make_sensor(
      section("{type: ticks, count: -1, kinematics: {type: moody, radius_m: x}}"), "sensors.w", 1,
      errors);
  EXPECT_EQ(loaded.object, nullptr);
  EXPECT_EQ(errors.text(),
            "configs/x.yaml:1:25  sensors.w.count: -1 violates count >= 0\n"
            "configs/x.yaml:1:65  sensors.w.kinematics.radius_m: 'x' is not a number");
}

TEST(Make, PlacesAParameterThatTheConstructorRefuses) {
  EXPECT_EQ(errors_of("{type: moody, mood: param, radius_m: 3}"),
            "configs/x.yaml:1:41  kinematics.radius_m: is too round");
  EXPECT_EQ(errors_of("{type: moody, mood: param}"),
            "configs/x.yaml:1:4  kinematics.radius_m: is too round");
  EXPECT_EQ(errors_of("{type: moody, mood: input}"),
            "configs/x.yaml:1:4  kinematics (moody): wheels.csv:3: not a wheel");
}

std::string failure_of(const std::string& yaml) {
  try {
    return errors_of(yaml);
  } catch (const PluginFailure& failure) {
    EXPECT_EQ(failure.phase(), "construction");
    return failure.what();
  }
}

TEST(Make, TurnsOtherExceptionsOfTheConstructorIntoFailures) {
  const std::string begin = "kinematics plugin 'moody' 1.2.0 (" + kBadPlugins.string() +
                            "/libviwo_kinematics_moody.so) failed in construction: ";
  EXPECT_EQ(failure_of("{type: moody, mood: std}"), begin + "out of sorts");
  EXPECT_EQ(failure_of("{type: moody, mood: int}"),
            begin + "threw something that is not a std::exception");
  EXPECT_EQ(failure_of("{type: moody, mood: bad_alloc}"), begin + "std::bad_alloc");
  EXPECT_EQ(
      failure_of("{type: gives_nothing}"),
      "kinematics plugin 'gives_nothing' 1 (" + kBadPlugins.string() +
          "/libviwo_kinematics_gives_nothing.so) failed in construction: create() gave neither "
          "an object nor a reason");
}

class Guarded : public ::testing::Test {
 protected:
  /// What comes out of a guarded call of rows().
  static std::string rows_of(const std::string& mood) {
    PluginRegistry registry({kBadPlugins});
    Errors errors;
    const auto loaded =
        registry.make_kinematics(section("{type: moody, mood: " + mood + "}"), "k", 1, errors);
    RowSystem out;
    try {
      const Status status = guarded(loaded.info, "rows", [&] {
        return loaded.object->rows({}, Intrinsics::Constant(1, 0.1), false, out);
      });
      return status == Status::kOk ? "ok" : "other status";
    } catch (const PluginFailure& failure) {
      return failure.name() + "|" + failure.version() + "|" + failure.file().filename().string() +
             "|" + failure.phase() + "|" + failure.text();
    } catch (const InputError& error) {
      return std::string("input: ") + error.what();
    }
  }
};

TEST_F(Guarded, CallsReturnWhatThePluginReturns) {
  EXPECT_EQ(rows_of("fine"), "ok");
  int value = 3;
  int& same = guarded(PluginInfo{}, "", [&]() -> int& { return value; });
  EXPECT_EQ(&same, &value);
}

TEST_F(Guarded, CallsTurnExceptionsIntoFailures) {
  const std::string begin = "moody|1.2.0|libviwo_kinematics_moody.so|rows|";
  EXPECT_EQ(rows_of("rows_std"), begin + "no such row");
  EXPECT_EQ(rows_of("rows_int"), begin + "threw something that is not a std::exception");
}

TEST_F(Guarded, CallsLetInputErrorsPass) {
  EXPECT_EQ(error_of([] { guarded(PluginInfo{}, "start", [] { throw InputError("no camera"); }); }),
            "no camera");
}

TEST_F(Guarded, ModelsThatRunHaveNoInputThatTheUserCouldMend) {
  EXPECT_EQ(rows_of("rows_input"),
            "moody|1.2.0|libviwo_kinematics_moody.so|rows|the sample is wrong");
}

TEST(Make, WhatAModelThrowsNamesItWhoeverCalls) {
  PluginRegistry registry({kBadPlugins});
  Errors errors;
  const auto loaded =
      registry.make_kinematics(section("{type: moody, mood: rows_int}"), "k", 1, errors);
  RowSystem out;
  try {
    loaded.object->rows({}, Intrinsics::Constant(1, 0.1), false, out);
    FAIL() << "nothing thrown";
  } catch (const PluginFailure& failure) {
    EXPECT_EQ(failure.phase(), "rows");
    EXPECT_EQ(failure.text(), "threw something that is not a std::exception");
  }
}

}  // namespace
}  // namespace viwo
