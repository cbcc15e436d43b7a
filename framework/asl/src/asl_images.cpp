#include "viwo/asl/asl_images.hpp"

#include <algorithm>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>
#include <vector>

#include "viwo/api/status.hpp"
#include "viwo/asl/asl_columns.hpp"
#include "viwo/image/image_file.hpp"
#include "viwo/log/stamp_filter.hpp"
#include "viwo/log/table_reader.hpp"
#include "viwo/log/text.hpp"

namespace viwo::log {
namespace {

namespace fs = std::filesystem;

/// What there is instead of a folder that is missing.
std::string folders_beside(const fs::path& missing) {
  std::vector<std::string> names;
  std::error_code ignored;
  for (const auto& entry : fs::directory_iterator(missing.parent_path(), ignored)) {
    if (entry.is_directory(ignored)) names.push_back(entry.path().filename().string());
  }
  std::sort(names.begin(), names.end());
  return names.empty() ? std::string() : did_you_mean(missing.filename().string(), names);
}

/// The table of one camera.
class CameraTable {
 public:
  CameraTable(const fs::path& folder, int camera, const LogLimits& limits)
      : folder_(folder), camera_(camera), limits_(limits), filter_(limits) {
    std::error_code ignored;
    if (!fs::is_directory(folder, ignored)) {
      throw InputError(folder.string() + "  there is no such folder of images" +
                       folders_beside(folder));
    }
  }

  void read(ImageRecording& out) {
    TableReader table(table_in(folder_, "data.csv"));
    const std::size_t stamp = stamp_column(table, "timestamp [ns]");
    const std::size_t name = table.column("filename");
    while (table.next()) {
      ++rows_;
      const std::int64_t t_ns = table.stamp_ns(stamp);
      const fs::path file = folder_ / "data" / image_name(table, name);
      std::error_code ignored;
      if (!fs::is_regular_file(file, ignored)) {
        miss(file, table.reader());
      } else if (filter_.accept(t_ns, table.reader())) {
        out.samples.push_back({t_ns, camera_, std::make_shared<const ImageFile>(file)});
      }
    }
    require_enough_files(table.reader());
    filter_.finish(table.reader());
    report(out);
  }

 private:
  void miss(const fs::path& file, const TextReader& at) {
    filter_.reject(kNoImageFile, at);
    ++missing_;
    if (!first_missing_.empty()) return;
    first_missing_ = file;
    first_missing_line_ = at.line_number();
    first_row_missing_ = rows_ == 1;
  }

  void require_enough_files(const TextReader& at) const {
    const double fraction =
        rows_ > 0 ? static_cast<double>(missing_) / static_cast<double>(rows_) : 0.;
    if (!first_row_missing_ && fraction <= limits_.max_rejected_fraction) return;
    throw InputError(at.file().string() + ":" + std::to_string(first_missing_line_) +
                     "  the image " + first_missing_.string() + " is missing (" +
                     std::to_string(missing_) + " of " + std::to_string(rows_) +
                     " images of this camera are)");
  }

  /// Tables of cameras have the same name: say which one.
  void report(ImageRecording& out) const {
    for (RejectionCount count : filter_.counts()) {
      count.first = folder_.filename().string() + "/" + count.first;
      if (count.reason == kNoImageFile) {
        count.first += " (" + first_missing_.filename().string() + ")";
      }
      out.rejections.push_back(std::move(count));
    }
  }

  fs::path folder_;
  int camera_;
  LogLimits limits_;
  StampFilter filter_;
  std::int64_t rows_ = 0;
  std::int64_t missing_ = 0;
  fs::path first_missing_;
  std::int64_t first_missing_line_ = 0;
  bool first_row_missing_ = false;
};

}  // namespace

fs::path image_name(const TableReader& table, std::size_t column) {
  if (table.text(column).empty()) table.fail(column, "is empty");
  if (table.text(column).find('\0') != std::string_view::npos) {  // another file would be opened
    table.fail(column, quoted(table.text(column)) + " has a zero byte");
  }
  fs::path name = table.text(column);
  if (name.is_absolute() || std::find(name.begin(), name.end(), "..") != name.end()) {
    table.fail(column, quoted(table.text(column)) + " leads out of the folder of the images");
  }
  return name;
}

ImageRecording read_asl_images(std::span<const fs::path> folders, const LogLimits& limits) {
  ImageRecording out;
  for (std::size_t camera = 0; camera < folders.size(); ++camera) {
    CameraTable(folders[camera], static_cast<int>(camera), limits).read(out);
  }
  std::stable_sort(out.samples.begin(), out.samples.end(),
                   [](const ImageSample& a, const ImageSample& b) { return a.t_ns < b.t_ns; });
  return out;
}

}  // namespace viwo::log
