// Positions in configuration files, and the errors found there: collected, reported all at once.
#pragma once

#include <cstddef>
#include <string>
#include <utility>
#include <vector>

namespace viwo::config {

/// Where something is written. Line and column count from 1; line 0 means that there is only an
/// origin, such as "--set kinematics.type".
struct Mark {
  std::string file;
  int line = 0;
  int column = 0;

  /// "file:line:column", or the origin alone.
  std::string text() const;

  bool operator==(const Mark&) const = default;
};

/// Everything that is wrong with an input, each with its position.
class Errors {
 public:
  void add(const Mark& mark, std::string text);
  bool empty() const { return errors_.empty(); }
  std::size_t size() const { return errors_.size(); }

  /// One line per error, "file:line:column  text", sorted by position; of very many the first.
  std::string text() const;

  /// Throws viwo::InputError with text() unless empty.
  void throw_if_any() const;

 private:
  std::vector<std::pair<Mark, std::string>> errors_;
};

/// Throws viwo::InputError with this one error.
[[noreturn]] void fail(const Mark& mark, const std::string& text);

}  // namespace viwo::config
