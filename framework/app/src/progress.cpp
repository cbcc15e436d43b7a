#include "progress.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <utility>

#include <unistd.h>

#include "viwo/log/text.hpp"

namespace viwo::app {
namespace {

/// One line that replaces itself: "what [####....] text, about 3 s left".
/// `left_s` is negative when nothing is known about it.
void draw_bar(const std::string& what, double fraction, const std::string& text, double left_s) {
  constexpr int kWidth = 30;
  std::string bar(static_cast<std::size_t>(kWidth * std::clamp(fraction, 0., 1.)), '#');
  bar.resize(kWidth, '.');
  std::fprintf(stderr, "\r\033[K%s [%s] %s", log::printable(what).c_str(), bar.c_str(),
               log::printable(text).c_str());
  if (left_s >= 0.) std::fprintf(stderr, ", about %.0f s left", std::ceil(left_s));
  std::fflush(stderr);
}

}  // namespace

Progress::Progress()
    : terminal_(isatty(STDERR_FILENO) != 0), start_(std::chrono::steady_clock::now()) {}

Progress::~Progress() {
  if (terminal_ && total_ > 0) std::fprintf(stderr, "\r\033[K");
}

void Progress::begin(const std::string& what, int total) {
  const std::lock_guard lock(mutex_);
  what_ = what;
  total_ = total;
  count_ = skipped_ = 0;
  start_ = std::chrono::steady_clock::now();
  if (terminal_) draw();
}

void Progress::skipped(int count, const std::string& line) {
  const std::lock_guard lock(mutex_);
  skipped_ += count;
  count_ += count;
  show(line);
}

void Progress::done(const std::string& line) {
  const std::lock_guard lock(mutex_);
  ++count_;
  show(line);
}

void Progress::note(const std::string& line) {
  const std::lock_guard lock(mutex_);
  std::fprintf(stderr, terminal_ ? "\r\033[K%s\n" : "%s\n", log::printable(line).c_str());
  if (terminal_) draw();
}

void Progress::show(const std::string& line) const {
  if (!terminal_) {
    std::fprintf(stderr, "[%d/%d] %s\n", count_, total_, log::printable(line).c_str());
    return;
  }
  std::fprintf(stderr, "\r\033[K%s\n", log::printable(line).c_str());
  draw();
}

void Progress::draw() const {
  const std::chrono::duration<double> spent = std::chrono::steady_clock::now() - start_;
  const double fraction = total_ > 0 ? static_cast<double>(count_) / total_ : 1.;
  const int done = count_ - skipped_;
  const double left_s = done > 0 ? spent.count() / done * (total_ - count_) : -1.;
  draw_bar(what_, fraction, std::to_string(count_) + "/" + std::to_string(total_), left_s);
}

TimeProgress::TimeProgress(std::string what)
    : what_(std::move(what)),
      terminal_(isatty(STDERR_FILENO) != 0),
      start_(Clock::now()),
      next_(start_ + std::chrono::seconds(1)) {}

TimeProgress::~TimeProgress() {
  if (drawn_) std::fprintf(stderr, "\r\033[K");
}

void TimeProgress::at(double fraction) {
  const Clock::time_point now = Clock::now();
  if (now < next_ || !(fraction >= 0.)) return;
  const int percent = static_cast<int>(100. * std::min(fraction, 1.));
  const std::string text = std::to_string(percent) + " %";
  if (terminal_) {
    const double spent_s = std::chrono::duration<double>(now - start_).count();
    draw_bar(what_, percent / 100., text, fraction > 0. ? spent_s * (1. / fraction - 1.) : -1.);
    drawn_ = true;
    next_ = now + std::chrono::milliseconds(100);
  } else if (percent >= shown_percent_ + 10) {
    std::fprintf(stderr, "%s: %s\n", what_.c_str(), text.c_str());
    shown_percent_ = percent - percent % 10;
    next_ = now + std::chrono::seconds(1);
  }
}

}  // namespace viwo::app
