#include "viwo/api/params.hpp"

#include <stdexcept>

#include "viwo/api/status.hpp"

namespace viwo {
namespace {

ParamSpec spec_of(const char* name, ParamType type, const ParamInfo& info) {
  ParamSpec spec;
  static_cast<ParamInfo&>(spec) = info;
  spec.name = name != nullptr ? name : "";
  spec.type = type;
  return spec;
}

}  // namespace

/// Lists the parameter with `value` as its default, or sets `value` to what was configured.
template <class T>
void ParamBinder::bind(ParamSpec spec, T& value) {
  if (specs_ != nullptr) {
    spec.fallback = value;
    specs_->push_back(std::move(spec));
    return;
  }
  const auto found = values_->find(spec.name);
  if (found == values_->end()) {
    throw std::logic_error("parameter '" + spec.name + "' has no value");
  }
  const T* given = std::get_if<T>(&found->second);
  if (given == nullptr) throw std::logic_error("parameter '" + spec.name + "' has another type");
  value = *given;
}

void ParamBinder::operator()(const char* name, bool& member, const ParamInfo& info) {
  bind(spec_of(name, ParamType::kBool, info), member);
}

void ParamBinder::integer(const char* name, std::int64_t& value, const ParamInfo& info) {
  bind(spec_of(name, ParamType::kInt, info), value);
}

void ParamBinder::refuse_integer(const char* name, std::int64_t value) {
  throw ParamError(name, std::to_string(value) + " is too large");
}

void ParamBinder::operator()(const char* name, double& member, const ParamInfo& info) {
  bind(spec_of(name, ParamType::kNumber, info), member);
}

void ParamBinder::operator()(const char* name, std::string& member, const ParamInfo& info) {
  bind(spec_of(name, ParamType::kString, info), member);
}

void ParamBinder::operator()(const char* name, std::filesystem::path& member,
                             const ParamInfo& info) {
  std::string text = member.string();
  bind(spec_of(name, ParamType::kPath, info), text);
  member = text;
}

void ParamBinder::operator()(const char* name, std::vector<double>& member, const ParamInfo& info) {
  numbers(name, member, 0, info);
}

void ParamBinder::numbers(const char* name, std::vector<double>& values, int size,
                          const ParamInfo& info) {
  ParamSpec spec = spec_of(name, ParamType::kNumbers, info);
  spec.size = size;
  bind(std::move(spec), values);
  if (size > 0 && values.size() != static_cast<std::size_t>(size)) {
    throw std::logic_error("parameter '" + std::string(name) + "' has another size");
  }
}

void ParamBinder::operator()(const char* name, std::vector<std::string>& member,
                             const ParamInfo& info) {
  bind(spec_of(name, ParamType::kStrings, info), member);
}

void ParamBinder::operator()(const char* name, NestedKinematics& member, const ParamInfo& info) {
  ParamSpec spec = spec_of(name, ParamType::kKinematics, info);
  spec.fallback_section = member.fallback;
  bind(std::move(spec), member.model);
}

std::size_t ParamBinder::choice(const char* name, const std::vector<const char*>& names,
                                std::size_t chosen, const ParamInfo& info) {
  std::string choices;
  for (const char* text : names) choices += (choices.empty() ? "" : "|") + std::string(text);
  std::string text = names.at(chosen);
  ParamSpec spec = spec_of(name, ParamType::kString, info);
  spec.choices = choices;
  bind(std::move(spec), text);
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (text == names[i]) return i;
  }
  throw std::logic_error("parameter '" + std::string(name) + "' has a value without a name");
}

}  // namespace viwo
