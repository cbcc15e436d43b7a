// Folders and whole files. What cannot be written completely is an error (std::runtime_error),
// never a silent loss.
#pragma once

#include <filesystem>
#include <initializer_list>
#include <string>
#include <string_view>
#include <vector>

#include "viwo/config/regular_file.hpp"

namespace viwo::files {

/// And those that it lies in; they are there after a loss of power, too.
void make_folder(const std::filesystem::path& folder);

/// A file that others have written, or the names in a folder, are there after a loss of power, too.
void sync_to_disk(const std::filesystem::path& path);

/// A folder of its own in that of the results. InputError for a link: what is there may be somebody
/// else's.
std::filesystem::path make_folder_in(const std::filesystem::path& folder, const std::string& name);
void require_no_link(const std::filesystem::path& folder);

/// Results of an earlier command, files of these names, do not stand beside those of this one where
/// it has none.
void remove_results(const std::filesystem::path& folder, std::initializer_list<const char*> names);

using config::require_regular_file;

/// When what is written is under the name of the file.
enum class Appears {
  kWhole,  ///< all of it, once it is on the disk; what is no file (a device, a pipe) at once
  kWholeBesideOthers,  ///< the same, of a file that others write, too
  kAtOnce,             ///< as it is written: what has been stays when the process is killed
};

/// ".PROCESS@HOST", of processes on all machines that share a file system.
std::string this_process();

/// A file that is written, in place of what was there; a link is replaced, not followed, unless it
/// leads to a device or a pipe. One that appears whole is FILE.tmp until commit(), beside others
/// FILE.PROCESS@HOST.tmp, and goes if nobody commits.
class FileWriter {
 public:
  explicit FileWriter(std::filesystem::path file, Appears appears = Appears::kWhole);
  ~FileWriter();
  FileWriter(FileWriter&& other) noexcept;
  FileWriter& operator=(FileWriter&&) = delete;

  void write(std::string_view bytes);
  /// It is on the disk, under its name.
  void commit();

 private:
  [[noreturn]] void fail();

  std::filesystem::path file_, unfinished_;
  int fd_;
};

/// All of it or nothing new is there under the name, also after a loss of power.
void write_bytes(const std::filesystem::path& file, std::string_view bytes,
                 Appears appears = Appears::kWhole);

/// The same; what is not UTF-8 becomes U+FFFD, so that others can read every text that viwo writes.
void write_text(const std::filesystem::path& file, std::string_view text,
                Appears appears = Appears::kWhole);

/// The folder of results that are not all there yet; what else is in it goes.
inline constexpr const char* kUnfinishedResults = "unfinished.tmp";

/// Results that take the place of those before: all of them, or, on a full disk, none, and those
/// before stay. Until commit() they lie in a folder of their own, FOLDER/unfinished.tmp, which goes
/// if nobody commits. Nobody else may write results there at the time (FolderLock).
class NewResults {
 public:
  explicit NewResults(const std::filesystem::path& folder);
  ~NewResults();
  NewResults(const NewResults&) = delete;
  NewResults& operator=(const NewResults&) = delete;

  /// The file to be written for that of this name, and the folder of all of them.
  std::filesystem::path file(const char* name) const { return new_ / name; }
  const std::filesystem::path& folder() const { return new_; }

  /// Files of these names that are not new this time go, too. The first of them is there last: who
  /// finds it finds all. SIGINT, SIGTERM and SIGHUP wait until then.
  void commit(std::initializer_list<const char*> names);

 private:
  std::vector<std::string> names_of_new() const;
  /// What is no file (a device, a pipe) takes it at once.
  void write_to_device(const std::string& name) const;

  std::filesystem::path folder_, new_;
};

}  // namespace viwo::files
