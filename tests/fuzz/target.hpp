// What is fuzzed: functions of bytes that somebody else may have written.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "viwo/config/node.hpp"
#include "viwo/plugin_host/registry.hpp"
#include "viwo/run/run_result.hpp"

namespace viwo::fuzz {

using Bytes = std::span<const std::uint8_t>;

struct Target {
  std::string name;
  std::function<void(Bytes)> run;
  std::string sources;  ///< whose lines it is to cover: files and folders, separated by blanks
};

/// All targets, each name once.
const std::vector<Target>& targets();
/// nullptr: there is none of that name.
const Target* find(const std::string& name);
std::vector<Target> sensor_targets();
std::vector<Target> file_targets();
std::vector<Target> live_targets();
std::vector<Target> filter_targets();
std::vector<Target> wheel_targets();

/// Text of the InputError that the bytes are answered with; empty where they are taken. Whatever
/// else is thrown is a finding, and so is what require() is told.
std::string run(const Target& target, Bytes bytes);

/// Throws std::logic_error when what must hold does not.
void require(bool holds, const std::string& what);

/// The process's own folder, with a copy of tests/fuzz/files; it is removed at the end.
const std::filesystem::path& folder();
Bytes bytes_of(const std::string& text);
/// A file in it, with these bytes.
std::filesystem::path write(const std::string& name, Bytes bytes);

/// The plugins that are built for fuzzing.
PluginRegistry& registry();

/// A file of a run in folder(), resolved.
config::Node configuration(const std::string& file, const std::vector<std::string>& set = {});

/// A run that is well has a finite trajectory, one that is not has a cause.
void require_well(const RunResult& result);

}  // namespace viwo::fuzz
