#include "viwo/plugin_host/sample_kinds.hpp"

#include "viwo/api/measurement.hpp"
#include "viwo/api/status.hpp"

namespace viwo {
namespace {

std::string size_of(const SampleType& type) {
  return "version " + std::to_string(type.version) + ", " + std::to_string(type.size) + " bytes";
}

}  // namespace

SampleTypes built_in_sample_types() {
  return sample_types<EncoderSample, ImuSample, FeatureSample, PoseSample, HeadingSample,
                      GnssSample, StateSample, CalibrationSample, ImageSample>();
}

SampleKinds::SampleKinds() {
  for (const SampleType* type : built_in_sample_types()) known_[type->name] = {type, ""};
}

void SampleKinds::require(const SampleType& type, const PluginInfo& whose) {
  const std::lock_guard lock(mutex_);
  const auto [at, is_new] = known_.try_emplace(type.name, Known{&type, full_name(whose)});
  const Known& known = at->second;
  if (is_new || *known.type == type) return;
  const bool is_own = known.whose.empty();
  std::string text = full_name(whose) + " has samples '" + type.name + "' of " + size_of(type) +
                     ", " + (is_own ? "viwo itself" : known.whose) + " of " + size_of(*known.type);
  if (size_of(type) == size_of(*known.type)) text += " in another layout";
  throw InputError(text + (is_own ? " - build it against this viwo, or give its samples a name of "
                                    "their own"
                                  : " - build both with the same definition of them"));
}

}  // namespace viwo
