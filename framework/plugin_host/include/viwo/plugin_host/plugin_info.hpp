// What the host knows about a plugin, and what can go wrong with one.
#pragma once

#include <exception>
#include <filesystem>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>

#include "viwo/api/params.hpp"
#include "viwo/api/status.hpp"

namespace viwo {

/// A plugin that has been loaded; `params` points into its library, which stays until exit.
struct PluginInfo {
  std::string kind;  ///< "kinematics", "sensor"
  std::string name;  ///< as in `type:`
  std::string version;
  std::string summary;
  std::string license;
  std::filesystem::path file;
  std::span<const ParamSpec> params;
};

/// "sensor plugin 'ticks' 0.1.0 (/usr/lib/.../libviwo_sensor_ticks.so)"
std::string full_name(const PluginInfo& info);

/// A file that is not loaded. what() is "refusing FILE: REASON"; the reason says what to do.
class PluginRefused : public InputError {
 public:
  PluginRefused(std::filesystem::path file, const std::string& reason);
  ~PluginRefused() override;
  const std::filesystem::path& file() const { return file_; }
  const std::string& reason() const { return reason_; }

 private:
  std::filesystem::path file_;
  std::string reason_;
};

/// The reason is the system, not what is in the file: it may well be a plugin, but could not be
/// read, loaded or copied to memory.
class PluginUnavailable : public PluginRefused {
 public:
  using PluginRefused::PluginRefused;
  ~PluginUnavailable() override;
};

/// A plugin did what it must not: the text of whatever it threw, and where.
class PluginFailure : public std::runtime_error {
 public:
  PluginFailure(const PluginInfo& info, std::string_view phase, const std::string& text);
  ~PluginFailure() override;
  const std::string& name() const { return name_; }
  const std::string& version() const { return version_; }
  const std::filesystem::path& file() const { return file_; }
  const std::string& phase() const { return phase_; }
  const std::string& text() const { return text_; }

 private:
  std::string name_;
  std::string version_;
  std::filesystem::path file_;
  std::string phase_;
  std::string text_;
};

/// Runs `f`, which calls the plugin, and returns what it returns. InputError passes: it is the
/// user's to mend. Everything else that is thrown becomes a PluginFailure of the host.
template <class F>
decltype(auto) guarded(const PluginInfo& info, std::string_view phase, F&& f) {
  try {
    return std::forward<F>(f)();
  } catch (const InputError&) {
    throw;
  } catch (const PluginFailure&) {
    throw;
  } catch (const std::exception& error) {
    throw PluginFailure(info, phase, error.what());
  } catch (...) {
    throw PluginFailure(info, phase, "threw something that is not a std::exception");
  }
}

}  // namespace viwo
