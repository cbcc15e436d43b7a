// The runs of an experiment that are done, on disk, so that an interrupted one can be continued.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "viwo/files/files.hpp"
#include "viwo/run/run.hpp"

namespace viwo::experiment {

/// What has to be the same for a run to be the same run.
struct RunKey {
  std::string variant, recording;
  std::uint64_t seed = 1;
  std::string configuration;  ///< all that decides the result, as text
};

/// One file per run, `journal/<variant>,<recording>,<seed>.cbor` in the folder of the results: the
/// key and the record of the run as CBOR, then the CRC-32 of that, little-endian. Other files in
/// the folder are left alone.
class RunJournal {
 public:
  explicit RunJournal(const std::filesystem::path& results) : folder_(results / "journal") {}

  const std::filesystem::path& folder() const { return folder_; }

  /// Number of runs that are there, whatever they are.
  int size() const;

  /// Whether there is a file for the run, of this configuration or another.
  bool has(const RunKey& key) const;

  /// The run with this key. Nothing if there is none, or if its file is damaged or of another key.
  std::optional<RunResult> read(const RunKey& key) const;

  /// All of it or nothing appears under its name. May be called from any thread for different keys.
  /// Throws std::runtime_error when it cannot be written.
  void write(const RunKey& key, const RunResult& run) const;

  /// From now on the runs are those of shards, perhaps of many machines: nobody discards them by a
  /// word that is missing. Throws std::runtime_error when that cannot be written.
  void keep_for_shards() const;
  bool is_of_shards() const;

  /// Removes the files of runs, and the folder if nothing else is in it.
  void remove() const;

  /// Throws InputError for a folder that is a link: what is in it may be somebody else's.
  void require_own_folder() const { files::require_no_link(folder_); }

 private:
  std::filesystem::path file_of(const RunKey& key) const;

  std::filesystem::path folder_;
};

}  // namespace viwo::experiment
