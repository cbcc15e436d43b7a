// Folders and whole files. What cannot be written completely is an error (std::runtime_error),
// never a silent loss.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace viwo::log {

void make_folder(const std::filesystem::path& folder);

/// A file that has its name once it is whole and on the disk: until commit() it is FILE.tmp, which
/// goes if nobody commits. What is there and is no file (a device, a pipe) is written to at once.
class WholeFile {
 public:
  explicit WholeFile(std::filesystem::path file);
  ~WholeFile();
  WholeFile(WholeFile&& other) noexcept;
  WholeFile& operator=(WholeFile&&) = delete;

  void write(std::string_view bytes);
  void commit();

 private:
  [[noreturn]] void fail();

  std::filesystem::path file_, unfinished_;
  int fd_;
};

/// All of it or nothing new is there under the name, also after a loss of power.
void write_text(const std::filesystem::path& file, const std::string& text);

}  // namespace viwo::log
