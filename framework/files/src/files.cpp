#include "viwo/files/files.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdio>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <system_error>
#include <utility>

#include <fcntl.h>
#include <unistd.h>

#include "viwo/api/status.hpp"
#include "viwo/files/delayed_signals.hpp"
#include "viwo/math/utf8.hpp"

namespace viwo::files {
namespace {

/// Not all file systems can for folders, nor all files that are none.
bool sync(int fd) { return ::fsync(fd) == 0 || errno == EINVAL || errno == EROFS; }

/// A file, or the names in a folder.
bool sync(const std::filesystem::path& path, int flags) {
  const int fd = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | flags);
  if (fd < 0) return false;
  const bool well = sync(fd);
  const int error = errno;
  ::close(fd);
  errno = error;
  return well;
}

bool sync_folder(const std::filesystem::path& folder) {
  return sync(folder.empty() ? "." : folder, O_DIRECTORY);
}

[[noreturn]] void fail(const std::filesystem::path& file) {
  throw std::runtime_error("cannot write " + file.string() + ": " +
                           std::generic_category().message(errno));
}

}  // namespace

std::string this_process() {
  std::array<char, 256> host{};
  if (::gethostname(host.data(), host.size() - 1) != 0) host[0] = '\0';
  return "." + std::to_string(::getpid()) + "@" + host.data();
}

void make_folder(const std::filesystem::path& folder) {
  std::error_code error, ignored;
  std::vector<std::filesystem::path> changed;  // folders that get a new one
  for (std::filesystem::path at = folder; !at.empty() && !std::filesystem::exists(at, ignored);) {
    at = at.parent_path();
    changed.push_back(at);
  }
  std::filesystem::create_directories(folder, error);
  if (error) {
    throw std::runtime_error("cannot create the folder " + folder.string() + ": " +
                             error.message());
  }
  for (const std::filesystem::path& at : changed) {
    if (sync_folder(at) || errno == EACCES) continue;  // one may be written and not be read
    throw std::runtime_error("cannot create the folder " + folder.string() + ": " +
                             std::generic_category().message(errno));
  }
}

void sync_to_disk(const std::filesystem::path& path) {
  if (!sync(path.empty() ? "." : path, 0)) fail(path);
}

void require_no_link(const std::filesystem::path& folder) {
  std::error_code ignored;
  if (!std::filesystem::is_symlink(std::filesystem::symlink_status(folder, ignored))) return;
  throw InputError(folder.string() +
                   "  is a link; results are kept in a folder of their own - remove it");
}

std::filesystem::path make_folder_in(const std::filesystem::path& folder, const std::string& name) {
  make_folder(folder);
  require_no_link(folder / name);
  make_folder(folder / name);
  return folder / name;
}

void remove_results(const std::filesystem::path& folder, std::initializer_list<const char*> names) {
  for (const char* const name : names) {
    std::error_code ignored;  // what cannot be removed cannot be replaced either, which is told
    if (std::filesystem::is_regular_file(folder / name, ignored)) {
      std::filesystem::remove(folder / name, ignored);
    }
  }
}

FileWriter::FileWriter(std::filesystem::path file, Appears appears)
    : file_(std::move(file)), unfinished_(file_) {
  std::error_code ignored;
  if (std::filesystem::is_other(file_, ignored)) {
    // A pipe that nobody reads is an error, not something to wait for.
    fd_ = ::open(file_.c_str(), O_WRONLY | O_NONBLOCK | O_CLOEXEC);
    if (fd_ < 0 || ::fcntl(fd_, F_SETFL, 0) != 0) fail();
    return;
  }
  if (appears == Appears::kWholeBesideOthers) unfinished_ += this_process();
  if (appears != Appears::kAtOnce) unfinished_ += ".tmp";
  // What is there is not written into: it may be a link to a file that is none of the results.
  ::unlink(unfinished_.c_str());
  fd_ = ::open(unfinished_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
  if (fd_ < 0) fail();
}

FileWriter::FileWriter(FileWriter&& other) noexcept
    : file_(std::move(other.file_)),
      unfinished_(std::move(other.unfinished_)),
      fd_(std::exchange(other.fd_, -1)) {}

FileWriter::~FileWriter() {
  if (fd_ < 0) return;
  ::close(fd_);
  if (unfinished_ != file_) ::unlink(unfinished_.c_str());
}

void FileWriter::fail() {
  const std::string reason = std::generic_category().message(errno);
  if (fd_ >= 0) ::close(std::exchange(fd_, -1));
  if (unfinished_ != file_) ::unlink(unfinished_.c_str());
  throw std::runtime_error("cannot write " + file_.string() + ": " + reason);
}

void FileWriter::write(std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t written = ::write(fd_, bytes.data(), bytes.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) fail();
    bytes.remove_prefix(static_cast<std::size_t>(written));
  }
}

void FileWriter::commit() {
  // What is written late may fail late.
  if (!sync(fd_) || ::close(std::exchange(fd_, -1)) != 0) fail();
  if (unfinished_ == file_) return;
  if (::rename(unfinished_.c_str(), file_.c_str()) != 0) fail();
  if (!sync_folder(file_.parent_path())) fail();
}

void write_bytes(const std::filesystem::path& file, std::string_view bytes, Appears appears) {
  FileWriter out(file, appears);
  out.write(bytes);
  out.commit();
}

void write_text(const std::filesystem::path& file, std::string_view text, Appears appears) {
  write_bytes(file, valid_utf8(text), appears);
}

NewResults::NewResults(const std::filesystem::path& folder)
    : folder_(folder), new_(folder / kUnfinishedResults) {
  make_folder(folder_);
  std::error_code ignored;  // of a command that was killed
  std::filesystem::remove_all(new_, ignored);
  make_folder(new_);
}

NewResults::~NewResults() {
  std::error_code ignored;
  std::filesystem::remove_all(new_, ignored);
}

std::vector<std::string> NewResults::names_of_new() const {
  std::vector<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(new_)) {
    names.push_back(entry.path().filename().string());
  }
  std::sort(names.begin(), names.end());
  return names;
}

void NewResults::commit(std::initializer_list<const char*> names) {
  const DelayedSignals until_all_are_there;
  std::vector<std::string> files = names_of_new();
  // What cannot be replaced shows before anything is.
  for (const std::string& name : files) write_to_device(name);
  files = names_of_new();
  const auto rank = [&](const std::string& name) {
    return std::find(names.begin(), names.end(), name) - names.begin();
  };
  std::stable_sort(files.begin(), files.end(),
                   [&](const std::string& a, const std::string& b) { return rank(a) > rank(b); });
  for (const char* const name : names) {  // nothing of before is beside what is new
    std::error_code error;
    if (!std::filesystem::is_regular_file(folder_ / name, error)) continue;
    if (std::filesystem::remove(folder_ / name, error)) continue;
    errno = error.value();
    fail(folder_ / name);
  }
  for (const std::string& name : files) {
    if (name == files.back() && !sync_folder(folder_)) fail(folder_);
    if (::rename((new_ / name).c_str(), (folder_ / name).c_str()) != 0) fail(folder_ / name);
  }
  if (!sync_folder(folder_)) fail(folder_);
}

void NewResults::write_to_device(const std::string& name) const {
  const std::filesystem::path target = folder_ / name;
  std::error_code ignored;
  if (std::filesystem::is_directory(target, ignored)) {
    errno = EISDIR;
    fail(target);
  }
  if (!std::filesystem::is_other(target, ignored)) return;
  std::ifstream in(new_ / name, std::ios::binary);
  write_bytes(target, std::string{std::istreambuf_iterator<char>(in), {}});
  std::filesystem::remove(new_ / name);
}

}  // namespace viwo::files
