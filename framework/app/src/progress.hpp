// Progress of long work: a bar on a terminal, plain lines otherwise, on stderr.
#pragma once

#include <chrono>
#include <mutex>
#include <string>

#include "viwo/run/work_progress.hpp"

namespace viwo::app {

/// On stderr.
class Progress final : public WorkProgress {
 public:
  Progress();
  ~Progress() override;
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  void begin(const std::string& what, int total) override;
  void skipped(int count, const std::string& line) override;
  void done(const std::string& line) override;
  void note(const std::string& line) override;

 private:
  void draw() const;
  void show(const std::string& line) const;

  std::mutex mutex_;
  std::string what_;
  int total_ = 0;
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

}  // namespace viwo::app
