#include "viwo/config/regular_file.hpp"

#include <system_error>

#include "viwo/api/status.hpp"

namespace viwo::config {

void require_regular_file(const std::filesystem::path& file) {
  namespace fs = std::filesystem;
  std::error_code ignored;
  switch (fs::status(file, ignored).type()) {
    case fs::file_type::directory:
      throw InputError(file.string() + "  is a folder, not a file");
    case fs::file_type::fifo:
    case fs::file_type::socket:
      throw InputError(file.string() + "  is a pipe, not a file");
    case fs::file_type::character:
    case fs::file_type::block:
      throw InputError(file.string() + "  is a device, not a file");
    default:  // whether it is there shows when it is opened
      return;
  }
}

void require_file_of_key(const std::string& key, const Node& node,
                         const std::filesystem::path& file) {
  std::error_code ignored;
  if (std::filesystem::status(file, ignored).type() != std::filesystem::file_type::not_found)
    return;
  fail(node.mark(), key + ": no such file: " + file.lexically_normal().string());
}

}  // namespace viwo::config
