// Progress of long work, as it is told to whoever waits for it.
#pragma once

#include <string>

namespace viwo {

/// Counts finished pieces of work. Calls may come from any thread. This one keeps it to itself.
class WorkProgress {
 public:
  virtual ~WorkProgress() = default;
  /// Once, before all others.
  virtual void begin(const std::string& /*what*/, int /*total*/) {}
  /// `count` pieces need not be done again, for the reason that `line` says.
  virtual void skipped(int /*count*/, const std::string& /*line*/) {}
  /// One more piece is done; `line` says what came out.
  virtual void done(const std::string& /*line*/) {}
  /// Something that is to be known now.
  virtual void note(const std::string& /*line*/) {}
};

/// For work that nobody waits for.
inline WorkProgress& no_progress() {
  static WorkProgress nobody;
  return nobody;
}

}  // namespace viwo
