// A descriptor written by hand, wrong where the build says so.
#include <vector>

#include "viwo/api/plugin.hpp"

#ifndef BAD_STRUCT_SIZE
#define BAD_STRUCT_SIZE sizeof(viwo::PluginDescriptor)
#endif
#ifndef BAD_API_VERSION
#define BAD_API_VERSION viwo::kApiVersion
#endif
#ifndef BAD_NAME
#define BAD_NAME "unnamed"
#endif
#ifndef BAD_CREATE
#define BAD_CREATE &give_nothing
#endif
#ifndef BAD_PARAM
#define BAD_PARAM "r_m"
#endif
#ifndef BAD_FALLBACK
#define BAD_FALLBACK 1.
#endif

namespace {

const std::vector<viwo::ParamSpec>& params() {
  static const std::vector<viwo::ParamSpec> specs = [] {
    double value = BAD_FALLBACK;
    std::vector<viwo::ParamSpec> out;
    viwo::ParamBinder binder(out);
    binder(BAD_PARAM, value, {.min = 0.});
    return out;
  }();
  return specs;
}

[[maybe_unused]] void* give_nothing(const viwo::ParamSet*, const viwo::HostServices*,
                                    viwo::ErrorText*) noexcept {
  return nullptr;
}

void destroy_nothing(void*) noexcept {}

}  // namespace

extern "C" VIWO_API const viwo::PluginDescriptor viwo_plugin;
extern "C" const viwo::PluginDescriptor viwo_plugin = {BAD_STRUCT_SIZE,
                                                       BAD_API_VERSION,
                                                       viwo::kBuildRecord.text.data(),
                                                       "kinematics",
                                                       BAD_NAME,
                                                       "1",
                                                       "",
                                                       "",
                                                       &params,
                                                       BAD_CREATE,
                                                       &destroy_nothing};
