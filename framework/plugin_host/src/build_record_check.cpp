#include "viwo/plugin_host/build_record_check.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <cstddef>
#include <utility>

#include "viwo/plugin_host/plugin_info.hpp"

namespace viwo {
namespace {

constexpr const char* kMissing = "(missing)";

bool is_record_char(char c) {
  return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_' || c == '-' || c == '.';
}

using Fields = std::vector<std::pair<std::string, std::string>>;

/// "key=value;key=value;" as pairs, or nothing if it is not of that form.
Fields split_fields(std::string_view text) {
  Fields fields;
  while (!text.empty()) {
    const std::size_t end = text.find(';');
    const std::size_t equals = text.find('=');
    if (end == std::string_view::npos || equals == 0 || equals >= end) return {};
    const std::string_view key = text.substr(0, equals);
    const std::string_view value = text.substr(equals + 1, end - equals - 1);
    if (!std::all_of(key.begin(), key.end(), is_record_char) ||
        !std::all_of(value.begin(), value.end(), is_record_char)) {
      return {};
    }
    fields.emplace_back(key, value);
    text.remove_prefix(end + 1);
  }
  return fields;
}

Fields record_fields(std::string_view record) {
  record.remove_prefix(std::min(kBuildRecordBegin.size(), record.size()));
  if (record.ends_with(kBuildRecordEnd)) record.remove_suffix(1);
  return split_fields(record);
}

const std::string* find_field(const Fields& fields, const std::string& key) {
  for (const auto& field : fields) {
    if (field.first == key) return &field.second;
  }
  return nullptr;
}

/// What to do about a field that differs; the first prefix that matches counts.
struct Remedy {
  std::string_view field_prefix;
  std::string_view text;
};
constexpr std::array<Remedy, 10> kRemedies = {{
    {"api", "it is for another version of the plugin API: rebuild it against this viwo"},
    {"compiler", "rebuild it with the compiler of this viwo, and with viwo_add_plugin()"},
    {"gxx_abi", "rebuild it with the compiler of this viwo, and with viwo_add_plugin()"},
    {"address_sanitizer", "build host and plugin with the same VIWO_SANITIZE"},
    {"thread_sanitizer", "build host and plugin with the same VIWO_SANITIZE"},
    {"eigen_row_major", "rebuild it without EIGEN_DEFAULT_TO_ROW_MAJOR"},
    {"fast_math",
     "rebuild it without -ffast-math and -Ofast: they change the arithmetic of the "
     "whole process"},
    {"eigen_ma",
     "the instruction sets differ: rebuild it with viwo_add_plugin() of this viwo, "
     "without -march or -mavx of its own"},
    {"eigen_vector4d",
     "the instruction sets differ: rebuild it with viwo_add_plugin() of this viwo, "
     "without -march or -mavx of its own"},
    {"", "rebuild it with viwo_add_plugin() of this viwo"},
}};

std::string_view remedy_for(const std::string& field) {
  for (const Remedy& remedy : kRemedies) {
    if (field.starts_with(remedy.field_prefix)) return remedy.text;
  }
  return {};
}

}  // namespace

std::vector<std::string> find_build_records(std::string_view bytes) {
  std::vector<std::string> records;
  for (std::size_t at = 0; (at = bytes.find(kBuildRecordBegin, at)) != std::string_view::npos;) {
    const std::size_t begin = at + kBuildRecordBegin.size();
    const std::string_view rest = bytes.substr(begin, detail::RecordText{}.text.size());
    const std::size_t size = rest.find(kBuildRecordEnd);
    if (size != std::string_view::npos && !split_fields(rest.substr(0, size)).empty()) {
      std::string record{bytes.substr(at, kBuildRecordBegin.size() + size + 1)};
      if (std::find(records.begin(), records.end(), record) == records.end()) {
        records.push_back(std::move(record));
        if (records.size() > 1) return records;
      }
    }
    at = begin;
  }
  return records;
}

std::string build_record_in(std::string_view bytes, const std::filesystem::path& file) {
  std::vector<std::string> records = find_build_records(bytes);
  if (records.empty()) {
    throw PluginRefused(file,
                        "has no build record, so it is not a plugin of viwo - register it with "
                        "VIWO_REGISTER() and build it with viwo_add_plugin()");
  }
  if (records.size() > 1) {
    std::string reason = "has parts that are built differently from each other";
    for (const RecordDifference& d : compare_build_records(records[0], records[1])) {
      reason += "\n  " + d.field + ": " + d.host + " and " + d.plugin;
    }
    throw PluginRefused(file, reason + "\n  -> build all its sources with viwo_add_plugin()");
  }
  return std::move(records.front());
}

std::vector<RecordDifference> compare_build_records(std::string_view host,
                                                    std::string_view plugin) {
  const Fields host_fields = record_fields(host);
  const Fields plugin_fields = record_fields(plugin);
  std::vector<RecordDifference> differences;
  for (const auto& [key, value] : host_fields) {
    const std::string* other = find_field(plugin_fields, key);
    if (other != nullptr && (*other == value || key == kDigestField)) continue;
    differences.push_back({key, value, other != nullptr ? *other : kMissing});
  }
  for (const auto& [key, value] : plugin_fields) {
    if (find_field(host_fields, key) == nullptr) differences.push_back({key, kMissing, value});
  }
  // Under the address sanitizer Eigen aligns for itself: that is no difference of its own.
  if (std::any_of(differences.begin(), differences.end(),
                  [](const auto& d) { return d.field == "address_sanitizer"; })) {
    std::erase_if(differences, [](const auto& d) { return d.field == "eigen_malloc_aligned"; });
  }
  return differences;
}

std::string explain(const std::vector<RecordDifference>& differences) {
  std::string text = "is built differently from this host";
  std::vector<std::string_view> remedies;
  for (const RecordDifference& d : differences) {
    text += "\n  " + d.field + ": host " + d.host + ", plugin " + d.plugin;
    const std::string_view remedy = remedy_for(d.field);
    if (std::find(remedies.begin(), remedies.end(), remedy) == remedies.end()) {
      remedies.push_back(remedy);
    }
  }
  for (const std::string_view remedy : remedies) text += "\n  -> " + std::string(remedy);
  return text;
}

bool host_record_is_consistent(std::string_view own) { return own == api_build_record(); }

}  // namespace viwo
