// A window on the screen that shows pictures.
#pragma once

#include <chrono>
#include <string>

#include "viwo/view/picture.hpp"

namespace viwo::view {

/// Appears with the first picture. All calls from one thread; one window in a process at a time.
class Window {
 public:
  /// Throws InputError without a screen: when neither DISPLAY nor WAYLAND_DISPLAY is set, or when
  /// no window can be opened there.
  explicit Window(std::string title);
  ~Window();
  Window(const Window&) = delete;
  Window& operator=(const Window&) = delete;

  /// Until the user has closed it, or typed q or escape in it.
  bool open() const { return open_; }
  /// Whether a picture is worth making: the window is open and has shown the last one for long
  /// enough to be seen (25 pictures in a second).
  bool due() const;
  /// Shows a picture at once and looks what the user wants.
  void show(const Picture& picture);

 private:
  std::string title_;
  bool open_ = true;
  bool made_ = false;
  std::chrono::steady_clock::time_point last_{};
};

}  // namespace viwo::view
