// Sensor image_simulator: images of a textured room along true states (model.md).
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <memory>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Geometry>

#include "viwo/api/plugin.hpp"
#include "viwo/math/arrays.hpp"
#include "viwo/math/stamp.hpp"
#include "viwo/rendering/image_renderer.hpp"
#include "viwo/rendering/textured_room.hpp"
#include "viwo/sim/rig_simulator.hpp"
#include "viwo/sim/true_cameras.hpp"

namespace viwo {
namespace {

/// What is left of the light in the dark.
constexpr double kDarkGain = 0.01;
/// A reading of the IMU is found within this time, whatever its rate.
constexpr double kLeastAround_s = 0.01;

struct Params : sim::TrueCameraParams {
  std::filesystem::path cameras;
  int n_cameras = 1;
  bool skip_first = true;
  std::int64_t world_seed = 1;
  std::vector<double> room_size_m;
  std::vector<double> room_centre_m;
  double room_margin_m = 3.;
  double room_height_m = 3.;
  double floor_m = -0.12;
  int boxes = 40;
  double box_clearance_m = 0.5;
  double box_reach_m = 3.;
  int texture_size_px = 1024;
  double sigma_grey = 2.;
  double vignette = 0.;
  double exposure_swing = 0.;
  double exposure_period_s = 10.;
  std::vector<double> dark_start_s;
  double dark_duration_s = 5.;
  std::vector<double> drop_start_s;
  double drop_duration_s = 2.;

  void bind(ParamBinder& b) {
    b(VIWO_PARAM(cameras),
      {.required = true, .help = "cameras on the IMU, a camera chain file of Kalibr"});
    b(VIWO_PARAM(n_cameras), {.min = 1., .max = 16., .help = "how many of them, from the first"});
    b(VIWO_PARAM(skip_first),
      {.help = "no images at the first true state, which sensor simulator gives for the start "
               "of the IMU; false with its camera_phase_s: 0"});
    b(VIWO_PARAM(world_seed),
      {.min = 0.,
       .max = 9e15,
       .help = "what textures and boxes are drawn with, for all seeds of a run"});
    b(VIWO_PARAM(room_size_m),
      {.unit = "m",
       .min = 1.,
       .max = 1000.,
       .help = "edges of the room along x and y of G; []: as the motion needs it"});
    b(VIWO_PARAM(room_centre_m),
      {.unit = "m", .help = "its centre; []: in the middle of the motion"});
    b(VIWO_PARAM(room_margin_m), {.unit = "m",
                                  .min = 0.5,
                                  .max = 100.,
                                  .help = "from the motion to the walls of a room without a size"});
    b(VIWO_PARAM(room_height_m),
      {.unit = "m", .min = 0.5, .max = 100., .help = "from floor to ceiling"});
    b(VIWO_PARAM(floor_m),
      {.unit = "m", .min = -1000., .max = 1000., .help = "height of the floor in G, a plane"});
    b(VIWO_PARAM(boxes), {.min = 0., .max = 1000., .help = "boxes and panels beside the path"});
    b(VIWO_PARAM(box_clearance_m), {.unit = "m",
                                    .min = 0.1,
                                    .max = 100.,
                                    .help = "between the path of the cameras and the boxes"});
    b(VIWO_PARAM(box_reach_m),
      {.unit = "m", .min = 0.1, .max = 100., .help = "boxes are not further from the path"});
    b(VIWO_PARAM(texture_size_px),
      {.unit = "px",
       .min = 8.,
       .max = 8192.,
       .help = "a texture repeats after so many texels (2.5 to 4.5 mm); a power of two"});
    b(VIWO_PARAM(sigma_grey),
      {.min = 0., .max = 100., .help = "white noise of each pixel, grey levels"});
    b(VIWO_PARAM(vignette),
      {.min = 0., .max = 1., .help = "share of the light that the corners of an image lack"});
    b(VIWO_PARAM(exposure_swing),
      {.min = 0., .max = 1., .help = "share by which the brightness swings up and down"});
    b(VIWO_PARAM(exposure_period_s),
      {.unit = "s", .min = 0.01, .max = 1e6, .help = "period of that"});
    b(VIWO_PARAM(dark_start_s),
      {.unit = "s", .help = "when the light goes out, from the first true state on"});
    b(VIWO_PARAM(dark_duration_s), {.unit = "s", .min = 0., .help = "for how long each time"});
    b(VIWO_PARAM(drop_start_s),
      {.unit = "s", .help = "when images begin to be missing, from the first true state on"});
    b(VIWO_PARAM(drop_duration_s), {.unit = "s", .min = 0., .help = "for how long each time"});
    sim::TrueCameraParams::bind(b);
  }
};

const std::vector<double>& pair_or_none(const char* key, const std::vector<double>& numbers) {
  if (numbers.size() == 2 || numbers.empty()) return numbers;
  throw ParamError(key, "needs two numbers, along x and y, not " + std::to_string(numbers.size()));
}

/// Times of equal length.
struct Intervals {
  std::vector<double> start_s;
  double duration_s = 0.;

  bool contain(double t_s) const {
    return std::any_of(start_s.begin(), start_s.end(),
                       [&](double start) { return t_s >= start && t_s < start + duration_s; });
  }
};

/// What a configuration says.
struct Options {
  Options(const Params& params, const HostServices& services);

  std::vector<CameraView> cameras;       ///< as they truly are
  std::vector<CameraView> file_cameras;  ///< as the file says
  bool skip_first;
  rendering::RoomOptions room;           ///< without size and centre
  std::vector<double> size_m, centre_m;  ///< along x and y, or nothing
  double margin_m;
  double sigma_grey, vignette, exposure_swing, exposure_period_s;
  Intervals dark, dropped;
};

Options::Options(const Params& params, const HostServices& services)
    : file_cameras(sim::cameras_of_file(params.cameras, params.n_cameras)),
      skip_first(params.skip_first),
      size_m(pair_or_none("room_size_m", params.room_size_m)),
      centre_m(pair_or_none("room_centre_m", params.room_centre_m)),
      margin_m(params.room_margin_m),
      sigma_grey(services.exact ? 0. : params.sigma_grey),
      vignette(params.vignette),
      exposure_swing(params.exposure_swing),
      exposure_period_s(params.exposure_period_s),
      dark{params.dark_start_s, params.dark_duration_s},
      dropped{params.drop_start_s, params.drop_duration_s} {
  cameras = sim::true_cameras(params, file_cameras, services);
  room.seed = static_cast<std::uint64_t>(params.world_seed);
  room.floor_m = params.floor_m;
  room.height_m = params.room_height_m;
  room.blocks = params.boxes;
  room.clearance_m = params.box_clearance_m;
  room.reach_m = params.box_reach_m;
  if (room.reach_m < room.clearance_m) {
    throw ParamError("box_reach_m", "is less than box_clearance_m");
  }
  room.texture_size = params.texture_size_px;
  if (!std::has_single_bit(static_cast<unsigned>(room.texture_size))) {
    throw ParamError("texture_size_px", std::to_string(room.texture_size) +
                                            " is not a power of two: 512, 1024, 2048, ...");
  }
}

/// (IMG-8); `w_IinI`, rad/s, is for its motion (IMG-11).
rendering::CameraPose camera_pose(const StateSample& state, const CameraView& camera,
                                  const Eigen::Vector3d& w_IinI = Eigen::Vector3d::Zero()) {
  const Eigen::Matrix3d R_ItoG = to_quaternion(state.q_ItoG_xyzw).toRotationMatrix();
  const Eigen::Vector3d p_CinI = -camera.R_ItoC.transpose() * camera.p_IinC;
  rendering::CameraPose pose;
  pose.R_CtoG = R_ItoG * camera.R_ItoC.transpose();
  pose.p_CinG = to_vector(state.p_IinG_m) - pose.R_CtoG * camera.p_IinC;
  pose.v_CinG = to_vector(state.v_IinG_m_per_s) + R_ItoG * w_IinI.cross(p_CinI);
  pose.w_CinC = camera.R_ItoC * w_IinI;
  return pose;
}

/// Mean rate of turn of the IMU around a time, from readings that are `half_s` from it at most.
Eigen::Vector3d rate_at(const StateSample& state, const std::vector<ImuSample>& imu,
                        double half_s) {
  const auto begin = std::lower_bound(
      imu.begin(), imu.end(), state.t_ns - to_ns(half_s),
      [](const ImuSample& sample, std::int64_t t_ns) { return sample.t_ns < t_ns; });
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  int n = 0;
  for (auto at = begin; at != imu.end() && at->t_ns <= state.t_ns + to_ns(half_s); ++at, ++n) {
    sum += to_vector(at->gyro_rad_per_s);
  }
  if (n == 0) {
    throw InputError(
        "the input gives no IMU samples at its true states: images of a rolling shutter "
        "(line_delay_nanoseconds of the cameras) need them");
  }
  return sum / n - to_vector(state.gyro_bias_rad_per_s);
}

/// An image that is made when it is read.
class RenderedImage final : public ImageSource {
 public:
  RenderedImage(std::shared_ptr<const rendering::ImageRenderer> renderer,
                const rendering::CameraPose& pose, const rendering::Exposure& exposure)
      : renderer_(std::move(renderer)), pose_(pose), exposure_(exposure) {}
  void read(Image& out) const override { renderer_->render(pose_, exposure_, out); }

 private:
  std::shared_ptr<const rendering::ImageRenderer> renderer_;
  rendering::CameraPose pose_;
  rendering::Exposure exposure_;
};

class ImageSimulator final : public Sensor {
 public:
  ImageSimulator(const Params& params, const HostServices& services)
      : options_(params, services), seed_(services.seed) {}

  SampleTypes yields() const override { return sample_types<ImageSample, CalibrationSample>(); }
  bool can_be_exact() const override { return true; }
  bool takes_input() const override { return true; }
  void connect(Sensor& input) override { input_ = &input; }

  Status next(Measurement& out) override {
    if (input_ != nullptr) prepare(*std::exchange(input_, nullptr));
    if (next_ == samples_.size()) return Status::kEnd;
    out = std::move(samples_[next_++]);
    return Status::kOk;
  }

 private:
  /// The room depends on the whole motion.
  void prepare(Sensor& input) {
    std::vector<StateSample> states;
    std::vector<ImuSample> imu;
    const bool rolling = std::ranges::any_of(
        options_.cameras, [](const CameraView& camera) { return camera.line_delay_s > 0.; });
    Measurement measurement;
    while (input.next(measurement) == Status::kOk) {
      if (const auto* state = measurement.get_if<StateSample>()) states.push_back(*state);
      const auto* reading = measurement.get_if<ImuSample>();
      if (reading != nullptr && rolling) imu.push_back(*reading);
    }
    if (states.empty()) {
      throw InputError("the input gives no true states, which sensors simulator and asl_state do");
    }
    first_ns_ = states.front().t_ns;
    for (CalibrationSample& truth : sim::camera_truth(options_.cameras, first_ns_)) {
      samples_.emplace_back(std::move(truth));
    }
    if (options_.skip_first) states.erase(states.begin());
    if (states.empty()) return;
    make_renderers(states);
    for (const StateSample& state : states) add_images(state, imu);
    sim::sort_by_time(samples_);  // clocks of cameras can differ
  }

  void make_renderers(const std::vector<StateSample>& states) {
    // Of the file's cameras, so that what is drawn for the true ones does not change the room.
    std::vector<Eigen::Vector3d> path;
    for (const StateSample& state : states) {
      for (const CameraView& camera : options_.file_cameras) {
        path.push_back(camera_pose(state, camera).p_CinG);
      }
    }
    Eigen::Vector3d low = path.front(), high = path.front();
    for (const Eigen::Vector3d& p : path) {
      low = low.cwiseMin(p);
      high = high.cwiseMax(p);
    }
    const auto& size = options_.size_m;
    const auto& centre = options_.centre_m;
    rendering::RoomOptions& room = options_.room;
    room.centre_m = 0.5 * (low + high).head<2>();
    if (!centre.empty()) room.centre_m << centre[0], centre[1];
    // Around its centre, wherever that is.
    room.size_m =
        2. * (high.head<2>() - room.centre_m).cwiseMax(room.centre_m - low.head<2>()).array() +
        2. * options_.margin_m;
    if (!size.empty()) room.size_m << size[0], size[1];
    const auto made =
        std::make_shared<const rendering::TexturedRoom>(rendering::make_room(room, path));
    for (const CameraView& camera : options_.cameras) {
      renderers_.push_back(
          std::make_shared<const rendering::ImageRenderer>(camera, made, options_.vignette));
    }
  }

  void add_images(const StateSample& state, const std::vector<ImuSample>& imu) {
    const double t_s = seconds_between(first_ns_, state.t_ns);
    if (options_.dropped.contain(t_s)) return;
    rendering::Exposure exposure;
    exposure.noise_sigma = options_.sigma_grey;
    exposure.gain = 1. + options_.exposure_swing *  // (IMG-9)
                             std::sin(2. * M_PI * t_s / options_.exposure_period_s);
    if (options_.dark.contain(t_s)) exposure.gain *= kDarkGain;
    for (std::size_t c = 0; c < renderers_.size(); ++c) {
      const CameraView& camera = options_.cameras[c];
      exposure.seed = noise_seed(c, state.t_ns);
      Eigen::Vector3d w_IinI = Eigen::Vector3d::Zero();
      if (camera.line_delay_s > 0.) {
        w_IinI = rate_at(state, imu, std::max(camera.middle_s(), kLeastAround_s));
      }
      const std::int64_t t_ns = sim::camera_stamp_ns(camera, state.t_ns);  // (IMG-10)
      samples_.emplace_back(
          ImageSample{t_ns, static_cast<int>(c),
                      std::make_shared<const RenderedImage>(
                          renderers_[c], camera_pose(state, camera, w_IinI), exposure)});
    }
  }

  /// Of one image of one camera, whatever else is simulated.
  std::uint64_t noise_seed(std::size_t camera, std::int64_t t_ns) const {
    const auto t = static_cast<std::uint64_t>(t_ns);
    const auto word = [](std::uint64_t x) { return static_cast<std::uint32_t>(x); };
    std::seed_seq seed{word(seed_), word(seed_ >> 32), word(camera), word(t), word(t >> 32)};
    std::array<std::uint32_t, 2> out{};
    seed.generate(out.begin(), out.end());
    return out[0] | static_cast<std::uint64_t>(out[1]) << 32;
  }

  Options options_;
  std::uint64_t seed_;
  Sensor* input_ = nullptr;  ///< until it has been read
  std::int64_t first_ns_ = 0;
  std::vector<std::shared_ptr<const rendering::ImageRenderer>> renderers_;
  std::vector<Measurement> samples_;
  std::size_t next_ = 0;
};

VIWO_REGISTER(Sensor, ImageSimulator, "image_simulator", "1.0.0",
              "images of a textured room, along the true states of another sensor", "Apache-2.0",
              Params);

}  // namespace
}  // namespace viwo
