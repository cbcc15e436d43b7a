#include "viwo/sim/feature_simulator.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>
#include <optional>
#include <stdexcept>

#include "viwo/camera/camera_model.hpp"
#include "viwo/math/stamp.hpp"
#include "viwo/sim/encoder_simulator.hpp"
#include "viwo/sim/random.hpp"
#include "viwo/sim/true_cameras.hpp"

namespace viwo::sim {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr std::int64_t kNotTracked = -1;
/// Random pixels that are tried for one new landmark; a fisheye sees nothing in its corners.
constexpr int kTries = 50;
constexpr int kPlaces = 20;  ///< along the border of an image, for its largest angle
/// Looks for the row of a rolling shutter that sees a point; each is nearer by a factor of ten.
constexpr int kRowSteps = 8;

/// Motion of the IMU, this long after the middle rows of the images are exposed.
using ImuAfter = std::function<BodyMotion(double after_s)>;

/// One camera at one instant.
struct Eye {
  const CameraView* camera = nullptr;
  double cos_max_angle = -1.;
  Eigen::Matrix3d R_GtoC;
  Vector3d p_GinC;

  void move(const BodyMotion& imu) {
    R_GtoC = camera->R_ItoC * imu.R_BtoG.transpose();
    p_GinC = camera->p_IinC - R_GtoC * imu.p_BinG;
  }
};

/// Cosine of the largest angle off the axis at which a camera sees anything, but for `limit`.
double cos_view_angle(const CameraView& camera, double limit_rad) {
  double angle = 0.;
  for (int i = 0; i < kPlaces; ++i) {
    const double along = i / (kPlaces - 1.);
    const double u = along * (camera.width_px - 1.), v = along * (camera.height_px - 1.);
    for (const Vector2d& pixel : {Vector2d(u, 0.), Vector2d(u, camera.height_px - 1.),
                                  Vector2d(0., v), Vector2d(camera.width_px - 1., v)}) {
      const std::optional<Vector3d> ray = unproject(camera, pixel);
      // What has no direction lies beyond the edge of a fisheye's image.
      angle = std::max(angle, ray ? std::acos(std::clamp(ray->z(), -1., 1.)) : limit_rad);
    }
  }
  return std::cos(std::min(angle + 1e-3, limit_rad));
}

struct Sighting {
  std::size_t landmark;
  std::size_t eye;
  Vector2d uv;
};

class LandmarkField {
 public:
  LandmarkField(std::span<const CameraView> cameras, const FeatureSimulation& options,
                std::uint64_t seed)
      : options_(options), stream_(seed, Stream::kLandmarks) {
    for (const CameraView& camera : cameras) {
      Eye eye;
      eye.camera = &camera;
      eye.cos_max_angle = cos_view_angle(camera, options.max_view_angle_rad);
      eyes_.push_back(eye);
    }
  }

  /// What all cameras see of a motion; ids are given.
  const std::vector<Sighting>& look(const ImuAfter& imu_after) {
    imu_after_ = &imu_after;
    for (Eye& eye : eyes_) eye.move(imu_after(0.));
    sightings_.clear();
    seen_.assign(eyes_.size(), 0);
    std::vector<std::size_t> others;
    for (std::size_t i = 0; i < landmarks_.size(); ++i) {
      Landmark& landmark = landmarks_[i];
      if (landmark.id == kNotTracked) {
        others.push_back(i);
      } else if (add_sightings(i) == 0) {
        landmark.id = kNotTracked;
      }
    }
    for (const std::size_t i : others) {
      if (room_for(i)) track(i);
    }
    for (std::size_t c = 0; c < eyes_.size(); ++c) {
      while (seen_[c] < options_.features && create(eyes_[c])) track(landmarks_.size() - 1);
    }
    return sightings_;
  }

  std::int64_t id(const Sighting& sighting) const { return landmarks_[sighting.landmark].id; }
  std::vector<Vector3d>& places() { return p_FinG_by_id_; }

 private:
  struct Landmark {
    Vector3d p_FinG;
    std::int64_t id = kNotTracked;
  };

  bool sees(const Eye& eye, const Vector3d& p_FinG, Vector2d& uv) const {
    const Vector3d p_FinC = eye.R_GtoC * p_FinG + eye.p_GinC;
    const double distance2 = p_FinC.squaredNorm();
    const double nearest = 0.5 * options_.landmark_min_m;
    const double farthest = 1.5 * options_.landmark_max_m;
    if (distance2 < nearest * nearest || distance2 > farthest * farthest) return false;
    if (p_FinC.z() < eye.cos_max_angle * std::sqrt(distance2)) return false;
    return project(*eye.camera, p_FinC, uv) && in_image(*eye.camera, uv) &&
           (eye.camera->line_delay_s == 0. || find_row(eye, p_FinG, uv));
  }

  /// The row that sees a point is the one that it is seen in (SIM-9).
  bool find_row(Eye eye, const Vector3d& p_FinG, Vector2d& uv) const {
    for (int i = 0; i < kRowSteps; ++i) {
      eye.move((*imu_after_)(eye.camera->after_middle_s(uv.y())));
      if (!project(*eye.camera, eye.R_GtoC * p_FinG + eye.p_GinC, uv)) return false;
    }
    return in_image(*eye.camera, uv);
  }

  int add_sightings(std::size_t i) {
    int n = 0;
    Vector2d uv;
    for (std::size_t c = 0; c < eyes_.size(); ++c) {
      // Tracks that come over from another camera can find this image full.
      if (seen_[c] >= options_.features) continue;
      if (!sees(eyes_[c], landmarks_[i].p_FinG, uv)) continue;
      sightings_.push_back({i, c, uv});
      ++seen_[c];
      ++n;
    }
    return n;
  }

  bool room_for(std::size_t i) const {
    Vector2d uv;
    for (std::size_t c = 0; c < eyes_.size(); ++c) {
      if (seen_[c] < options_.features && sees(eyes_[c], landmarks_[i].p_FinG, uv)) return true;
    }
    return false;
  }

  void track(std::size_t i) {
    landmarks_[i].id = static_cast<std::int64_t>(p_FinG_by_id_.size());
    p_FinG_by_id_.push_back(landmarks_[i].p_FinG);
    add_sightings(i);
  }

  /// A landmark that the camera sees; false when no pixel was found for it.
  bool create(const Eye& eye) {
    for (int i = 0; i < kTries; ++i) {
      // One after the other: compilers evaluate arguments in either order.
      const double v_px = stream_.uniform() * (eye.camera->height_px - 1.);
      const double u_px = stream_.uniform() * (eye.camera->width_px - 1.);
      const Vector2d pixel(u_px, v_px);
      const double distance =
          options_.landmark_min_m +
          stream_.uniform() * (options_.landmark_max_m - options_.landmark_min_m);
      const std::optional<Vector3d> ray = unproject(*eye.camera, pixel);
      if (!ray) continue;
      const Vector3d p_FinG = eye.R_GtoC.transpose() * (distance * *ray - eye.p_GinC);
      Vector2d uv;
      if (!sees(eye, p_FinG, uv)) continue;
      landmarks_.push_back({p_FinG, kNotTracked});
      return true;
    }
    return false;
  }

  const FeatureSimulation& options_;
  RandomStream stream_;
  std::vector<Eye> eyes_;
  const ImuAfter* imu_after_ = nullptr;  ///< while it looks
  std::vector<Landmark> landmarks_;
  std::vector<Vector3d> p_FinG_by_id_;
  std::vector<Sighting> sightings_;
  std::vector<int> seen_;  ///< points of each camera's image
};

/// What happens to the points of one camera on their way. Each point takes its draws whatever
/// happens to it, so that no source of errors moves the others.
class PointErrors {
 public:
  PointErrors(const FeatureSimulation& options, std::uint64_t seed, std::uint64_t camera)
      : options_(options),
        noise_(seed, Stream::kPixelNoise, camera),
        outliers_(seed, Stream::kFeatureOutliers, camera),
        dropouts_(seed, Stream::kFeatureDropouts, camera) {}

  /// False when the image does not have the point.
  bool disturb(Vector2d& uv) {
    const double sigma_px = options_.noise ? options_.sigma_px : 0.;
    const double nu = noise_.gaussian(), nv = noise_.gaussian();
    uv += sigma_px * Vector2d(nu, nv);
    const double hit = outliers_.uniform();
    const double ou = outliers_.uniform(), ov = outliers_.uniform();
    if (hit < options_.outlier_probability) {
      uv += options_.outlier_px * Vector2d(2. * ou - 1., 2. * ov - 1.);
    }
    return !(dropouts_.uniform() < options_.dropout_probability);
  }

 private:
  const FeatureSimulation& options_;
  RandomStream noise_;
  RandomStream outliers_;
  RandomStream dropouts_;
};

}  // namespace

std::vector<std::int64_t> image_times_ns(const FeatureSimulation& options) {
  const std::int64_t phase_ns = to_ns(options.phase_s);
  const std::int64_t end_ns = to_ns(options.duration_s);
  std::vector<std::int64_t> out;
  for (std::int64_t k = 0, t_ns = phase_ns; t_ns <= end_ns;
       t_ns = phase_ns + sample_time_ns(++k, options.rate_hz)) {
    out.push_back(t_ns);
  }
  return out;
}

SimulatedFeatures simulate_features(const BodyTrajectory& trajectory, const Mounting& mounting,
                                    std::span<const CameraView> cameras,
                                    const FeatureSimulation& options, std::uint64_t seed) {
  if (!(options.landmark_min_m > 0.) || !(options.landmark_max_m >= options.landmark_min_m)) {
    throw std::invalid_argument("landmarks need distances 0 < min <= max");
  }
  LandmarkField field(cameras, options, seed);
  std::vector<PointErrors> errors;
  for (std::size_t c = 0; c < cameras.size(); ++c) errors.emplace_back(options, seed, c);
  SimulatedFeatures out;
  for (const std::int64_t t_ns : image_times_ns(options)) {
    std::vector<FeatureSample> images(cameras.size());
    for (std::size_t c = 0; c < cameras.size(); ++c) {
      images[c].t_ns = camera_stamp_ns(cameras[c], options.start_ns + t_ns);
      images[c].camera = static_cast<int>(c);
    }
    const ImuAfter imu_after = [&](double after_s) {
      const double middle_s = static_cast<double>(t_ns) * 1e-9;
      if (after_s == 0.) return trajectory.imu(middle_s, mounting);
      // Rows before the begin and behind the end are those of a body at rest.
      const double t_s = std::clamp(middle_s + after_s, trajectory.begin_s(), trajectory.end_s());
      return trajectory.imu(t_s, mounting);
    };
    for (const Sighting& sighting : field.look(imu_after)) {  // (SIM-9)
      Vector2d uv = sighting.uv;
      if (!errors[sighting.eye].disturb(uv)) continue;
      images[sighting.eye].points.push_back({field.id(sighting), uv.x(), uv.y()});
    }
    out.samples.insert(out.samples.end(), images.begin(), images.end());
  }
  out.p_FinG = std::move(field.places());
  return out;
}

}  // namespace viwo::sim
