// Where pictures go while a run goes on: a window on the screen, a video file. What they need of
// OpenCV (a toolkit, video codecs) is a library that is loaded when one is opened.
#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "viwo/view/picture.hpp"

namespace viwo::view {

/// A window on the screen. All calls from one thread; one in a process at a time.
class Screen {
 public:
  virtual ~Screen() = default;
  /// Until the user has closed it, or typed q or escape in it.
  virtual bool open() const = 0;
  /// Whether a picture is worth making: the window is open and has shown the last one for long
  /// enough to be seen (25 pictures in a second).
  virtual bool due() const = 0;
  /// Shows a picture at once and looks what the user wants.
  virtual void show(const Picture& picture) = 0;
};

/// A video file; without close() nothing is left behind.
class Film {
 public:
  virtual ~Film() = default;
  /// The next picture, taken at `t_s`; all are of one size (std::invalid_argument). The pictures of
  /// a second follow from the first eleven: the median of the times between them. Never fails
  /// because of the disk: close() tells.
  virtual void add(const Picture& picture, double t_s) = 0;
  /// Ends the video; without any picture there is none. std::runtime_error when not all of it could
  /// be written; then there is no file.
  virtual void close() = 0;
};

/// The window appears with the first picture. Throws InputError without a screen: when neither
/// DISPLAY nor WAYLAND_DISPLAY is set, or when no window can be opened there.
std::unique_ptr<Screen> open_screen(const std::string& title);

/// `file` ends in .mp4 (MPEG-4) or .avi (Motion JPEG); its folder is made if need be. Throws
/// InputError for other endings, for what is there and is no video of a run, and when a video
/// cannot be written there.
std::unique_ptr<Film> open_film(const std::filesystem::path& file);

}  // namespace viwo::view
