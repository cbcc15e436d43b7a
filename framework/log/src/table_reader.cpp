#include "viwo/log/table_reader.hpp"

#include <algorithm>

#include "viwo/log/text.hpp"

namespace viwo::log {
namespace {

void split(std::string_view line, char separator, std::vector<std::string_view>& fields) {
  fields.clear();
  for (std::size_t begin = 0;;) {
    const std::size_t end = line.find(separator, begin);
    fields.push_back(trim(line.substr(begin, end - begin)));
    if (end == std::string_view::npos) return;
    begin = end + 1;
  }
}

/// What a number or a list is like when its end is missing: one more digit, or the bracket, would
/// make it one.
bool is_begun(std::string_view field) {
  if (field.starts_with('[')) return !field.ends_with(']');
  if (field.starts_with('(')) return !field.ends_with(')');
  return !parse_number(field) && parse_number(std::string(field) + '0');
}

std::string fields_text(std::size_t n) {
  return std::to_string(n) + (n == 1 ? " field" : " fields");
}

}  // namespace

TableReader::TableReader(const std::filesystem::path& file) : reader_(file) {
  std::string_view header;
  reader_.next(header);  // an empty file throws
  header = trim(header);
  if (header.starts_with('#')) header.remove_prefix(1);
  if (header.find(';') != std::string_view::npos) separator_ = ';';
  split(header, separator_, fields_);
  for (const std::string_view name : fields_) {
    if (name.empty()) reader_.fail("the header has a column without a name");
    if (has_column(name)) reader_.fail("the header has the column " + quoted(name) + " twice");
    columns_.emplace_back(name);
  }
}

std::optional<std::size_t> TableReader::find(std::string_view name) const {
  const auto found = std::find(columns_.begin(), columns_.end(), name);
  if (found == columns_.end()) return std::nullopt;
  return static_cast<std::size_t>(found - columns_.begin());
}

std::size_t TableReader::column(std::string_view name) const {
  if (const auto found = find(name)) return *found;
  reader_.fail("no column '" + std::string(name) + "'" + did_you_mean(name, columns_));
}

std::size_t TableReader::column(std::string_view name, std::string_view unit) const {
  const std::string with_unit = std::string(name) + " [" + std::string(unit) + "]";
  if (const auto found = find(with_unit)) return *found;
  if (const auto found = find(name)) return *found;
  for (const std::string& candidate : columns_) {
    if (candidate.starts_with(std::string(name) + " [")) {
      reader_.fail("column '" + candidate + "' has another unit than '" + with_unit + "'");
    }
  }
  return column(with_unit);
}

bool TableReader::next() {
  std::string_view line;
  do {
    if (!reader_.next(line)) return false;
  } while (trim(line).empty());
  split(line, separator_, fields_);
  if (reader_.unterminated() && (fields_.size() < columns_.size() ||
                                 (fields_.size() == columns_.size() && is_begun(fields_.back())))) {
    reader_.leave_out_last();
    return false;
  }
  if (fields_.size() != columns_.size()) {
    refuse(fields_text(fields_.size()) + " where the header has " +
           std::to_string(columns_.size()));
  }
  return true;
}

double TableReader::number(std::size_t column) const {
  if (const auto value = parse_number(fields_[column])) return *value;
  fail(column, quoted(fields_[column]) + " is not a number");
}

std::int64_t TableReader::integer(std::size_t column) const {
  if (const auto value = parse_integer(fields_[column])) return *value;
  fail(column, quoted(fields_[column]) + " is not an integer");
}

std::int64_t TableReader::stamp_ns(std::size_t column) const {
  constexpr std::int64_t kMaxStamp = 4'000'000'000'000'000'000;
  const std::int64_t stamp = integer(column);
  if (stamp < -kMaxStamp || stamp > kMaxStamp) {
    fail(column, quoted(fields_[column]) + " is no stamp in nanoseconds");
  }
  return stamp;
}

std::int64_t TableReader::seconds_ns(std::size_t column) const {
  if (const auto value = parse_seconds_ns(fields_[column])) return *value;
  fail(column, quoted(fields_[column]) + " is no time in seconds");
}

void TableReader::fail(std::size_t column, const std::string& text) const {
  refuse("column '" + columns_[column] + "': " + text);
}

void TableReader::refuse(const std::string& text) const { throw BadRow(reader_.place(), text); }

}  // namespace viwo::log
