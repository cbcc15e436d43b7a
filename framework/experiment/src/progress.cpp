#include "viwo/experiment/progress.hpp"

#include <cmath>
#include <cstdio>
#include <utility>

#include <unistd.h>

namespace viwo::experiment {

Progress::Progress(std::string what, int total)
    : what_(std::move(what)),
      total_(total),
      terminal_(isatty(STDERR_FILENO) != 0),
      start_(std::chrono::steady_clock::now()) {
  if (terminal_) draw();
}

Progress::~Progress() {
  if (terminal_) std::fprintf(stderr, "\r\033[K");
}

void Progress::done(const std::string& line) {
  const std::lock_guard lock(mutex_);
  ++count_;
  if (!terminal_) {
    std::fprintf(stderr, "[%d/%d] %s\n", count_, total_, line.c_str());
    return;
  }
  std::fprintf(stderr, "\r\033[K%s\n", line.c_str());
  draw();
}

void Progress::draw() const {
  constexpr int kWidth = 30;
  const std::chrono::duration<double> spent = std::chrono::steady_clock::now() - start_;
  const int filled = total_ > 0 ? kWidth * count_ / total_ : kWidth;
  std::string bar(static_cast<std::size_t>(filled), '#');
  bar.resize(kWidth, '.');
  std::fprintf(stderr, "\r\033[K%s [%s] %d/%d", what_.c_str(), bar.c_str(), count_, total_);
  if (count_ > 0) {
    const double left_s = spent.count() / count_ * (total_ - count_);
    std::fprintf(stderr, ", about %.0f s left", std::ceil(left_s));
  }
  std::fflush(stderr);
}

}  // namespace viwo::experiment
