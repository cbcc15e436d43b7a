#include "viwo/plugin_host/part.hpp"

#include <filesystem>
#include <stdexcept>

#include <dlfcn.h>

#include "viwo/api/rejections.hpp"

namespace viwo {

void* load_part(const std::string& library, const char* entry, const std::string& loss,
                const std::string& remedy) {
  Dl_info api{};
  if (dladdr(reinterpret_cast<void*>(&stamp_text), &api) == 0 || api.dli_fname == nullptr) {
    throw std::runtime_error("libviwo_api.so cannot be found");
  }
  const auto file = std::filesystem::absolute(api.dli_fname).parent_path() / "viwo" / library;
  void* handle = dlopen(file.c_str(), RTLD_NOW | RTLD_LOCAL | RTLD_NODELETE);
  void* function = handle != nullptr ? dlsym(handle, entry) : nullptr;
  if (function == nullptr) throw std::runtime_error(loss + ": " + dlerror() + " (" + remedy + ")");
  return function;
}

}  // namespace viwo
