// What is printed for a terminal.
#pragma once

#include <ostream>
#include <streambuf>

namespace viwo::files {

/// As long as it lives, control characters that are printed to `stream` (but for line ends and
/// tabs) are '?': texts of files, which are in messages, move no cursor and name no window.
class PrintableOutput : private std::streambuf {
 public:
  explicit PrintableOutput(std::ostream& stream) : stream_(stream), to_(stream.rdbuf(this)) {}
  ~PrintableOutput() override { stream_.rdbuf(to_); }
  PrintableOutput(const PrintableOutput&) = delete;
  PrintableOutput& operator=(const PrintableOutput&) = delete;

 private:
  int_type overflow(int_type value) override;
  int sync() override { return to_->pubsync(); }

  std::ostream& stream_;
  std::streambuf* to_;
  bool may_be_control_ = false;  ///< the first of the two bytes of U+0080 to U+00BF is held back
};

}  // namespace viwo::files
