#include "run_journal.hpp"

#include <fstream>
#include <iterator>
#include <stdexcept>
#include <system_error>
#include <vector>

#include "checksum.hpp"
#include "viwo/log/files.hpp"
#include "viwo/results/run_record.hpp"

namespace viwo::experiment {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kExtension = ".cbor";
constexpr std::string_view kUnfinished = ".cbor.tmp";
constexpr std::size_t kChecksumBytes = 4;

std::string checksum(std::string_view bytes) {
  const std::uint32_t crc = crc_of(bytes);
  std::string text;
  for (std::size_t i = 0; i < kChecksumBytes; ++i) {
    text.push_back(static_cast<char>((crc >> (8 * i)) & 0xff));
  }
  return text;
}

/// Files of runs in the folder, complete or not.
std::vector<fs::path> files_in(const fs::path& folder, bool unfinished) {
  std::vector<fs::path> files;
  std::error_code error;
  for (fs::directory_iterator at(folder, error), end; !error && at != end; at.increment(error)) {
    const std::string name = at->path().filename().string();
    if (name.ends_with(kExtension) || (unfinished && name.ends_with(kUnfinished))) {
      files.push_back(at->path());
    }
  }
  return files;
}

}  // namespace

// Names of variants and recordings have no comma.
fs::path RunJournal::file_of(const RunKey& key) const {
  return folder_ / (key.variant + "," + key.recording + "," + std::to_string(key.seed) +
                    std::string(kExtension));
}

int RunJournal::size() const { return static_cast<int>(files_in(folder_, false).size()); }

std::optional<RunResult> RunJournal::read(const RunKey& key) const {
  std::ifstream in(file_of(key), std::ios::binary);
  std::string bytes{std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
  if (bytes.size() < kChecksumBytes) return std::nullopt;
  const std::string expected = bytes.substr(bytes.size() - kChecksumBytes);
  bytes.resize(bytes.size() - kChecksumBytes);
  if (checksum(bytes) != expected) return std::nullopt;
  try {
    const nlohmann::json entry = nlohmann::json::from_cbor(bytes);
    if (entry.at("variant") != key.variant || entry.at("recording") != key.recording ||
        entry.at("seed") != key.seed || entry.at("configuration") != key.configuration) {
      return std::nullopt;
    }
    return from_record(entry.at("run"));
  } catch (const std::exception&) {
    return std::nullopt;
  }
}

void RunJournal::write(const RunKey& key, const RunResult& run) const {
  log::make_folder(folder_);
  const nlohmann::json entry = {{"variant", key.variant},
                                {"recording", key.recording},
                                {"seed", key.seed},
                                {"configuration", key.configuration},
                                {"run", to_record(run)}};
  std::string bytes;
  nlohmann::json::to_cbor(entry, bytes);
  bytes += checksum(bytes);
  log::write_bytes(file_of(key), bytes);
}

void RunJournal::remove() const {
  std::error_code ignored;  // what stays is a file too many, not a wrong result
  for (const fs::path& file : files_in(folder_, true)) fs::remove(file, ignored);
  fs::remove(folder_, ignored);
}

}  // namespace viwo::experiment
