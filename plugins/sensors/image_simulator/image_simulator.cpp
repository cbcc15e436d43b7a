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
#include "viwo/log/sensor_params.hpp"
#include "viwo/math/arrays.hpp"
#include "viwo/sim/image_renderer.hpp"
#include "viwo/sim/rig_simulator.hpp"
#include "viwo/sim/textured_room.hpp"
#include "viwo/sim/true_cameras.hpp"

namespace viwo {
namespace {

/// What is left of the light in the dark.
constexpr double kDarkGain = 0.01;

// clang-format off
constexpr std::array kImageParams{
    ParamSpec{.name = "cameras", .type = ParamType::kPath,
              .help = "cameras on the IMU, a camera chain file of Kalibr"},
    ParamSpec{.name = "n_cameras", .type = ParamType::kInt, .fallback = "1", .min = 1., .max = 16.,
              .help = "how many of them, from the first"},
    ParamSpec{.name = "skip_first", .type = ParamType::kBool, .fallback = "true",
              .help = "no images at the first true state, which sensor simulator gives for the start "
                      "of the IMU; false with its camera_phase_s: 0"},
    ParamSpec{.name = "world_seed", .type = ParamType::kInt, .fallback = "1", .min = 0.,
              .max = 9e15, .help = "what textures and boxes are drawn with, for all seeds of a run"},
    ParamSpec{.name = "room_size_m", .type = ParamType::kNumbers, .unit = "m", .fallback = "[]",
              .min = 1., .max = 1000.,
              .help = "edges of the room along x and y of G; []: as the motion needs it"},
    ParamSpec{.name = "room_centre_m", .type = ParamType::kNumbers, .unit = "m", .fallback = "[]",
              .help = "its centre; []: in the middle of the motion"},
    ParamSpec{.name = "room_margin_m", .type = ParamType::kNumber, .unit = "m", .fallback = "3",
              .min = 0.5, .max = 100.,
              .help = "from the motion to the walls of a room without a size"},
    ParamSpec{.name = "room_height_m", .type = ParamType::kNumber, .unit = "m", .fallback = "3",
              .min = 0.5, .max = 100., .help = "from floor to ceiling"},
    ParamSpec{.name = "floor_m", .type = ParamType::kNumber, .unit = "m", .fallback = "-0.12",
              .min = -1000., .max = 1000., .help = "height of the floor in G, a plane"},
    ParamSpec{.name = "boxes", .type = ParamType::kInt, .fallback = "40", .min = 0., .max = 1000.,
              .help = "boxes and panels beside the path"},
    ParamSpec{.name = "box_clearance_m", .type = ParamType::kNumber, .unit = "m",
              .fallback = "0.5", .min = 0.1, .max = 100.,
              .help = "between the path of the cameras and the boxes"},
    ParamSpec{.name = "box_reach_m", .type = ParamType::kNumber, .unit = "m", .fallback = "3",
              .min = 0.1, .max = 100., .help = "boxes are not further from the path"},
    ParamSpec{.name = "texture_size_px", .type = ParamType::kInt, .unit = "px",
              .fallback = "1024", .min = 8., .max = 8192.,
              .help = "a texture repeats after so many texels (2.5 to 4.5 mm); a power of two"},
    ParamSpec{.name = "sigma_grey", .type = ParamType::kNumber,
              .fallback = "2", .min = 0., .max = 100., .help = "white noise of each pixel, grey levels"},
    ParamSpec{.name = "vignette", .type = ParamType::kNumber, .fallback = "0", .min = 0.,
              .max = 1., .help = "share of the light that the corners of an image lack"},
    ParamSpec{.name = "exposure_swing", .type = ParamType::kNumber, .fallback = "0", .min = 0.,
              .max = 1., .help = "share by which the brightness swings up and down"},
    ParamSpec{.name = "exposure_period_s", .type = ParamType::kNumber, .unit = "s",
              .fallback = "10", .min = 0.01, .max = 1e6, .help = "period of that"},
    ParamSpec{.name = "dark_start_s", .type = ParamType::kNumbers, .unit = "s", .fallback = "[]",
              .help = "when the light goes out, from the first true state on"},
    ParamSpec{.name = "dark_duration_s", .type = ParamType::kNumber, .unit = "s",
              .fallback = "5", .min = 0., .help = "for how long each time"},
    ParamSpec{.name = "drop_start_s", .type = ParamType::kNumbers, .unit = "s", .fallback = "[]",
              .help = "when images begin to be missing, from the first true state on"},
    ParamSpec{.name = "drop_duration_s", .type = ParamType::kNumber, .unit = "s",
              .fallback = "2", .min = 0., .help = "for how long each time"},
};
// clang-format on

constexpr auto kParams = log::joined(kImageParams, sim::kTrueCameraParams);

std::vector<double> list(const ParamSet& params, const char* key) {
  const auto numbers = params.numbers(key);
  return {numbers.begin(), numbers.end()};
}

/// Two numbers or none.
std::vector<double> pair_or_none(const ParamSet& params, const char* key) {
  std::vector<double> out = list(params, key);
  if (out.size() != 2 && !out.empty()) {
    throw ParamError(key, "needs two numbers, along x and y, not " + std::to_string(out.size()));
  }
  return out;
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
  Options(const ParamSet& params, const HostServices& services);

  std::vector<CameraView> cameras;       ///< as they truly are
  std::vector<CameraView> file_cameras;  ///< as the file says
  bool skip_first;
  sim::RoomOptions room;                 ///< without size and centre
  std::vector<double> size_m, centre_m;  ///< along x and y, or nothing
  double margin_m;
  double sigma_grey, vignette, exposure_swing, exposure_period_s;
  Intervals dark, dropped;
};

Options::Options(const ParamSet& params, const HostServices& services)
    : file_cameras(sim::cameras_of_file(params)),
      skip_first(params.flag("skip_first")),
      size_m(pair_or_none(params, "room_size_m")),
      centre_m(pair_or_none(params, "room_centre_m")),
      margin_m(params.number("room_margin_m")),
      sigma_grey(services.exact ? 0. : params.number("sigma_grey")),
      vignette(params.number("vignette")),
      exposure_swing(params.number("exposure_swing")),
      exposure_period_s(params.number("exposure_period_s")),
      dark{list(params, "dark_start_s"), params.number("dark_duration_s")},
      dropped{list(params, "drop_start_s"), params.number("drop_duration_s")} {
  cameras = sim::true_cameras(params, file_cameras, services);
  room.seed = static_cast<std::uint64_t>(params.integer("world_seed"));
  room.floor_m = params.number("floor_m");
  room.height_m = params.number("room_height_m");
  room.blocks = static_cast<int>(params.integer("boxes"));
  room.clearance_m = params.number("box_clearance_m");
  room.reach_m = params.number("box_reach_m");
  if (room.reach_m < room.clearance_m) {
    throw ParamError("box_reach_m", "is less than box_clearance_m");
  }
  room.texture_size = static_cast<int>(params.integer("texture_size_px"));
  if (!std::has_single_bit(static_cast<unsigned>(room.texture_size))) {
    throw ParamError("texture_size_px", std::to_string(room.texture_size) +
                                            " is not a power of two: 512, 1024, 2048, ...");
  }
}

/// (IMG-8)
sim::CameraPose camera_pose(const StateSample& state, const CameraView& camera) {
  const Eigen::Matrix3d R_ItoG = to_quaternion(state.q_ItoG_xyzw).toRotationMatrix();
  sim::CameraPose pose;
  pose.R_CtoG = R_ItoG * camera.R_ItoC.transpose();
  pose.p_CinG = to_vector(state.p_IinG_m) - pose.R_CtoG * camera.p_IinC;
  return pose;
}

/// An image that is made when it is read.
class RenderedImage final : public ImageSource {
 public:
  RenderedImage(std::shared_ptr<const sim::ImageRenderer> renderer, const sim::CameraPose& pose,
                const sim::Exposure& exposure)
      : renderer_(std::move(renderer)), pose_(pose), exposure_(exposure) {}
  void read(Image& out) const override { renderer_->render(pose_, exposure_, out); }

 private:
  std::shared_ptr<const sim::ImageRenderer> renderer_;
  sim::CameraPose pose_;
  sim::Exposure exposure_;
};

class ImageSimulator final : public Sensor {
 public:
  ImageSimulator(const ParamSet& params, const HostServices& services)
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
    Measurement measurement;
    while (input.next(measurement) == Status::kOk) {
      if (const auto* state = measurement.get_if<StateSample>()) states.push_back(*state);
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
    for (const StateSample& state : states) add_images(state);
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
    sim::RoomOptions& room = options_.room;
    room.centre_m = 0.5 * (low + high).head<2>();
    if (!centre.empty()) room.centre_m << centre[0], centre[1];
    // Around its centre, wherever that is.
    room.size_m =
        2. * (high.head<2>() - room.centre_m).cwiseMax(room.centre_m - low.head<2>()).array() +
        2. * options_.margin_m;
    if (!size.empty()) room.size_m << size[0], size[1];
    const auto made = std::make_shared<const sim::TexturedRoom>(sim::make_room(room, path));
    for (const CameraView& camera : options_.cameras) {
      renderers_.push_back(
          std::make_shared<const sim::ImageRenderer>(camera, made, options_.vignette));
    }
  }

  void add_images(const StateSample& state) {
    const double t_s = seconds_between(first_ns_, state.t_ns);
    if (options_.dropped.contain(t_s)) return;
    sim::Exposure exposure;
    exposure.noise_sigma = options_.sigma_grey;
    exposure.gain = 1. + options_.exposure_swing *  // (IMG-9)
                             std::sin(2. * M_PI * t_s / options_.exposure_period_s);
    if (options_.dark.contain(t_s)) exposure.gain *= kDarkGain;
    for (std::size_t c = 0; c < renderers_.size(); ++c) {
      const CameraView& camera = options_.cameras[c];
      exposure.seed = noise_seed(c, state.t_ns);
      const std::int64_t t_ns = sim::camera_stamp_ns(camera, state.t_ns);  // (IMG-10)
      samples_.emplace_back(ImageSample{t_ns, static_cast<int>(c),
                                        std::make_shared<const RenderedImage>(
                                            renderers_[c], camera_pose(state, camera), exposure)});
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
  std::vector<std::shared_ptr<const sim::ImageRenderer>> renderers_;
  std::vector<Measurement> samples_;
  std::size_t next_ = 0;
};

VIWO_REGISTER(Sensor, ImageSimulator, "image_simulator", "1.0.0",
              "images of a textured room, along the true states of another sensor", "Apache-2.0",
              kParams);

}  // namespace
}  // namespace viwo
