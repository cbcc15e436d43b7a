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

  /// `count` pieces need not be done again, for the reason that `line` says.
  void skipped(int count, const std::string& line);

  /// One more piece is done; `line` says what came out (shown above the bar, or as a line).
  void done(const std::string& line);

  /// Something that is to be known now.
  void note(const std::string& line);

 private:
  void draw() const;
  void show(const std::string& line) const;

  std::mutex mutex_;
  std::string what_;
  int total_;
  int count_ = 0;
  int skipped_ = 0;
  bool terminal_;
  std::chrono::steady_clock::time_point start_;
};

/// How far one long piece of work is, in percent. Silent for its first second; then a bar that is
/// drawn again at most ten times a second, or a line for every ten percent (at most one a second).
class TimeProgress {
 public:
  explicit TimeProgress(std::string what);
  ~TimeProgress();
  TimeProgress(const TimeProgress&) = delete;
  TimeProgress& operator=(const TimeProgress&) = delete;

  /// `fraction` of the work is done, 0 to 1.
  void at(double fraction);

 private:
  using Clock = std::chrono::steady_clock;

  std::string what_;
  bool terminal_;
  bool drawn_ = false;
  int shown_percent_ = 0;
  Clock::time_point start_;
  Clock::time_point next_;
};

}  // namespace viwo::experiment
