// Parameters of a plugin: a plain structure with defaults, whose bind() says once what each member
// means. From it come what the host parses and checks, the resolved configuration, the
// documentation and the JSON Schema; the plugin's constructor gets the structure, filled.
//
//   struct Params {
//     double max_speed_m_per_s = 3.;
//     Eigen::Vector3d p_AinI_m = Eigen::Vector3d::Zero();
//     std::filesystem::path table;
//
//     void bind(viwo::ParamBinder& b) {
//       b(VIWO_PARAM(max_speed_m_per_s), {.unit = "m/s", .min = 0., .help = "faster is an error"});
//       b(VIWO_PARAM(p_AinI_m), {.unit = "m", .help = "the antenna, seen from the IMU"});
//       b(VIWO_PARAM(table), {.required = true, .help = "what is read"});
//     }
//   };
//
// Structures that several plugins share are bases of it, whose bind() it calls.
#pragma once

#include <cstdint>
#include <filesystem>
#include <initializer_list>
#include <limits>
#include <map>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

#include <Eigen/Core>

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

using ParamValue = std::variant<bool, std::int64_t, double, std::string, std::vector<double>,
                                std::vector<std::string>, const KinematicModel*>;

/// Checked values by name.
using ParamSet = std::map<std::string, ParamValue, std::less<>>;

/// What a parameter means; with designated initialisers.
struct ParamInfo {
  std::string unit = {};                                    ///< for the documentation
  double min = -std::numeric_limits<double>::infinity();    ///< value >= min
  double above = -std::numeric_limits<double>::infinity();  ///< value > above
  double max = std::numeric_limits<double>::infinity();     ///< value <= max
  std::string choices = {};  ///< allowed strings, separated by '|'; empty: any
  bool required = false;     ///< a configuration must give it
  std::string help = {};     ///< one sentence
};

/// A parameter as the host sees it.
struct ParamSpec : ParamInfo {
  std::string name;  ///< key in the configuration; ends in the unit where there is one
  ParamType type = ParamType::kBool;
  int size = 0;                  ///< kNumbers: how many there must be; 0: any number
  ParamValue fallback;           ///< what is taken where a configuration is silent
  std::string fallback_section;  ///< kKinematics: the same, as a section in YAML

  double lowest() const { return above < min ? min : above; }
  bool excludes_lowest() const { return above >= min; }  ///< if there is a lowest
};

/// A nested kinematic model; the host builds it and owns it longer than the plugin's object.
struct NestedKinematics {
  const char* fallback = "";  ///< section in YAML
  const KinematicModel* model = nullptr;
};

/// Name and member, for ParamBinder: what a configuration calls it is what the code calls it.
#define VIWO_PARAM(member) #member, member

/// Goes through the parameters of a structure: lists them, or fills them in. Types of members:
/// bool, integers, double, std::string, std::filesystem::path, Eigen::Vector2d and Vector3d,
/// std::vector<double>, std::vector<std::string>, NestedKinematics; enumerations with the names of
/// their values.
class VIWO_API ParamBinder {
 public:
  explicit ParamBinder(std::vector<ParamSpec>& specs) : specs_(&specs) {}
  explicit ParamBinder(const ParamSet& values) : values_(&values) {}

  void operator()(const char* name, bool& member, const ParamInfo& info);
  void operator()(const char* name, double& member, const ParamInfo& info);
  void operator()(const char* name, std::string& member, const ParamInfo& info);
  void operator()(const char* name, std::filesystem::path& member, const ParamInfo& info);
  void operator()(const char* name, std::vector<double>& member, const ParamInfo& info);
  void operator()(const char* name, std::vector<std::string>& member, const ParamInfo& info);
  void operator()(const char* name, NestedKinematics& member, const ParamInfo& info);

  /// ParamError for a value that the type of the member does not hold.
  template <class T>
  requires(std::is_integral_v<T> && !std::is_same_v<T, bool>) void operator()(
      const char* name, T& member, const ParamInfo& info) {
    std::int64_t value = static_cast<std::int64_t>(member);
    integer(name, value, info);
    if (!std::in_range<T>(value)) refuse_integer(name, value);
    member = static_cast<T>(value);
  }

  template <int n>
  void operator()(const char* name, Eigen::Matrix<double, n, 1>& member, const ParamInfo& info) {
    std::vector<double> values(member.data(), member.data() + n);
    numbers(name, values, n, info);
    for (int i = 0; i < n; ++i) member[i] = values[static_cast<std::size_t>(i)];
  }

  /// `values`: every value with its name in a configuration.
  template <class T>
  requires std::is_enum_v<T>
  void operator()(const char* name, T& member,
                  std::initializer_list<std::pair<const char*, std::type_identity_t<T>>> values,
                  const ParamInfo& info) {
    std::vector<const char*> names;
    std::size_t chosen = 0;
    for (const auto& [text, value] : values) {
      if (value == member) chosen = names.size();
      names.push_back(text);
    }
    member = values.begin()[choice(name, names, chosen, info)].second;
  }

 private:
  void integer(const char* name, std::int64_t& value, const ParamInfo& info);
  void numbers(const char* name, std::vector<double>& values, int size, const ParamInfo& info);
  std::size_t choice(const char* name, const std::vector<const char*>& names, std::size_t chosen,
                     const ParamInfo& info);
  [[noreturn]] static void refuse_integer(const char* name, std::int64_t value);
  template <class T>
  void bind(ParamSpec spec, T& value);

  std::vector<ParamSpec>* specs_ = nullptr;
  const ParamSet* values_ = nullptr;
};

/// The parameters of a structure, with the values in `defaults` as defaults.
template <class T>
std::vector<ParamSpec> param_specs(T defaults = {}) {
  std::vector<ParamSpec> specs;
  ParamBinder binder(specs);
  defaults.bind(binder);
  return specs;
}

/// The structure with checked values; std::logic_error when they are not those of param_specs<T>.
template <class T>
T params_from(const ParamSet& values) {
  T params;
  ParamBinder binder(values);
  params.bind(binder);
  return params;
}

/// Of a plugin that has none.
struct NoParams {
  void bind(ParamBinder& /*b*/) {}
};

}  // namespace viwo
