// What is printed for a terminal.
#pragma once

#include <mutex>
#include <ostream>
#include <streambuf>
#include <string>
#include <string_view>

namespace viwo::files {

/// As long as it lives, control characters that are printed to `stream` (but for line ends and
/// tabs) are '?', and bytes that are no UTF-8 U+FFFD, as in files: texts of files, which are in
/// messages, move no cursor and name no window. Threads may print at the same time.
class PrintableOutput : private std::streambuf {
 public:
  explicit PrintableOutput(std::ostream& stream) : stream_(stream), to_(stream.rdbuf(this)) {}
  ~PrintableOutput() override;
  PrintableOutput(const PrintableOutput&) = delete;
  PrintableOutput& operator=(const PrintableOutput&) = delete;

 private:
  int_type overflow(int_type value) override;
  std::streamsize xsputn(const char* text, std::streamsize size) override;
  int sync() override;
  bool take(char byte);
  bool put(std::string_view character);

  std::ostream& stream_;
  std::streambuf* to_;
  std::mutex mutex_;
  std::string held_;  ///< the first bytes of a character, of which the others have not come
};

/// At the end of `program`: all of the standard output is written. std::runtime_error if it is not,
/// but for a reader that has gone (`| head`).
void flush_output(const std::string& program);

}  // namespace viwo::files
