// Progress of long work: a bar on a terminal, plain lines otherwise, on stderr.
#pragma once

#include <chrono>
#include <mutex>
#include <string>

namespace viwo::experiment {

/// Counts finished pieces of work. Calls may come from any thread.
class Progress {
 public:
  Progress(std::string what, int total);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  /// One more piece is done; `line` says what came out (shown above the bar, or as a line).
  void done(const std::string& line);

 private:
  void draw() const;

  std::mutex mutex_;
  std::string what_;
  int total_;
  int count_ = 0;
  bool terminal_;
  std::chrono::steady_clock::time_point start_;
};

}  // namespace viwo::experiment
