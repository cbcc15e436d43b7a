#include "viwo/view/pictures.hpp"

#include <algorithm>
#include <cmath>
#include <exception>
#include <limits>
#include <utility>

#include "viwo/eval/alignment.hpp"
#include "viwo/math/arrays.hpp"
#include "viwo/math/significant.hpp"
#include "viwo/report/curves.hpp"

namespace viwo::view {
namespace {

/// Images of a live run that are kept until the filter has come to them.
constexpr std::size_t kMaxArrived = 100;
/// Stamps of the tracks of a pair may both be those of the first camera, whose image may be earlier
/// or later by some milliseconds.
constexpr double kMaxStampOff_s = 0.02;
constexpr std::size_t kMaxCurves = 8;
constexpr std::size_t kMaxPoints = 400;
constexpr double kReferenceGap_s = 0.5;
/// Parts of a run at which its page has a picture, besides the end.
constexpr std::array<double, 2> kSnapshotsAt{0.1, 0.5};
/// First picture of a live run, whose end is not known; the others at twice the time each.
constexpr double kFirstLiveSnapshot_s = 2.;

std::size_t step_for(std::size_t size) { return std::max<std::size_t>(1, size / kMaxPoints); }

/// Every so many-th index, and the last.
template <class F>
void every(std::size_t size, const F& take) {
  const std::size_t step = step_for(size);
  for (std::size_t i = 0; i < size; i += step) take(i);
  if (size > 0 && (size - 1) % step != 0) take(size - 1);
}

Trajectory reference_of(const RunData& data) {
  if (data.states().empty()) return data.reference;
  Trajectory reference;
  for (const StateSample& state : data.states()) {
    reference.push_back(
        {state.t_ns, to_vector(state.p_IinG_m), to_quaternion(state.q_ItoG_xyzw).normalized()});
  }
  return reference;
}

/// The reference up to now in the world of the estimate, which it does not share.
std::vector<Eigen::Vector2d> aligned(const Trajectory& reference, const Trajectory& estimate) {
  std::vector<eval::PosePair> pairs;
  every(estimate.size(), [&](std::size_t i) {
    const auto pose = interpolate(reference, estimate[i].t_ns, kReferenceGap_s);
    if (pose) pairs.push_back({*pose, estimate[i]});
  });
  std::vector<Eigen::Vector2d> points;
  if (pairs.empty()) return points;
  const eval::RigidTransform E = eval::align(pairs, eval::Alignment::kYawPosition);
  for (const eval::PosePair& pair : pairs) {
    const Eigen::Vector3d p = E.q_EtoR.conjugate() * (pair.reference.p_BinW - E.p_EinR);
    points.emplace_back(p.head<2>());
  }
  return points;
}

/// "second.r" of "second.r_1": parameters of one kind.
std::string kind_of(const std::string& parameter) {
  return parameter.substr(0, parameter.rfind('_'));
}

/// Of the parameters that are estimated: the first of each kind, then others.
std::vector<std::size_t> chosen(const std::vector<CalibrationTrack>& tracks) {
  std::vector<std::size_t> first, others;
  std::vector<std::string> kinds;
  for (std::size_t i = 0; i < tracks.size(); ++i) {
    if (tracks[i].sigma.empty() || !(tracks[i].sigma.front() > 0.)) continue;
    const std::string kind = kind_of(tracks[i].name);
    const bool known = std::find(kinds.begin(), kinds.end(), kind) != kinds.end();
    (known ? others : first).push_back(i);
    if (!known) kinds.push_back(kind);
  }
  first.insert(first.end(), others.begin(), others.end());
  if (first.size() > kMaxCurves) first.resize(kMaxCurves);
  std::sort(first.begin(), first.end());
  return first;
}

/// The error with three sigmas around zero where the truth is known, else the change since the
/// start with three sigmas around it.
view::Curve curve_of(const CalibrationTrack& track, const std::vector<double>& t_s) {
  const report::DisplayUnit unit =
      report::display_unit(track.unit, report::kBandSigmas * track.sigma.back());
  const bool known = std::isfinite(track.truth);
  const double origin = known ? track.truth : track.estimate.front();
  view::Curve curve;
  every(std::min(t_s.size(), track.estimate.size()), [&](std::size_t i) {
    const double y = unit.scale * (track.estimate[i] - origin);
    const double band = unit.scale * report::kBandSigmas * track.sigma[i];
    const double middle = known ? 0. : y;
    curve.x.push_back(t_s[i]);
    curve.y.push_back(y);
    curve.low.push_back(middle - band);
    curve.high.push_back(middle + band);
  });
  curve.title = track.name + (known ? " error " : " change ") + significant(curve.y.back(), 3) +
                " +- " + significant(unit.scale * report::kBandSigmas * track.sigma.back(), 3) +
                " " + unit.name;
  return curve;
}

}  // namespace

PictureSinks open_sinks(const RunSetup& setup, bool window, const std::filesystem::path& video) {
  if (!setup.filter && (window || !video.empty())) {
    throw InputError(std::string(window ? "--show" : "--video") +
                     " shows what the filter does, but this run has none (a section 'updates')");
  }
  PictureSinks sinks;
  if (!video.empty()) sinks.video = open_film(video);
  if (window) sinks.window = open_screen("viwo: " + setup.name);
  return sinks;
}

RunPictures::RunPictures(const RunSetup& setup, const RunData& data, PictureSinks sinks)
    : setup_(setup),
      sinks_(std::move(sinks)),
      reference_(reference_of(data)),
      live_(!data.live.empty()) {
  if (setup.filter) cameras_.resize(setup.filter->cameras.size());
  for (const ImageSample& image : data.images()) {
    const auto index = static_cast<std::size_t>(image.camera);
    if (index < cameras_.size()) cameras_[index].images.push_back(image);
  }
  if (const auto imu = data.imu(); !imu.empty()) {
    duration_s_ = seconds_between(imu.front().t_ns, imu.back().t_ns);
  }
  next_snapshot_s_ = live_ ? kFirstLiveSnapshot_s : kSnapshotsAt.front() * duration_s_;
}

void RunPictures::watch(RunHooks& hooks) {
  hooks.on_start = [this](const Estimator&) { return this; };
  hooks.on_epoch = [this](const RunResult& result) { after_epoch(result); };
  hooks.on_live_image = [this](const ImageSample& image) {
    const std::scoped_lock lock(mutex_);
    if (arrived_.size() == kMaxArrived) arrived_.pop_front();
    arrived_.push_back(image);
  };
}

void RunPictures::on_epoch(const Filter& filter, const EpochData& data) {
  sigma_position_m_ =
      std::sqrt(filter.imu_covariance().diagonal().segment<3>(kPositionColumn).sum());
  for (const FeatureSample& image : images_of(data)) {
    const auto index = static_cast<std::size_t>(image.camera);
    if (index >= cameras_.size()) continue;
    cameras_[index].t_ns = image.t_ns;
    cameras_[index].seen.add(image.points);
    seen_ = true;
  }
}

bool RunPictures::snapshot_due(double t_s) {
  if (!seen_ || t_s < next_snapshot_s_) return false;
  if (live_) {
    next_snapshot_s_ = 2. * t_s;
  } else {
    const auto next = std::upper_bound(kSnapshotsAt.begin(), kSnapshotsAt.end(), t_s / duration_s_);
    next_snapshot_s_ =
        next != kSnapshotsAt.end() ? *next * duration_s_ : std::numeric_limits<double>::infinity();
  }
  return true;
}

void RunPictures::after_epoch(const RunResult& result) {
  if (!failure_.empty()) return;
  try {
    make_pictures(result);
  } catch (const std::exception& error) {
    failure_ = std::string("pictures: ") + error.what();
  }
}

void RunPictures::make_pictures(const RunResult& result) {
  const double t_s = result.epoch_t_s.back();
  const bool snapshot = snapshot_due(t_s);
  const bool show = sinks_.window != nullptr && sinks_.window->due();
  const bool film = sinks_.video != nullptr;
  if (!snapshot && !show && !film) return;
  const view::Picture picture = picture_of(result);
  if (snapshot) snapshots_.push_back({t_s, view::encode_png(picture)});
  if (show) sinks_.window->show(picture);
  if (film) sinks_.video->add(picture, t_s);
}

std::string RunPictures::finish(RunResult& result) {
  sinks_.window.reset();
  if (failure_.empty() && seen_ && !result.epoch_t_s.empty()) {
    const double end_s = result.epoch_t_s.back();
    for (const double part : kSnapshotsAt) {
      const auto distance = [&](const RunPicture& p) { return std::abs(p.t_s - part * end_s); };
      const auto nearest =
          std::min_element(snapshots_.begin(), snapshots_.end(),
                           [&](const auto& a, const auto& b) { return distance(a) < distance(b); });
      if (nearest == snapshots_.end()) break;
      result.pictures.push_back(std::move(*nearest));
      snapshots_.erase(nearest);
    }
    result.pictures.push_back({end_s, view::encode_png(picture_of(result))});
  }
  try {
    if (failure_.empty() && sinks_.video != nullptr) sinks_.video->close();
  } catch (const std::exception& error) {
    failure_ = error.what();
  }
  return failure_;
}

std::shared_ptr<const ImageSource> RunPictures::source_of(std::size_t index) {
  const Camera& camera = cameras_[index];
  if (!camera.t_ns) return nullptr;
  const std::int64_t t_ns = *camera.t_ns;
  double least_s = kMaxStampOff_s;
  std::shared_ptr<const ImageSource> nearest;
  const auto consider = [&](const ImageSample& image) {
    const double off_s = std::abs(seconds_between(image.t_ns, t_ns));
    if (static_cast<std::size_t>(image.camera) != index || off_s >= least_s) return;
    least_s = off_s;
    nearest = image.source;
  };
  const auto after = std::lower_bound(
      camera.images.begin(), camera.images.end(), t_ns,
      [](const ImageSample& image, std::int64_t stamp) { return image.t_ns < stamp; });
  if (after != camera.images.end()) consider(*after);
  if (after != camera.images.begin()) consider(*(after - 1));
  const std::scoped_lock lock(mutex_);
  for (const ImageSample& image : arrived_) consider(image);
  return nearest;
}

view::CameraImage RunPictures::camera_image(std::size_t index) {
  Camera& camera = cameras_[index];
  const CameraView& model = setup_.filter->cameras[index].camera;
  view::CameraImage image;
  image.name = "cam" + std::to_string(index);
  image.width_px = model.width_px;
  image.height_px = model.height_px;
  image.tracks = camera.seen.tracks().tracks();
  const auto source = source_of(index);
  if (source == nullptr) return image;
  try {
    source->read(camera.pixels);
    image.pixels = &camera.pixels;
  } catch (const std::exception&) {
    // Whoever tracks points in it says why.
    image.note = "the image cannot be read";
  }
  return image;
}

view::Picture RunPictures::picture_of(const RunResult& result) {
  view::Scene scene;
  scene.status = status_of(result);
  for (std::size_t i = 0; i < cameras_.size(); ++i) scene.cameras.push_back(camera_image(i));
  scene.paths = paths_of(result);
  const StampedPose& pose = result.estimate.back();
  scene.body = view::Body{pose.p_BinW.head<2>(), yaw(pose)};
  scene.curves = curves_of(result);
  return view::draw(scene);
}

std::vector<view::Path> RunPictures::paths_of(const RunResult& result) const {
  std::vector<view::Path> paths{{"estimate", false, {}}};
  every(result.estimate.size(), [&](std::size_t i) {
    paths[0].points_m.emplace_back(result.estimate[i].p_BinW.head<2>());
  });
  if (reference_.empty()) return paths;
  if (setup_.filter->start.mode != StartMode::kReference) {
    paths.push_back({"reference (aligned)", true, aligned(reference_, result.estimate)});
    return paths;
  }
  paths.push_back({"reference", true, {}});
  every(reference_.size(),
        [&](std::size_t i) { paths[1].points_m.emplace_back(reference_[i].p_BinW.head<2>()); });
  return paths;
}

std::vector<view::Curve> RunPictures::curves_of(const RunResult& result) const {
  std::vector<view::Curve> curves;
  for (const std::size_t i : chosen(result.calibration)) {
    curves.push_back(curve_of(result.calibration[i], result.epoch_t_s));
  }
  return curves;
}

std::string RunPictures::status_of(const RunResult& result) const {
  const double t_s = result.epoch_t_s.back();
  std::size_t points = 0;
  for (const Camera& camera : cameras_) points += camera.seen.points().size();
  std::string text = significant(std::round(100. * t_s) / 100., 7) + " s, " +
                     std::to_string(points) + " points, position sigma " +
                     significant(1e3 * sigma_position_m_, 3) + " mm";
  if (!result.errors.empty() && result.errors.back().t_s == t_s) {
    text += ", error " + significant(1e3 * result.errors.back().position_m.norm(), 3) + " mm";
  }
  if (!result.nees.series.empty() && result.nees.series.back().first == t_s) {
    text += ", NEES of the pose " + significant(result.nees.series.back().second, 3) + " (6)";
  }
  return text;
}

}  // namespace viwo::view
