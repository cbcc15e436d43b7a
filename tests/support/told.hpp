// What long work tells of its progress, for tests.
#pragma once

#include <mutex>
#include <string>

#include "viwo/run/work_progress.hpp"

namespace viwo::testing {

/// What whoever waits for long work is told, a line each.
class Told final : public WorkProgress {
 public:
  void begin(const std::string& /*what*/, int total) override { total_ = total; }
  void skipped(int /*count*/, const std::string& line) override { add(line); }
  void done(const std::string& line) override { add(line); }
  void note(const std::string& line) override { add(line); }

  int total() const { return total_; }
  std::string text() const { return text_; }

 private:
  void add(const std::string& line) {
    const std::scoped_lock lock(mutex_);
    text_ += line + "\n";
  }
  std::mutex mutex_;
  int total_ = 0;
  std::string text_;
};

}  // namespace viwo::testing
