// Sensor kaist_urban: IMU, wheel encoders, stereo images and reference poses of a sequence of the
// KAIST Complex Urban dataset (model.md).
#include <algorithm>
#include <array>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <optional>
#include <string>
#include <system_error>
#include <tuple>
#include <type_traits>
#include <utility>
#include <vector>

#include "sequence.hpp"
#include "viwo/api/plugin.hpp"
#include "viwo/log/sensor_params.hpp"
#include "viwo/log/text.hpp"
#include "viwo/math/stamp.hpp"

namespace viwo {
namespace {

struct Params : log::JointParams, log::LimitParams {
  std::filesystem::path path;
  bool imu = true;
  bool wheels = true;
  bool images = true;
  bool reference = true;
  int encoder_resolution = 0;
  double start_s = 0.;
  double duration_s = 0.;

  void bind(ParamBinder& b) {
    b(VIWO_PARAM(path),
      {.required = true,
       .help = "folder of a sequence (urban28-pankyo): sensor_data, calibration, image, "
               "global_pose.csv"});
    b(VIWO_PARAM(imu), {.help = "read sensor_data/xsens_imu.csv"});
    b(VIWO_PARAM(wheels), {.help = "read sensor_data/encoder.csv: drives 1 (left) and 2 (right)"});
    b(VIWO_PARAM(images), {.help = "read image/stereo_left and stereo_right: cameras 0 and 1"});
    b(VIWO_PARAM(reference), {.help = "read global_pose.csv"});
    b(VIWO_PARAM(encoder_resolution),
      {.min = 0.,
       .max = 1e9,
       .help = "counts of a turn of a wheel; 0: from calibration/EncoderParameter.txt"});
    b(VIWO_PARAM(start_s),
      {.unit = "s",
       .min = 0.,
       .max = 1e6,
       .help = "leave out what is earlier, counted from the first stamp of what is read"});
    b(VIWO_PARAM(duration_s), {.unit = "s",
                               .min = 0.,
                               .max = 1e6,
                               .help = "leave out what is later than this behind start_s; "
                                       "0: nothing"});
    log::JointParams::bind(b);
    log::LimitParams::bind(b);
  }
};

/// What a sample stands for: an instant, or the cell of an encoder sample.
template <class Sample>
std::pair<std::int64_t, std::int64_t> extent(const Sample& sample) {
  return {sample.t_ns, sample.t_ns};
}
std::pair<std::int64_t, std::int64_t> extent(const EncoderSample& sample) {
  return {sample.begin_ns, sample.end_ns};
}

/// Samples of one kind and how far they have been played.
template <class Sample>
struct Track {
  std::vector<Sample> samples;
  std::size_t next = 0;

  bool has_next() const { return next < samples.size(); }
};

class KaistUrban final : public Sensor {
 public:
  KaistUrban(const Params& params, const HostServices& /*services*/) {
    const std::filesystem::path folder = params.path;
    std::error_code ignored;
    if (!std::filesystem::is_directory(folder, ignored)) {
      throw ParamError("path", folder.string() + " is no folder");
    }
    const kaist::Sequence sequence(folder, params.limits());
    if (params.reference) keep(sequence.reference());
    if (params.imu) keep(sequence.imu());
    if (params.wheels) keep(sequence.wheels(params.encoder_resolution, params.joints()));
    if (params.images) {
      keep<0>(sequence.images(0));
      keep<1>(sequence.images(1));
    }
    if (!earliest()) {
      throw ParamError("path", "nothing to read: imu, wheels, images and reference are all false");
    }
    cut(params.start_s, params.duration_s);
  }

  SampleTypes yields() const override { return yields_; }

  Status next(Measurement& out) override {
    const auto first = earliest();
    if (!first) return Status::kEnd;
    // The first of the tracks that are at this time.
    bool taken = false;
    for_each_track([&](auto& track) {
      if (taken || !track.has_next() || track.samples[track.next].t_ns != *first) return;
      out = std::move(track.samples[track.next++]);
      taken = true;
    });
    return Status::kOk;
  }

  void rejections(std::vector<RejectionCount>& out) const override {
    out.insert(out.end(), rejections_.begin(), rejections_.end());
  }

 private:
  template <std::size_t camera = 0, class Sample>
  void keep(log::Recording<Sample> recording) {
    if (camera == 0) yields_.push_back(&sample_type<Sample>());
    if constexpr (std::is_same_v<Sample, ImageSample>) {
      images_[camera].samples = std::move(recording.samples);
    } else {
      std::get<Track<Sample>>(tracks_).samples = std::move(recording.samples);
    }
    rejections_.insert(rejections_.end(), recording.rejections.begin(), recording.rejections.end());
  }

  template <class Visit>
  void for_each_track(Visit visit) {
    std::apply([&](auto&... track) { (visit(track), ...); }, tracks_);
    for (auto& track : images_) visit(track);
  }

  /// Stamp of the next sample; nothing at the end.
  std::optional<std::int64_t> earliest() {
    std::optional<std::int64_t> first;
    for_each_track([&](const auto& track) {
      if (!track.has_next()) return;
      const std::int64_t t_ns = track.samples[track.next].t_ns;
      first = first ? std::min(*first, t_ns) : t_ns;
    });
    return first;
  }

  /// ParamError when nothing is left.
  void cut(double start_s, double duration_s) {
    std::int64_t first_ns = std::numeric_limits<std::int64_t>::max();
    std::int64_t last_ns = std::numeric_limits<std::int64_t>::min();
    for_each_track([&](const auto& track) {
      if (!track.has_next()) return;
      first_ns = std::min(first_ns, extent(track.samples.front()).first);
      last_ns = std::max(last_ns, extent(track.samples.back()).second);
    });
    const std::int64_t from_ns = first_ns + to_ns(start_s);
    const std::int64_t until_ns = duration_s > 0. ? from_ns + to_ns(duration_s) : last_ns;
    for_each_track([&](auto& track) {
      std::erase_if(track.samples, [&](const auto& sample) {
        const auto [begin_ns, end_ns] = extent(sample);
        return begin_ns < from_ns || end_ns > until_ns;
      });
    });
    if (earliest()) return;
    throw ParamError("start_s", "nothing is left: what is read is " +
                                    log::number_text(seconds_between(first_ns, last_ns)) +
                                    " s long");
  }

  // In this order where stamps are the same.
  std::tuple<Track<PoseSample>, Track<ImuSample>, Track<EncoderSample>> tracks_;
  std::array<Track<ImageSample>, 2> images_;
  std::vector<RejectionCount> rejections_;
  SampleTypes yields_;
};

VIWO_REGISTER(Sensor, KaistUrban, "kaist_urban", "1.0.0",
              "stereo images, IMU, wheel encoders and reference of a KAIST Complex Urban sequence",
              "Apache-2.0", Params);

}  // namespace
}  // namespace viwo
