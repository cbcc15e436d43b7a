// Registration of a plugin: one line, VIWO_REGISTER(...), per shared library.
#pragma once

#include <array>
#include <cstdint>
#include <cstring>
#include <exception>
#include <string_view>
#include <vector>

#include "viwo/api/build_record.hpp"
#include "viwo/api/export.hpp"
#include "viwo/api/host_services.hpp"
#include "viwo/api/kinematic_model.hpp"
#include "viwo/api/params.hpp"
#include "viwo/api/sensor.hpp"
#include "viwo/api/status.hpp"
#include "viwo/api/update.hpp"

namespace viwo {

/// What went wrong in create(), copied out of the plugin as text: no exception object ever leaves
/// it.
struct ErrorText {
  enum Cause : std::int32_t { kNone, kInput, kParam, kFailure };
  std::int32_t cause = kNone;
  std::array<char, 64> key{};  ///< the parameter, with kParam
  std::array<char, 1024> text{};
};

/// Plain C data, append-only, at the symbol `viwo_plugin` of a plugin's library. The host checks
/// struct_size and api_version before it reads on.
struct PluginDescriptor {
  std::uint32_t struct_size;
  std::uint32_t api_version;
  const char* build_record;
  const char* kind;  ///< "kinematics", "sensor", "update"
  const char* name;  ///< what a configuration writes as `type:`
  const char* version;
  const char* summary;
  const char* license;
  /// Its parameters, which stay until the process exits. May throw what bind() throws.
  const std::vector<ParamSpec>& (*params)();
  /// Returns the interface pointer (KinematicModel*, Sensor*, Update*) as void*, or nullptr with
  /// `error`.
  void* (*create)(const ParamSet* params, const HostServices* services, ErrorText* error) noexcept;
  void (*destroy)(void* object) noexcept;
};

namespace detail {

template <class Interface>
struct PluginKind;
template <>
struct PluginKind<KinematicModel> {
  static constexpr const char* kName = "kinematics";
};
template <>
struct PluginKind<Sensor> {
  static constexpr const char* kName = "sensor";
};
template <>
struct PluginKind<Update> {
  static constexpr const char* kName = "update";
};

template <std::size_t N>
void copy_text(std::string_view from, std::array<char, N>& to) {
  const std::size_t size = from.size() < N - 1 ? from.size() : N - 1;
  std::memcpy(to.data(), from.data(), size);
  to[size] = '\0';
}

template <class Params>
const std::vector<ParamSpec>& plugin_params() {
  // Never destroyed: the host may look at it while the process exits.
  static const auto& specs = *new std::vector<ParamSpec>(param_specs<Params>());
  return specs;
}

template <class Interface, class Implementation, class Params>
void* create_plugin(const ParamSet* params, const HostServices* services,
                    ErrorText* error) noexcept {
  try {
    return static_cast<Interface*>(new Implementation(params_from<Params>(*params), *services));
  } catch (const ParamError& failure) {
    error->cause = ErrorText::kParam;
    copy_text(failure.key(), error->key);
    copy_text(failure.what(), error->text);
  } catch (const InputError& failure) {
    error->cause = ErrorText::kInput;
    copy_text(failure.what(), error->text);
  } catch (const std::exception& failure) {
    error->cause = ErrorText::kFailure;
    copy_text(failure.what(), error->text);
  } catch (...) {
    error->cause = ErrorText::kFailure;
    copy_text("threw something that is not a std::exception", error->text);
  }
  return nullptr;
}

template <class Interface>
void destroy_plugin(void* object) noexcept {
  delete static_cast<Interface*>(object);
}

}  // namespace detail
}  // namespace viwo

/// Registers the one plugin of a library. Interface: KinematicModel, Sensor or Update;
/// Params: a structure with bind() (viwo/api/params.hpp); Implementation: a class derived from the
/// interface with a constructor (const Params&, const HostServices&). The symbol is strong: a
/// second registration does not link.
#define VIWO_REGISTER(Interface, Implementation, plugin_name, plugin_version, plugin_summary, \
                      plugin_license, Params)                                                 \
  extern "C" VIWO_API const ::viwo::PluginDescriptor viwo_plugin;                             \
  extern "C" const ::viwo::PluginDescriptor viwo_plugin = {                                   \
      sizeof(::viwo::PluginDescriptor),                                                       \
      ::viwo::kApiVersion,                                                                    \
      ::viwo::kBuildRecord.text.data(),                                                       \
      ::viwo::detail::PluginKind<Interface>::kName,                                           \
      plugin_name,                                                                            \
      plugin_version,                                                                         \
      plugin_summary,                                                                         \
      plugin_license,                                                                         \
      &::viwo::detail::plugin_params<Params>,                                                 \
      &::viwo::detail::create_plugin<Interface, Implementation, Params>,                      \
      &::viwo::detail::destroy_plugin<Interface>}
