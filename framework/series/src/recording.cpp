#include "viwo/series/recording.hpp"

#include <algorithm>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <unordered_map>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/SVD>

#include "viwo/camera/camera_model.hpp"
#include "viwo/feed/inputs.hpp"
#include "viwo/math/arrays.hpp"
#include "viwo/math/so3.hpp"
#include "viwo/math/stamp.hpp"

namespace viwo::series {
namespace {

/// The rotation between two images of a camera from the points that they share: that with which all
/// of them may have moved in one direction, each as far as it is near (their epipolar planes have a
/// line in common).
class TurnFinder {
 public:
  explicit TurnFinder(const CameraView& camera) : camera_(camera) {}

  void add(const FeatureSample& sample, CameraTurns& out) {
    std::unordered_map<std::int64_t, Sight> rays;
    for (const FeaturePoint& point : sample.points) {
      if (const auto ray = unproject(camera_, {point.u_px, point.v_px})) {
        rays[point.id] = {*ray, camera_.after_middle_s(point.v_px)};
      }
    }
    std::vector<Pair> pairs;
    double before_s = 0., now_s = 0.;  // of the rows of a rolling shutter, sums
    for (const auto& [id, sight] : rays) {
      if (const auto before = rays_.find(id); before != rays_.end()) {
        pairs.push_back({before->second.ray, sight.ray});
        before_s += before->second.after_s;
        now_s += sight.after_s;
      }
    }
    const double dt_s = seconds_between(t_ns_, sample.t_ns);
    constexpr std::size_t kFewest = 8;
    if (!rays_.empty() && pairs.size() >= kFewest && dt_s > 0.) {
      const auto n = static_cast<double>(pairs.size());
      // The points stand still: they turn in C against the camera.
      const Eigen::Matrix3d R = rotation(pairs);
      out.turns.push_back({t_ns_ + to_ns(before_s / n), sample.t_ns + to_ns(now_s / n),
                           -log_so3(R) / (dt_s + (now_s - before_s) / n)});
      out.points.push_back(n);
      // Further than what is near moves from image to image.
      constexpr double kFar = 0.25;
      out.far +=
          static_cast<double>(std::count_if(pairs.begin(), pairs.end(), [&R](const Pair& pair) {
            return (pair.now - R * pair.before).squaredNorm() > kFar * kFar;
          }));
    }
    rays_ = std::move(rays);
    t_ns_ = sample.t_ns;
  }

 private:
  struct Sight {
    Eigen::Vector3d ray;
    double after_s;  ///< the middle row
  };
  struct Pair {
    Eigen::Vector3d before, now;
  };

  static Eigen::Matrix3d best(const std::vector<Pair>& pairs) {
    Eigen::Matrix3d H = Eigen::Matrix3d::Zero();
    for (const Pair& pair : pairs) H += pair.now * pair.before.transpose();
    const Eigen::JacobiSVD<Eigen::Matrix3d> svd(H, Eigen::ComputeFullU | Eigen::ComputeFullV);
    Eigen::Matrix3d U = svd.matrixU();
    if ((U * svd.matrixV().transpose()).determinant() < 0.) U.col(2) *= -1.;
    return U * svd.matrixV().transpose();
  }

  /// Takes the rays of before to those of now.
  static Eigen::Matrix3d rotation(const std::vector<Pair>& pairs) {
    Eigen::Matrix3d R = rotation_of_far(pairs);
    std::vector<Eigen::Vector3d> normals(pairs.size());
    std::vector<double> sizes(pairs.size());
    const auto median = sizes.begin() + static_cast<std::ptrdiff_t>(sizes.size() / 2);
    Eigen::Vector3d t = Eigen::Vector3d::Zero();  // the direction in which all have moved
    constexpr int kSteps = 10;
    for (int step = 0; step < kSteps; ++step) {
      Eigen::Matrix3d M = Eigen::Matrix3d::Zero();
      for (std::size_t i = 0; i < pairs.size(); ++i) {
        normals[i] = pairs[i].now.cross(R * pairs[i].before);
        const double e = t.dot(normals[i]);
        const double w = step == 0 ? 1. : 1. / (1. + e * e / (4. * *median * *median + 1e-20));
        M += w * normals[i] * normals[i].transpose();
      }
      t = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(M).eigenvectors().col(0);
      std::transform(normals.begin(), normals.end(), sizes.begin(),
                     [&t](const Eigen::Vector3d& n) { return std::abs(t.dot(n)); });
      std::nth_element(sizes.begin(), median, sizes.end());
      // Unknown are a turn, and the two angles of t.
      const Eigen::Vector3d across = t.unitOrthogonal(), other = t.cross(across);
      Eigen::Matrix<double, 5, 5> N = Eigen::Matrix<double, 5, 5>::Zero();
      Eigen::Matrix<double, 5, 1> h = Eigen::Matrix<double, 5, 1>::Zero(), J;
      for (std::size_t i = 0; i < pairs.size(); ++i) {
        const double e = t.dot(normals[i]);
        const double w = 1. / (1. + e * e / (4. * *median * *median + 1e-20));
        J << (R * pairs[i].before).cross(t.cross(pairs[i].now)), across.dot(normals[i]),
            other.dot(normals[i]);
        N += w * J * J.transpose();
        h += w * e * J;
      }
      N.diagonal().array() += 1e-9 * N.trace();
      const Eigen::Vector3d turn = -N.ldlt().solve(h).head<3>();
      if (!turn.allFinite()) break;
      R = exp_so3(turn) * R;
      if (turn.norm() < 1e-7) break;
    }
    return R;
  }

  /// As if none had moved. What is near did: those that fit worst are left out, twice.
  static Eigen::Matrix3d rotation_of_far(std::vector<Pair> pairs) {
    Eigen::Matrix3d R = best(pairs);
    for (int round = 0; round < 2; ++round) {
      const auto off = [&](const Pair& pair) { return (pair.now - R * pair.before).squaredNorm(); };
      const auto keep = static_cast<std::ptrdiff_t>(pairs.size() - pairs.size() / 4);
      std::nth_element(pairs.begin(), pairs.begin() + keep - 1, pairs.end(),
                       [&](const Pair& a, const Pair& b) { return off(a) < off(b); });
      pairs.resize(static_cast<std::size_t>(keep));
      R = best(pairs);
    }
    return R;
  }

  CameraView camera_;
  std::int64_t t_ns_ = 0;
  std::unordered_map<std::int64_t, Sight> rays_;
};

/// A sensor and its next measurement.
struct Head {
  SensorEntry* entry = nullptr;
  Measurement next;
  std::shared_ptr<Sensor> replay;  ///< of what has been read; null: from the sensor
  std::shared_ptr<Sensor> input;   ///< what the sensor reads, if it works on another one
};

class Gatherer {
 public:
  explicit Gatherer(RunSetup& setup) : setup_(setup), plausibility_(setup) {
    recording_.setup = &setup;
    recording_.imu_sensor = setup.routes.sensor_of(Consumer::kImu);
    const std::string wheels = setup.routes.sensor_of(Consumer::kWheels);
    const auto add_wheels = [&](const std::string& sensor, const WheelSet& set) {
      if (!sensor.empty() && set.model)
        recording_.wheels.push_back({sensor, set.model, set.prior, {}, ""});
    };
    if (!setup.filter) {
      add_wheels(wheels, wheels_alone(setup));
      return;
    }
    for (const WheelSet& set : setup.filter->wheels) {
      add_wheels(set.prior.sensor.empty() ? wheels : set.prior.sensor, set);
    }
  }

  Recording gather() {
    std::vector<Head> heads;
    Inputs inputs(setup_.sensors);
    for (SensorEntry& entry : setup_.sensors) {
      if (is_live(entry)) {
        config::fail(setup_.sensors_mark,
                     "sensor '" + entry.name + "' is live, without an end: record it first");
      }
      Head head{&entry, {}, nullptr, inputs.connect(entry)};
      if (inputs.is_input(entry)) {
        while (advance(head)) inputs.keep(entry, head.next);
        head.replay = inputs.replay(entry.name);
      }
      if (advance(head)) heads.push_back(std::move(head));
    }
    while (!heads.empty()) {
      const auto first = std::min_element(
          heads.begin(), heads.end(),
          [](const Head& a, const Head& b) { return a.next.t_ns() < b.next.t_ns(); });
      add(first->entry->name, first->next.view());
      if (!advance(*first)) heads.erase(first);
    }
    plausibility_.finish();
    recording_.implausible = plausibility_.findings();
    if (!setup_.filter) look_without_filter();
    return std::move(recording_);
  }

 private:
  /// False at the end, and where a sensor breaks off.
  bool advance(Head& head) {
    const Loaded<Sensor>& sensor = head.entry->sensor;
    if (head.replay) return head.replay->next(head.next) == Status::kOk;
    try {
      const bool more = guarded(sensor.info, "next",
                                [&] { return sensor.object->next(head.next); }) == Status::kOk;
      if (more) return true;
    } catch (const InputError& error) {
      recording_.broken.emplace_back(head.entry->name, error.what());
    }
    std::vector<RejectionCount> rejections;
    guarded(sensor.info, "rejections", [&] { sensor.object->rejections(rejections); });
    for (RejectionCount& rejection : rejections) {
      recording_.rejections.emplace_back(head.entry->name, std::move(rejection));
    }
    return false;
  }

  /// Only all of it tells how the IMU is mounted.
  void look_without_filter() {
    DeadReckoned data{recording_.imu, {}, {}};
    if (!recording_.wheels.empty()) data.wheels = recording_.wheels.front().samples;
    const std::string heading = setup_.routes.sensor_of(Consumer::kHeading);
    for (const Headings& other : recording_.headings) {
      if (other.sensor == heading) data.headings = other.samples;
    }
    recording_.implausible = implausible(setup_, data, recording_.begin_ns());
  }

  void add(const std::string& sensor, SampleView sample) {
    if (sample.get_if<CalibrationSample>() != nullptr) return;
    add_stamp(sensor, sample);
    plausibility_.add(sensor, sample);
    if (const auto* imu = sample.get_if<ImuSample>()) {
      if (sensor == recording_.imu_sensor && imu->fault() == nullptr) {
        recording_.imu.push_back(*imu);
      }
    } else if (const auto* wheels = sample.get_if<EncoderSample>()) {
      add_encoders(sensor, *wheels);
    } else if (const auto* heading = sample.get_if<HeadingSample>()) {
      add_heading(sensor, *heading);
    } else if (const auto* pose = sample.get_if<PoseSample>()) {
      add_pose(sensor, false, {pose->t_ns, to_vector(pose->p_BinW_m), pose->q_BtoW_xyzw});
    } else if (const auto* state = sample.get_if<StateSample>()) {
      add_pose(sensor, true, {state->t_ns, to_vector(state->p_IinG_m), state->q_ItoG_xyzw});
    } else if (const auto* tracks = sample.get_if<FeatureSample>()) {
      add_tracks(sensor, *tracks);
    }
  }

  void add_stamp(const std::string& sensor, SampleView sample) {
    // Tracks that are made of images have their stamps.
    const auto is_maker = [&](const SensorEntry& entry) {
      return entry.name == sensor && !entry.input.empty();
    };
    if (sample.type() == sample_type<FeatureSample>() &&
        std::ranges::any_of(setup_.sensors, is_maker)) {
      return;
    }
    const int channel = sample.type().channel(sample.data());
    for (Stamps& stamps : recording_.stamps) {
      if (stamps.sensor != sensor || !(*stamps.type == sample.type())) continue;
      if (stamps.channel != channel) continue;
      stamps.t_ns.push_back(sample.t_ns());
      return;
    }
    recording_.stamps.push_back({sensor, &sample.type(), channel, {sample.t_ns()}});
  }

  void add_encoders(const std::string& sensor, const EncoderSample& sample) {
    for (Wheels& wheels : recording_.wheels) {
      if (wheels.sensor != sensor || !wheels.unusable.empty()) continue;
      try {
        wheels.model->require_channels(sample, "sensors." + sensor);
      } catch (const InputError& error) {
        wheels.unusable = error.what();
        continue;
      }
      if (sample.fault() == nullptr) wheels.samples.push_back(sample);
    }
  }

  void add_heading(const std::string& sensor, const HeadingSample& heading) {
    auto& all = recording_.headings;
    auto known = std::find_if(all.begin(), all.end(),
                              [&](const Headings& other) { return other.sensor == sensor; });
    if (known == all.end()) known = all.insert(known, {sensor, {}});
    if (heading.fault() == nullptr) known->samples.push_back(heading);
  }

  struct RawPose {
    std::int64_t t_ns;
    Eigen::Vector3d p;
    std::array<double, 4> q_xyzw;
  };
  void add_pose(const std::string& sensor, bool of_imu, const RawPose& pose) {
    auto known =
        std::find_if(recording_.poses.begin(), recording_.poses.end(),
                     [&](const Poses& p) { return p.sensor == sensor && p.of_imu == of_imu; });
    if (known == recording_.poses.end()) {
      known = recording_.poses.insert(known, Poses{sensor, of_imu, {}});
    }
    if (!pose.p.allFinite() || !all_finite(pose.q_xyzw)) return;
    const Eigen::Quaterniond q = to_quaternion(pose.q_xyzw).normalized();
    if (known->poses.empty() || pose.t_ns > known->poses.back().t_ns) {
      known->poses.push_back({pose.t_ns, pose.p, q});
    }
  }

  void add_tracks(const std::string& sensor, const FeatureSample& tracks) {
    if (!setup_.filter || tracks.camera < 0) return;
    const auto& cameras = setup_.filter->cameras;
    if (static_cast<std::size_t>(tracks.camera) >= cameras.size()) return;
    const std::pair key(sensor, tracks.camera);
    if (!finders_.contains(key)) {
      finders_.emplace(key,
                       Finder{TurnFinder(cameras[static_cast<std::size_t>(tracks.camera)].camera),
                              recording_.cameras.size()});
      recording_.cameras.push_back({sensor, tracks.camera, {}, {}});
    }
    Finder& finder = finders_.at(key);
    finder.turns.add(tracks, recording_.cameras[finder.place]);
  }

  struct Finder {
    TurnFinder turns;
    std::size_t place;
  };

  RunSetup& setup_;
  Plausibility plausibility_;
  Recording recording_;
  std::map<std::pair<std::string, int>, Finder> finders_;
};

}  // namespace

std::string Recording::label(const std::string& sensor, const SampleType& type) const {
  for (const Stamps& other : stamps) {
    if (other.sensor != sensor || *other.type == type) continue;
    // As the checks of plausibility call them.
    const bool is_wheels = type == sample_type<EncoderSample>();
    return (is_wheels ? "wheels" : std::string(type.name)) + " of " + sensor;
  }
  return sensor;
}

std::int64_t Recording::begin_ns() const {
  if (!imu.empty()) return imu.front().t_ns;
  std::int64_t first_ns = std::numeric_limits<std::int64_t>::max();
  for (const Stamps& series : stamps) first_ns = std::min(first_ns, series.t_ns.front());
  return stamps.empty() ? 0 : first_ns;
}

Recording gather(RunSetup& setup) { return Gatherer(setup).gather(); }

}  // namespace viwo::series
