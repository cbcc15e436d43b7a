#include "viwo/log/estimate_log.hpp"

#include <stdexcept>

#include <dlfcn.h>

#include "viwo/api/rejections.hpp"
#include "viwo/api/status.hpp"
#include "viwo/log/files.hpp"

namespace viwo::log {
namespace {

/// viwo/libviwo_mcap.so beside libviwo_api.so, where it is built as where it is installed.
EstimateLogMaker mcap_library() {
  Dl_info api{};
  if (dladdr(reinterpret_cast<void*>(&stamp_text), &api) == 0 || api.dli_fname == nullptr) {
    throw std::runtime_error("libviwo_api.so cannot be found");
  }
  const auto file =
      std::filesystem::absolute(api.dli_fname).parent_path() / "viwo" / "libviwo_mcap.so";
  void* handle = dlopen(file.c_str(), RTLD_NOW | RTLD_LOCAL | RTLD_NODELETE);
  void* entry = handle != nullptr ? dlsym(handle, kMcapLibraryEntry) : nullptr;
  if (entry == nullptr) {
    throw InputError(
        std::string("--mcap: MCAP cannot be written: ") + dlerror() +
        " (it comes with the Debian package viwo-ros; a build of one's own needs libsqlite3-dev, "
        "libfastcdr-dev, liblz4-dev and libzstd-dev)");
  }
  return reinterpret_cast<EstimateLogMaker>(entry);
}

}  // namespace

std::unique_ptr<EstimateLog> open_mcap(const std::filesystem::path& file) {
  const EstimateLogMaker make = mcap_library();
  try {
    if (file.has_parent_path()) make_folder(file.parent_path());
    return std::unique_ptr<EstimateLog>(make(file));
  } catch (const std::runtime_error& error) {
    throw InputError(std::string("--mcap: ") + error.what());
  }
}

}  // namespace viwo::log
