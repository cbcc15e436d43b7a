// Tables in text files: one header line, fields separated by ',' or ';'.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "viwo/api/status.hpp"
#include "viwo/log/text.hpp"
#include "viwo/log/text_reader.hpp"

namespace viwo::log {

/// The table `name` of a folder, plain or gzipped (NAME.gz); InputError when both are there.
/// Neither: the plain one, which cannot be opened then.
std::filesystem::path table_in(const std::filesystem::path& folder, const std::string& name);

/// "file:line  what": of a row that is no row of the table, while others may be.
class BadRow : public InputError {
 public:
  BadRow(const std::string& place, const std::string& text)
      : InputError(place + "  " + text), text_(text) {}
  /// What is wrong, without the place.
  const std::string& text() const { return text_; }

 private:
  std::string text_;
};

/// How a table is laid out that is not one of viwo's own. Its columns may be unnamed or have one
/// name twice, and are also found by their number, from 1; texts may be in double quotes.
struct TableLayout {
  char separator = 0;          ///< ' ': any blanks; 0: of ';' ',' tab blanks the first that occurs
  int skip_lines = 0;          ///< lines before the header, or the first row
  bool has_header = true;      ///< without one, numbers are the names of the columns
  bool decimal_comma = false;  ///< in rows, of numbers; the separator is then another
};

/// Reads row by row. The header may begin with '#' as in EuRoC files; the separator is ';' if the
/// header has one and ',' otherwise; empty lines are skipped. Wrong rows are a BadRow; more than
/// 4096 columns are an InputError.
class TableReader {
 public:
  explicit TableReader(const std::filesystem::path& file);
  TableReader(const std::filesystem::path& file, const TableLayout& layout);

  const std::vector<std::string>& columns() const { return columns_; }  ///< "name" or "name [unit]"
  bool has_column(std::string_view name) const { return find(name).has_value(); }

  /// Column of that exact name; InputError with the nearest spelling when there is none.
  std::size_t column(std::string_view name) const;
  /// Column "name [unit]", or "name" where the file gives no unit; InputError for another unit.
  std::size_t column(std::string_view name, std::string_view unit) const;
  /// The same whatever unit stands behind the name.
  std::size_t column_in_any_unit(std::string_view name) const;

  /// Calls `row` at each row to the end; `reject` with the BadRow for those that cannot be read.
  template <class Row, class Reject>
  void for_each_row(Row&& row, Reject&& reject) {
    for (bool more = true; more;) {
      try {
        more = next();
        if (more) row();
      } catch (const BadRow& bad) {
        reject(bad);
      }
    }
  }

  /// Goes to the next row; false at the end. BadRow for a wrong number of fields. A last line
  /// that has no line ending, and too few fields or half a number at its end, is left out: whoever
  /// wrote it did not come further.
  bool next();
  bool cut_short() const { return reader_.last_left_out(); }  ///< a last line was left out

  std::string_view text(std::size_t column) const { return fields_[column]; }
  /// NaN and infinite values are numbers here: the caller counts them.
  double number(std::size_t column) const;
  std::int64_t integer(std::size_t column) const;
  /// An integer in nanoseconds within +-4e18, so that differences of stamps cannot overflow.
  std::int64_t stamp_ns(std::size_t column) const;

  /// Decimal seconds as nanoseconds, exact (parse_seconds_ns).
  std::int64_t seconds_ns(std::size_t column) const;
  /// The same in any unit (parse_time_ns).
  std::int64_t time_ns(std::size_t column, TimeUnit unit) const;

  const TextReader& reader() const { return reader_; }
  /// Throws BadRow "file:line  column 'name': text".
  [[noreturn]] void fail(std::size_t column, const std::string& text) const;

 private:
  /// Of a field that is not `what` it should be.
  [[noreturn]] void fail_as(std::size_t column, const char* what) const;
  [[noreturn]] void refuse(const std::string& text) const;
  std::optional<std::size_t> find(std::string_view name) const;
  /// Throws InputError where two columns have the name, in whatever units.
  void require_one(std::string_view name) const;

  void check_columns() const;
  /// Of a row, to fields_.
  void split_fields(std::string_view row);
  /// The line behind `skip` others; without the '#' before a header.
  std::string_view first_line(int skip);

  TextReader reader_;
  char separator_ = ',';
  bool decimal_comma_ = false;
  std::string with_points_;  ///< the row, if it has decimal commas
  bool is_own_ = true;       ///< not of any layout
  bool has_row_ = false;     ///< the first row has been read where the header is looked for
  std::vector<std::string> columns_;
  std::vector<std::string_view> fields_;
};

}  // namespace viwo::log
