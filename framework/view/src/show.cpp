#include "viwo/view/show.hpp"

#include "show/show_library.hpp"
#include "viwo/plugin_host/part.hpp"

namespace viwo::view {
namespace {

/// Stays until the process ends, as a toolkit wants it.
const ShowLibrary& library() {
  static const ShowLibrary* const kLibrary = reinterpret_cast<const ShowLibrary* (*)()>(
      load_part("libviwo_show.so", kShowLibraryEntry, "window and video cannot be had",
                "it comes with the Debian package viwo-show"))();
  return *kLibrary;
}

}  // namespace

std::unique_ptr<Screen> open_screen(const std::string& title) {
  return library().open_screen(title);
}

std::unique_ptr<Film> open_film(const std::filesystem::path& file) {
  return library().open_film(file);
}

}  // namespace viwo::view
