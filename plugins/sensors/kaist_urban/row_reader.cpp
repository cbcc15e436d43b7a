#include "row_reader.hpp"

#include "viwo/log/text.hpp"
#include "viwo/math/stamp.hpp"

namespace viwo::kaist {

bool RowReader::next() {
  std::string_view line;
  do {
    if (!reader_.next(line)) return false;
  } while (log::trim(line).empty());
  fields_.clear();
  for (std::size_t begin = 0;;) {
    const std::size_t end = line.find(',', begin);
    fields_.push_back(log::trim(line.substr(begin, end - begin)));
    if (end == std::string_view::npos) return true;
    begin = end + 1;
  }
}

void RowReader::require_size(std::size_t n) const {
  if (fields_.size() == n) return;
  reader_.fail(std::to_string(fields_.size()) + (fields_.size() == 1 ? " field" : " fields") +
               " where a row has " + std::to_string(n) + ": " + columns_);
}

std::int64_t RowReader::stamp_ns(std::size_t field) const {
  const std::int64_t stamp = integer(field);
  if (!is_stamp(stamp)) {
    fail(field, log::quoted(fields_[field]) + " is no stamp in nanoseconds");
  }
  return stamp;
}

std::int64_t RowReader::integer(std::size_t field) const {
  if (const auto value = log::parse_integer(fields_[field])) return *value;
  fail(field, log::quoted(fields_[field]) + " is not an integer");
}

double RowReader::number(std::size_t field) const {
  if (const auto value = log::parse_number(fields_[field])) return *value;
  fail(field, log::quoted(fields_[field]) + " is not a number");
}

void RowReader::fail(std::size_t field, const std::string& text) const {
  reader_.fail("field " + std::to_string(field + 1) + ": " + text);
}

}  // namespace viwo::kaist
