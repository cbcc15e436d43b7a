#include "run_journal.hpp"

#include <algorithm>
#include <new>
#include <stdexcept>
#include <system_error>
#include <vector>

#include "checksum.hpp"
#include "viwo/api/status.hpp"
#include "viwo/config/regular_file.hpp"
#include "viwo/files/files.hpp"
#include "viwo/results/run_record.hpp"

namespace viwo::experiment {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kExtension = ".cbor";
constexpr std::string_view kUnfinished = ".tmp";
constexpr const char* kOfShards = "of_shards";
constexpr std::size_t kChecksumBytes = 4;

std::string checksum(std::string_view bytes) {
  const std::uint32_t crc = crc_of(bytes);
  std::string text;
  for (std::size_t i = 0; i < kChecksumBytes; ++i) {
    text.push_back(static_cast<char>((crc >> (8 * i)) & 0xff));
  }
  return text;
}

/// VARIANT,RECORDING,SEED before the extension.
bool is_of_run(std::string_view name, std::string_view extension) {
  return name.ends_with(extension) && std::count(name.begin(), name.end(), ',') == 2;
}

/// Files of runs in the folder, complete or not; no folders.
std::vector<fs::path> files_in(const fs::path& folder, bool unfinished, std::error_code& error) {
  std::vector<fs::path> files;
  for (fs::directory_iterator at(folder, error), end; !error && at != end; at.increment(error)) {
    const std::string name = at->path().filename().string();
    if (!is_of_run(name, kExtension) && !(unfinished && is_of_run(name, kUnfinished))) continue;
    std::error_code ignored;
    if (!fs::is_directory(at->symlink_status(ignored))) files.push_back(at->path());
  }
  if (error == std::errc::no_such_file_or_directory) error.clear();
  return files;
}

/// None of what is too long for a run that was thinned.
std::string bytes_of(const fs::path& file) {
  constexpr std::uintmax_t kMostBytes = std::uintmax_t{64} << 20;
  config::RegularFile opened(file);
  const std::uintmax_t size = opened.size();
  std::string bytes(size <= kMostBytes ? size : 0, '\0');
  bytes.resize(opened.read(bytes));
  return bytes;
}

/// Takes everything but what lies too deep, and more values than a run has: for each level the
/// parser needs a part of the stack, for each value, which may be a byte, 16 bytes.
class Levels : public nlohmann::json_sax<nlohmann::json> {
 public:
  bool null() override { return add(); }
  bool boolean(bool /*value*/) override { return add(); }
  bool number_integer(number_integer_t /*value*/) override { return add(); }
  bool number_unsigned(number_unsigned_t /*value*/) override { return add(); }
  bool number_float(number_float_t /*value*/, const string_t& /*text*/) override { return add(); }
  bool string(string_t& /*value*/) override { return add(); }
  bool binary(binary_t& /*value*/) override { return add(); }
  bool start_object(std::size_t /*size*/) override { return add() && ++levels_ <= kMost; }
  bool key(string_t& /*value*/) override { return add(); }
  bool end_object() override { return --levels_ >= 0; }
  bool start_array(std::size_t /*size*/) override { return add() && ++levels_ <= kMost; }
  bool end_array() override { return --levels_ >= 0; }
  bool parse_error(std::size_t /*at*/, const std::string& /*token*/,
                   const nlohmann::json::exception& /*what*/) override {
    return false;
  }

 private:
  bool add() { return ++values_ <= kMostValues; }

  static constexpr int kMost = 32;                        ///< a record has less than ten
  static constexpr std::int64_t kMostValues = 8'000'000;  ///< days of epochs
  int levels_ = 0;
  std::int64_t values_ = 0;
};

}  // namespace

// Names of variants and recordings have no comma.
fs::path RunJournal::file_of(const RunKey& key) const {
  return folder_ / (key.variant + "," + key.recording + "," + std::to_string(key.seed) +
                    std::string(kExtension));
}

int RunJournal::size() const {
  std::error_code error;
  const std::size_t size = files_in(folder_, false, error).size();
  // What cannot be seen is not taken for empty, and replaced.
  if (error) throw std::runtime_error("cannot read " + folder_.string() + ": " + error.message());
  return static_cast<int>(size);
}

bool RunJournal::has(const RunKey& key) const {
  std::error_code ignored;
  return fs::exists(file_of(key), ignored);
}

std::optional<RunResult> RunJournal::read(const RunKey& key) const {
  try {
    const std::string all = bytes_of(file_of(key));
    if (all.size() < kChecksumBytes) return std::nullopt;
    const std::string bytes = all.substr(0, all.size() - kChecksumBytes);
    if (checksum(bytes) != all.substr(bytes.size())) return std::nullopt;
    Levels levels;
    if (!nlohmann::json::sax_parse(bytes, &levels, nlohmann::json::input_format_t::cbor)) {
      return std::nullopt;
    }
    const nlohmann::json entry = nlohmann::json::from_cbor(bytes);
    if (entry.at("variant") != key.variant || entry.at("recording") != key.recording ||
        entry.at("seed") != key.seed || entry.at("configuration") != key.configuration) {
      return std::nullopt;
    }
    return from_record(entry.at("run"));
  } catch (const std::bad_alloc&) {  // no fault of the record
    throw;
  } catch (const std::exception&) {
    return std::nullopt;
  }
}

void RunJournal::keep_for_shards() const {
  if (is_of_shards()) return;
  require_own_folder();
  files::make_folder(folder_);
  files::FileWriter(folder_ / kOfShards, files::Appears::kWholeBesideOthers).commit();
}

bool RunJournal::is_of_shards() const {
  std::error_code ignored;
  return fs::exists(folder_ / kOfShards, ignored);
}

void RunJournal::write(const RunKey& key, const RunResult& run) const {
  require_own_folder();
  files::make_folder(folder_);
  const nlohmann::json entry = {{"variant", key.variant},
                                {"recording", key.recording},
                                {"seed", key.seed},
                                {"configuration", key.configuration},
                                {"run", to_record(run)}};
  std::string bytes;
  nlohmann::json::to_cbor(entry, bytes);
  bytes += checksum(bytes);
  // The same shard may run twice.
  files::FileWriter out(file_of(key), files::Appears::kWholeBesideOthers);
  out.write(bytes);
  out.commit();
}

void RunJournal::remove() const {
  require_own_folder();
  std::error_code ignored;  // what stays is a file too many, not a wrong result
  for (const fs::path& file : files_in(folder_, true, ignored)) fs::remove(file, ignored);
  fs::remove(folder_ / kOfShards, ignored);  // last: what is left of a crash is still theirs
  fs::remove(folder_, ignored);
}

}  // namespace viwo::experiment
