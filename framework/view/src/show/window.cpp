#include "window.hpp"

#include <cstdlib>
#include <utility>

#include <fcntl.h>
#include <opencv2/highgui.hpp>
#include <sys/wait.h>
#include <unistd.h>

#include "canvas.hpp"
#include "viwo/api/status.hpp"
#include "viwo/files/time_limit.hpp"

namespace viwo::view {
namespace {

constexpr std::chrono::milliseconds kShownFor(40);
constexpr int kWindowFlags = cv::WINDOW_AUTOSIZE | cv::WINDOW_GUI_NORMAL;
constexpr int kEscape = 27;
constexpr unsigned kMostSecondsToOpen = 20;

bool is_set(const char* variable) {
  const char* value = std::getenv(variable);
  return value != nullptr && *value != '\0';
}

/// Tries it in a process of its own: a toolkit that finds no screen ends its process.
bool window_can_be_opened() {
  // A toolkit that has its screen does not work in a process that is split off.
  static bool could_before = false;
  if (could_before) return true;
  const pid_t child = fork();
  if (child < 0) return false;
  if (child == 0) {
    files::end_after(kMostSecondsToOpen);
    const int nowhere = ::open("/dev/null", O_WRONLY);
    dup2(nowhere, STDERR_FILENO);
    try {
      cv::namedWindow("viwo", kWindowFlags);
    } catch (...) {
      _exit(1);
    }
    _exit(0);
  }
  int status = 0;
  could_before =
      waitpid(child, &status, 0) == child && WIFEXITED(status) && WEXITSTATUS(status) == 0;
  return could_before;
}

}  // namespace

Window::Window(std::string title) : title_(std::move(title)) {
  if (!is_set("DISPLAY") && !is_set("WAYLAND_DISPLAY")) {
    throw InputError(
        "no screen to show pictures on: neither DISPLAY nor WAYLAND_DISPLAY is set; a video file "
        "needs no screen");
  }
  if (!window_can_be_opened()) {
    throw InputError("no window can be opened on the screen '" +
                     std::string(std::getenv(is_set("DISPLAY") ? "DISPLAY" : "WAYLAND_DISPLAY")) +
                     "'; a video file needs no screen");
  }
}

Window::~Window() {
  if (!open_ || !made_) return;
  try {
    cv::destroyWindow(title_);
  } catch (const cv::Exception&) {
    // It is gone already.
  }
}

bool Window::due() const { return open_ && std::chrono::steady_clock::now() - last_ >= kShownFor; }

void Window::show(const Picture& picture) {
  if (!open_) return;
  if (!made_) cv::namedWindow(title_, kWindowFlags);
  made_ = true;
  cv::imshow(title_, as_mat(picture));
  const int key = cv::waitKey(1);
  last_ = std::chrono::steady_clock::now();
  const bool typed = key >= 0 && ((key & 0xff) == 'q' || (key & 0xff) == kEscape);
  const bool closed = cv::getWindowProperty(title_, cv::WND_PROP_VISIBLE) < 1.;
  if (!typed && !closed) return;
  open_ = false;
  if (!closed) cv::destroyWindow(title_);
  cv::waitKey(1);  // lets it disappear
}

}  // namespace viwo::view
