#include "viwo/experiment/output.hpp"

#include <array>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <stdexcept>
#include <string_view>
#include <system_error>
#include <utility>

#include <fcntl.h>
#include <unistd.h>

namespace viwo::experiment {

void make_folder(const std::filesystem::path& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) {
    throw std::runtime_error("cannot create the folder " + folder.string() + ": " +
                             error.message());
  }
}

namespace {

/// Closed in any case.
class Descriptor {
 public:
  Descriptor(const std::filesystem::path& path, int flags)
      : fd_(::open(path.c_str(), flags | O_CLOEXEC, 0666)) {}
  ~Descriptor() {
    if (fd_ >= 0) ::close(fd_);
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;

  bool is_open() const { return fd_ >= 0; }

  bool write(std::string_view bytes) const {
    while (!bytes.empty()) {
      const ssize_t written = ::write(fd_, bytes.data(), bytes.size());
      if (written < 0 && errno == EINTR) continue;
      if (written < 0) return false;
      bytes.remove_prefix(static_cast<std::size_t>(written));
    }
    return true;
  }

  /// Not all file systems can for folders, nor all files that are none.
  bool sync() const { return ::fsync(fd_) == 0 || errno == EINVAL || errno == EROFS; }

  /// What is written late may fail late.
  bool close() { return ::close(std::exchange(fd_, -1)) == 0; }

 private:
  int fd_;
};

}  // namespace

void write_text(const std::filesystem::path& file, const std::string& text) {
  std::filesystem::path unfinished = file;
  unfinished += ".tmp";
  const std::filesystem::path folder = file.has_parent_path() ? file.parent_path() : ".";
  Descriptor out(unfinished, O_WRONLY | O_CREAT | O_TRUNC);
  if (out.is_open() && out.write(text) && out.sync() && out.close() &&
      ::rename(unfinished.c_str(), file.c_str()) == 0) {
    const Descriptor in(folder, O_RDONLY | O_DIRECTORY);
    if (in.is_open() && in.sync()) return;
  }
  const int error = errno;
  ::unlink(unfinished.c_str());
  throw std::runtime_error("cannot write " + file.string() + ": " +
                           std::generic_category().message(error));
}

nlohmann::json number_or_null(double value) {
  return std::isfinite(value) ? nlohmann::json(value) : nlohmann::json();
}

std::string significant(double value, int digits) {
  if (!std::isfinite(value)) return "-";
  std::array<char, 40> text{};
  std::snprintf(text.data(), text.size(), "%.*g", digits, value);
  return text.data();
}

const char* viwo_version() { return VIWO_VERSION; }

DisplayUnit display_unit(const std::string& si_unit, double magnitude) {
  const bool has_prefixes = si_unit == "m" || si_unit == "rad" || si_unit == "s" ||
                            si_unit == "m/s" || si_unit == "rad/s";
  if (has_prefixes && magnitude < 0.1) return {"m" + si_unit, 1e3};
  return {si_unit, 1.};
}

std::string with_unit(const std::string& heading, const std::string& unit) {
  return unit.empty() ? heading : heading + " [" + unit + "]";
}

namespace {

/// Every k-th index so that at most `max_points` remain, and the last.
template <class F>
void thinned(std::size_t size, std::size_t max_points, const F& take) {
  const std::size_t step = std::max<std::size_t>(1, (size + max_points - 1) / max_points);
  for (std::size_t i = 0; i < size; i += step) take(i);
  if (size > 0 && (size - 1) % step != 0) take(size - 1);
}

}  // namespace

namespace {

/// The band is around the curve, or around zero.
report::Series banded(const std::string& name, const CurveData& data, bool around_zero,
                      std::size_t max_points) {
  report::Series series;
  series.name = name;
  thinned(data.x.size(), max_points, [&](std::size_t i) {
    const double y = data.scale * data.y[i];
    series.x.push_back(data.x[i]);
    series.y.push_back(y);
    if (data.sigma.empty()) return;
    const double middle = around_zero ? 0. : y;
    const double band = kBandSigmas * data.scale * data.sigma[i];
    series.y_low.push_back(middle - band);
    series.y_high.push_back(middle + band);
  });
  return series;
}

}  // namespace

report::Series curve(const std::string& name, const CurveData& data, std::size_t max_points) {
  return banded(name, data, false, max_points);
}

report::Series error_curve(const std::string& name, const CurveData& data, std::size_t max_points) {
  return banded(name, data, true, max_points);
}

report::Series truth_line(double begin, double end, double truth) {
  report::Series series;
  series.name = "truth";
  series.reference = true;
  series.x = {begin, end};
  series.y = {truth, truth};
  return series;
}

report::Series trajectory_series(const std::string& name, const Trajectory& trajectory,
                                 std::size_t max_points) {
  report::Series series;
  series.name = name;
  series.group = name;
  thinned(trajectory.size(), max_points, [&](std::size_t i) {
    series.x.push_back(trajectory[i].p_BinW.x());
    series.y.push_back(trajectory[i].p_BinW.y());
  });
  return series;
}

report::Series error_series(const std::string& name, const eval::Accuracy& accuracy,
                            std::size_t max_points) {
  report::Series series;
  series.name = name;
  series.group = name;
  thinned(accuracy.series.path_length_m.size(), max_points, [&](std::size_t i) {
    series.x.push_back(accuracy.series.path_length_m[i]);
    series.y.push_back(1e3 * accuracy.series.position_error_m[i]);
  });
  return series;
}

}  // namespace viwo::experiment
