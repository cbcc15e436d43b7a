// Parameters of a plugin: a constexpr table says what there is, the host parses and checks the
// configuration against it, and the plugin's constructor reads the checked values.
#pragma once

#include <cstdint>
#include <limits>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "viwo/api/export.hpp"

namespace viwo {

class KinematicModel;

enum class ParamType : std::uint8_t {
  kBool,
  kInt,
  kNumber,
  kString,
  kPath,        ///< file or folder; relative paths are relative to the configuration file
  kNumbers,     ///< list of numbers; bounds hold for each
  kStrings,     ///< list of strings; choices hold for each
  kKinematics,  ///< a nested kinematic model ({type: ..., its parameters}), built by the host
};

/// One row of a plugin's parameter table. Write it with designated initialisers:
///   {.name = "sigma_drive_rad_per_s", .type = ParamType::kNumber, .unit = "rad/s",
///    .fallback = "0.001", .min = 0., .min_exclusive = true, .help = "drive encoder noise"}
struct ParamSpec {
  const char* name;       ///< key in the configuration; ends in the unit where there is one
  ParamType type;         ///< how the value is written
  const char* unit = "";  ///< for the documentation
  const char* fallback = nullptr;  ///< default as YAML text; nullptr: the parameter is required
  double min = -std::numeric_limits<double>::infinity();
  double max = std::numeric_limits<double>::infinity();
  bool min_exclusive = false;  ///< value > min instead of value >= min
  const char* choices = "";    ///< allowed strings, separated by '|'; empty: any
  const char* help = "";       ///< one sentence
};

/// Checked parameter values, filled by the host. Getters throw std::logic_error when a name or type
/// is asked for that the table does not have: a bug of the plugin, not of the user.
class VIWO_API ParamSet {
 public:
  using Value = std::variant<bool, std::int64_t, double, std::string, std::vector<double>,
                             std::vector<std::string>, const KinematicModel*>;

  bool flag(std::string_view name) const;
  std::int64_t integer(std::string_view name) const;
  double number(std::string_view name) const;
  const std::string& text(std::string_view name) const;  ///< kString and kPath
  std::span<const double> numbers(std::string_view name) const;
  std::span<const std::string> texts(std::string_view name) const;
  const KinematicModel& kinematics(std::string_view name) const;

  void set(std::string name, Value value);
  const std::map<std::string, Value, std::less<>>& values() const { return values_; }

 private:
  std::map<std::string, Value, std::less<>> values_;
};

}  // namespace viwo
