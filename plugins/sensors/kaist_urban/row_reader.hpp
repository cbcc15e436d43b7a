// Rows of the dataset's tables: numbers separated by commas, no header.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "viwo/log/text_reader.hpp"

namespace viwo::kaist {

/// Reads row by row; empty lines are skipped. Everything that is wrong is an InputError
/// "file:line  what".
class RowReader {
 public:
  /// `columns` names the fields of a row, for messages.
  RowReader(const std::filesystem::path& file, std::string columns)
      : reader_(file), columns_(std::move(columns)) {}

  /// Goes to the next row; false at the end.
  bool next();
  std::size_t size() const { return fields_.size(); }
  /// InputError when the row has another number of fields.
  void require_size(std::size_t n) const;

  std::int64_t stamp_ns(std::size_t field) const;  ///< within +-4e18, so that differences are safe
  std::int64_t integer(std::size_t field) const;
  double number(std::size_t field) const;  ///< NaN and infinite values included

  const log::TextReader& reader() const { return reader_; }

 private:
  [[noreturn]] void fail(std::size_t field, const std::string& text) const;

  log::TextReader reader_;
  std::string columns_;
  std::vector<std::string_view> fields_;
};

}  // namespace viwo::kaist
