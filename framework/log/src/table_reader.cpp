#include "viwo/log/table_reader.hpp"

#include <algorithm>
#include <iterator>
#include <system_error>
#include <utility>

#include "viwo/log/text.hpp"
#include "viwo/math/stamp.hpp"

namespace viwo::log {
namespace {

constexpr std::size_t kMostColumns = 4096;

/// Where the first field ends. With `quotes` not within them.
std::size_t field_end(std::string_view line, char separator, bool quotes) {
  std::size_t from = 0;
  if (quotes && trim(line).starts_with('"')) {
    const std::size_t closing = line.find('"', line.find('"') + 1);
    if (closing != std::string_view::npos) from = closing + 1;
  }
  return separator == ' ' ? line.find_first_of(" \t", from) : line.find(separator, from);
}

std::string_view without_quotes(std::string_view field) {
  const bool is_quoted = field.size() > 1 && field.front() == '"' && field.back() == '"';
  return is_quoted ? trim(field.substr(1, field.size() - 2)) : field;
}

std::string with_points(std::string_view text) {
  std::string out(text);
  std::replace(out.begin(), out.end(), ',', '.');
  return out;
}

void split(std::string_view line, char separator, bool quotes,
           std::vector<std::string_view>& fields) {
  fields.clear();
  for (;;) {
    if (separator == ' ') line = trim(line);
    const std::size_t end = field_end(line, separator, quotes);
    const std::string_view field = trim(line.substr(0, end));
    fields.push_back(quotes ? without_quotes(field) : field);
    if (end == std::string_view::npos) return;
    line.remove_prefix(end + 1);
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

std::filesystem::path table_in(const std::filesystem::path& folder, const std::string& name) {
  std::filesystem::path plain = folder / name;
  std::filesystem::path packed = folder / (name + ".gz");
  std::error_code ignored;
  if (!std::filesystem::exists(packed, ignored)) return plain;
  if (!std::filesystem::exists(plain, ignored)) return packed;
  throw InputError(folder.string() + "  holds both " + name + " and " + name +
                   ".gz: name the file that is meant, or remove the other");
}

TableReader::TableReader(const std::filesystem::path& file) : reader_(file) {
  const std::string_view header = first_line(0);
  if (header.find(';') != std::string_view::npos) separator_ = ';';
  split(header, separator_, false, fields_);
  check_columns();
  if (std::all_of(fields_.begin(), fields_.end(),
                  [](std::string_view name) { return parse_number(name).has_value(); })) {
    reader_.fail("numbers where the header is expected: the first line names the columns");
  }
  for (const std::string_view name : fields_) {
    if (name.empty()) reader_.fail("the header has a column without a name");
    if (has_column(name)) reader_.fail("the header has the column " + quoted(name) + " twice");
    columns_.emplace_back(name);
  }
}

TableReader::TableReader(const std::filesystem::path& file, const TableLayout& layout)
    : reader_(file),
      separator_(layout.separator),
      decimal_comma_(layout.decimal_comma),
      is_own_(false),
      has_row_(!layout.has_header) {
  const std::string_view line = first_line(layout.skip_lines);
  if (separator_ == 0) {
    separator_ = ' ';
    for (const char candidate : {'\t', ',', ';'}) {
      if (decimal_comma_ && candidate == ',') continue;
      if (line.find(candidate) != std::string_view::npos) separator_ = candidate;
    }
  }
  if (has_row_) {
    split_fields(line);
  } else {
    split(line, separator_, true, fields_);
  }
  check_columns();
  for (std::size_t i = 0; i < fields_.size(); ++i) {
    columns_.push_back(has_row_ ? std::to_string(i + 1) : std::string(fields_[i]));
  }
}

void TableReader::split_fields(std::string_view row) {
  if (decimal_comma_) {
    with_points_ = with_points(row);
    row = with_points_;
  }
  split(row, separator_, !is_own_, fields_);
}

void TableReader::check_columns() const {
  if (fields_.size() <= kMostColumns) return;
  reader_.fail(std::to_string(fields_.size()) + " columns, at most " +
               std::to_string(kMostColumns) + " are read");
}

std::string_view TableReader::first_line(int skip) {
  std::string_view line;
  for (int i = 0; i <= skip; ++i) {
    if (reader_.next(line)) continue;  // an empty file throws
    reader_.fail("the file ends before the line that is the first of the table");
  }
  if (!has_row_ && trim(line).starts_with('#')) line.remove_prefix(line.find('#') + 1);
  return line;
}

std::optional<std::size_t> TableReader::find(std::string_view name) const {
  const auto found = std::find(columns_.begin(), columns_.end(), name);
  if (found == columns_.end()) return std::nullopt;
  return static_cast<std::size_t>(found - columns_.begin());
}

std::size_t TableReader::column(std::string_view name) const {
  const auto found = find(name);
  if (!is_own_ && found && std::count(columns_.begin(), columns_.end(), name) > 1) {
    reader_.fail("the header has the column " + quoted(name) + " twice: give its number");
  }
  if (found) return *found;
  const auto number = is_own_ ? std::nullopt : parse_integer(name);
  if (number && *number >= 1 && *number <= std::ssize(columns_)) {
    return static_cast<std::size_t>(*number - 1);
  }
  reader_.fail("no column '" + std::string(name) + "'" + did_you_mean(name, columns_));
}

void TableReader::require_one(std::string_view name) const {
  const std::string with_unit = std::string(name) + " [";
  std::string_view first;
  for (const std::string& candidate : columns_) {
    if (candidate != name && !candidate.starts_with(with_unit)) continue;
    if (!first.empty()) {
      reader_.fail("columns " + quoted(first) + " and " + log::quoted(candidate) +
                   " are the same quantity: keep one of them");
    }
    first = candidate;
  }
}

std::size_t TableReader::column(std::string_view name, std::string_view unit) const {
  require_one(name);
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

std::size_t TableReader::column_in_any_unit(std::string_view name) const {
  require_one(name);
  const std::string with_unit = std::string(name) + " [";
  for (std::size_t i = 0; i < columns_.size(); ++i) {
    if (columns_[i].starts_with(with_unit)) return i;
  }
  return column(name);
}

bool TableReader::next() {
  if (!std::exchange(has_row_, false)) {
    std::string_view line;
    do {
      if (!reader_.next(line)) return false;
    } while (trim(line).empty());
    split_fields(line);
  }
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
  fail_as(column, " is not a number");
}

std::int64_t TableReader::integer(std::size_t column) const {
  if (const auto value = parse_integer(fields_[column])) return *value;
  fail(column, quoted(fields_[column]) + " is not an integer");
}

std::int64_t TableReader::stamp_ns(std::size_t column) const {
  const std::int64_t stamp = integer(column);
  if (!is_stamp(stamp)) {
    fail(column, quoted(fields_[column]) + " is no stamp in nanoseconds");
  }
  return stamp;
}

std::int64_t TableReader::seconds_ns(std::size_t column) const {
  if (const auto value = parse_seconds_ns(fields_[column])) return *value;
  fail(column, quoted(fields_[column]) + " is no time in seconds");
}

std::int64_t TableReader::time_ns(std::size_t column, TimeUnit unit) const {
  if (const auto value = parse_time_ns(fields_[column], unit)) return *value;
  fail_as(column, " is no time");
}

void TableReader::fail_as(std::size_t column, const char* what) const {
  const bool has_comma =
      parse_number(with_points(fields_[column])) && !parse_number(fields_[column]);
  fail(column, quoted(fields_[column]) +
                   (!has_comma ? what
                    : is_own_  ? " has a decimal comma: numbers have points here"
                               : " has a decimal comma: 'decimal_comma: true' reads it"));
}

void TableReader::fail(std::size_t column, const std::string& text) const {
  refuse("column '" + columns_[column] + "': " + text);
}

void TableReader::refuse(const std::string& text) const { throw BadRow(reader_.place(), text); }

}  // namespace viwo::log
