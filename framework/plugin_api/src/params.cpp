#include "viwo/api/params.hpp"

#include <stdexcept>
#include <utility>

namespace viwo {
namespace {

template <class T>
const T& get(const std::map<std::string, ParamSet::Value, std::less<>>& values,
             std::string_view name) {
  const auto found = values.find(name);
  if (found == values.end()) {
    throw std::logic_error("parameter '" + std::string(name) + "' is not in the plugin's table");
  }
  if (const T* value = std::get_if<T>(&found->second)) return *value;
  throw std::logic_error("parameter '" + std::string(name) + "' has another type in the table");
}

}  // namespace

bool ParamSet::flag(std::string_view name) const { return get<bool>(values_, name); }

std::int64_t ParamSet::integer(std::string_view name) const {
  return get<std::int64_t>(values_, name);
}

double ParamSet::number(std::string_view name) const { return get<double>(values_, name); }

const std::string& ParamSet::text(std::string_view name) const {
  return get<std::string>(values_, name);
}

std::span<const double> ParamSet::numbers(std::string_view name) const {
  return get<std::vector<double>>(values_, name);
}

std::span<const std::string> ParamSet::texts(std::string_view name) const {
  return get<std::vector<std::string>>(values_, name);
}

const KinematicModel& ParamSet::kinematics(std::string_view name) const {
  return *get<const KinematicModel*>(values_, name);
}

void ParamSet::set(std::string name, Value value) {
  values_.insert_or_assign(std::move(name), std::move(value));
}

}  // namespace viwo
