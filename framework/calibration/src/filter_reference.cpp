#include "filter_reference.hpp"

#include <algorithm>
#include <string_view>

#include "viwo/config/overrides.hpp"
#include "viwo/run/run.hpp"

namespace viwo::calibration {
namespace {

using config::Node;

bool is_of_wheels(const SharedStream& stream) {
  return *stream.spec.type == sample_type<EncoderSample>();
}

/// Whether `update`, a key of the section `updates`, is among "ranges, rear.wheel_odometry".
bool takes(std::string_view takers, std::string_view update) {
  while (!takers.empty()) {
    const std::size_t end = std::min(takers.find(", "), takers.size());
    std::string_view one = takers.substr(0, end);
    takers.remove_prefix(std::min(end + 2, takers.size()));
    // Of several wheel sets each has an instance, SET.UPDATE.
    if (one.size() > update.size() && one[one.size() - update.size() - 1] == '.') {
      one.remove_prefix(one.size() - update.size());
    }
    if (one == update) return true;
  }
  return false;
}

}  // namespace

Trajectory poses_of_filter(const Node& run, const std::string& where, PluginRegistry& plugins) {
  const Node* updates = run.find("updates");
  if (updates == nullptr) {
    throw InputError(where + ": reference: filter needs a base with updates, of cameras for one");
  }
  Node without = run;
  const RunSetup complete = read_run(run, plugins);
  for (const auto& entry : updates->entries()) {
    const auto& streams = complete.filter->streams;
    const bool is_taker = std::any_of(streams.begin(), streams.end(), [&](const auto& stream) {
      return is_of_wheels(stream) && takes(stream.takers, entry.key);
    });
    if (is_taker)
      config::set_path(without, "updates." + entry.key + ".enabled", Node::scalar_of("false"));
  }
  RunSetup setup = read_run(without, plugins);
  const auto& left = setup.filter->streams;
  const bool sees = std::any_of(left.begin(), left.end(), [](const auto& stream) {
    return !is_of_wheels(stream) && stream.takers != "estimator.start";
  });
  if (!sees) {
    throw InputError(where +
                     ": reference: filter, but without its wheels the filter of the base knows of "
                     "the motion by its IMU alone: it needs an update of cameras, say, or "
                     "reference: gyro");
  }
  const RunData data = collect(setup);
  RunResult result = run_filter(setup, data);
  if (result.status != RunStatus::kOk) {
    throw InputError(where + ": reference: filter, but without its wheels the filter of the base " +
                     "ends as '" + name(result.status) + "': " + result.cause);
  }
  return std::move(result.estimate);
}

}  // namespace viwo::calibration
