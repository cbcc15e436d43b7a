#include "show_library.hpp"

#include "video_file.hpp"
#include "window.hpp"

extern "C" __attribute__((visibility("default"))) const viwo::view::ShowLibrary*
viwo_show_library() {
  using namespace viwo::view;
  static constexpr ShowLibrary kLibrary{
      [](const std::string& title) -> std::unique_ptr<Screen> {
        return std::make_unique<Window>(title);
      },
      [](const std::filesystem::path& file) -> std::unique_ptr<Film> {
        return std::make_unique<VideoFile>(file);
      }};
  return &kLibrary;
}
