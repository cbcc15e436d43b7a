// What the library of window and video gives to the program.
#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "viwo/view/show.hpp"

namespace viwo::view {

struct ShowLibrary {
  std::unique_ptr<Screen> (*open_screen)(const std::string& title);
  std::unique_ptr<Film> (*open_film)(const std::filesystem::path& file);
};

/// The one name that it exports, a `const ShowLibrary*()`. Program and library are of one build.
inline constexpr const char* kShowLibraryEntry = "viwo_show_library";

}  // namespace viwo::view
