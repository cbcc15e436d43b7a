#include "update_hostile.hpp"

#include <limits>
#include <memory>
#include <span>
#include <tuple>
#include <vector>

namespace viwo::conformance {
namespace {

enum class Mistake { kValues, kRepeated, kForeign };

void spoil(Mistake mistake, double bad, std::vector<FeatureSample>& images) {
  for (FeatureSample& image : images) {
    if (mistake == Mistake::kForeign) image.camera = 7;
    for (FeaturePoint& point : image.points) {
      if (mistake == Mistake::kValues) point.u_px = bad;
      if (mistake == Mistake::kRepeated) point.id = 1;
    }
  }
}
void spoil(Mistake mistake, double bad, std::vector<EncoderSample>& cells) {
  for (EncoderSample& cell : cells) {
    if (mistake == Mistake::kValues) cell.drive_rad_per_s.fill(bad);
  }
  if (mistake == Mistake::kRepeated) cells.clear();
}
void spoil(Mistake mistake, double bad, std::vector<PoseSample>& poses) {
  for (PoseSample& pose : poses) {
    if (mistake == Mistake::kValues) pose.p_BinW_m.fill(bad);
    if (mistake == Mistake::kRepeated) pose.q_BtoW_xyzw.fill(0.);
  }
  if (mistake == Mistake::kForeign) poses.clear();
}
void spoil(Mistake mistake, double bad, std::vector<GnssSample>& fixes) {
  for (GnssSample& fix : fixes) {
    if (mistake == Mistake::kValues) fix.latitude_deg = bad;
    if (mistake == Mistake::kRepeated) fix.covariance_ENU_m2.fill(0.);
    if (mistake == Mistake::kForeign) fix.altitude_m = bad;
  }
}
void spoil(Mistake mistake, double bad, std::vector<ImuSample>& samples) {
  for (ImuSample& sample : samples) {
    if (mistake == Mistake::kValues) sample.gyro_rad_per_s.fill(bad);
  }
  if (mistake == Mistake::kForeign) samples.clear();
}

/// What an epoch refers to, with mistakes in it.
class Spoiler {
 public:
  void operator()(int epoch, EpochData& data) {
    constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
    constexpr double kValues[] = {kNan, std::numeric_limits<double>::infinity(), 1e300, -1e9};
    bad_ = kValues[epoch % 4];
    mistake_ = static_cast<Mistake>(epoch / 4 % 3);
    imu_.assign(data.imu.begin(), data.imu.end());
    if (mistake_ == Mistake::kForeign) imu_.clear();
    data.imu = imu_;
    copies_ = {};
    streams_.assign(data.streams.begin(), data.streams.end());
    for (SampleSpan& stream : streams_) {
      spoil_if<FeatureSample>(stream);
      spoil_if<EncoderSample>(stream);
      spoil_if<PoseSample>(stream);
      spoil_if<GnssSample>(stream);
      spoil_if<ImuSample>(stream);
    }
    data.streams = streams_;
  }

 private:
  template <class T>
  void spoil_if(SampleSpan& stream) {
    if (stream.size == 0 || !(*stream.type == sample_type<T>())) return;
    const std::span given(static_cast<const T*>(stream.data), stream.size);
    auto& copy =
        std::get<std::vector<std::vector<T>>>(copies_).emplace_back(given.begin(), given.end());
    spoil(mistake_, bad_, copy);
    stream.data = copy.data();
    stream.size = copy.size();
  }

  template <class... T>
  using Copies = std::tuple<std::vector<std::vector<T>>...>;

  double bad_ = 0.;
  Mistake mistake_ = Mistake::kValues;
  std::vector<ImuSample> imu_;
  std::vector<SampleSpan> streams_;
  Copies<FeatureSample, EncoderSample, PoseSample, GnssSample, ImuSample> copies_;
};

}  // namespace

Spoil make_spoil() {
  const auto spoiler = std::make_shared<Spoiler>();
  return [spoiler](int epoch, EpochData& data) { (*spoiler)(epoch, data); };
}

}  // namespace viwo::conformance
