#include "viwo/view/show.hpp"

#include <stdexcept>

#include <dlfcn.h>

#include "show/show_library.hpp"
#include "viwo/api/rejections.hpp"

namespace viwo::view {
namespace {

/// viwo/libviwo_show.so beside libviwo_api.so, where it is built as where it is installed.
std::filesystem::path library_file() {
  Dl_info api{};
  if (dladdr(reinterpret_cast<void*>(&stamp_text), &api) == 0 || api.dli_fname == nullptr) {
    throw std::runtime_error("libviwo_api.so cannot be found");
  }
  return std::filesystem::absolute(api.dli_fname).parent_path() / "viwo" / "libviwo_show.so";
}

/// Stays until the process ends, as a toolkit wants it.
const ShowLibrary& library() {
  static const ShowLibrary* const kLibrary = [] {
    const std::filesystem::path file = library_file();
    void* handle = dlopen(file.c_str(), RTLD_NOW | RTLD_LOCAL | RTLD_NODELETE);
    void* entry = handle != nullptr ? dlsym(handle, kShowLibraryEntry) : nullptr;
    if (entry == nullptr) {
      throw std::runtime_error(std::string("window and video cannot be had: ") + dlerror() +
                               " (it comes with the Debian package viwo-show)");
    }
    return reinterpret_cast<const ShowLibrary* (*)()>(entry)();
  }();
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
