// feed CONFIG FOLDER OUT: runs a peer (OpenVINS or sqrtVINS) on a folder of measurements as viwo's
// sensor vio_csv reads it, or, where FOLDER/mav0 is there, on the images of a EuRoC folder.
// Compiled against either of them by ../compare_peers.sh, with PEER_OPENVINS or PEER_SQRTVINS. It
// only calls what they declare; the result is for measuring, not for passing on.
// Writes OUT/trajectory.tum (at the stamp of the IMU: that of the image and the estimated clock),
// OUT/timing.csv (CPU time of the thread, in ms, of an image and the inertial measurements before
// it) and OUT/peer.json; allocations are those of an epoch, and null without
// libcount_allocations.so.
#include <algorithm>
#include <array>
#include <cctype>
#include <cstddef>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <iostream>
#include <memory>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Dense>
#include <opencv2/imgcodecs.hpp>

#include "core/VioManager.h"
#include "state/State.h"
#include "state/StateHelper.h"
#include "types/IMU.h"
#include "utils/opencv_yaml_parse.h"
#include "utils/print.h"
#include "utils/sensor_data.h"

#ifdef PEER_OPENVINS
namespace peer = ov_msckf;
using Pixel = Eigen::VectorXf;
#else
namespace peer = ov_srvins;
using Pixel = Eigen::Vector2f;
#endif

// Of libcount_allocations.so, where it is preloaded.
extern "C" __attribute__((weak, visibility("default"))) unsigned long viwo_allocations();

namespace {

struct Image {
  double t_s = 0.0;
  std::vector<int> cameras;
  std::vector<std::vector<std::pair<size_t, Pixel>>> features;  // of measurements
  std::vector<std::string> files;                               // of images
};

struct Recording {
  std::vector<ov_core::ImuData> imu;
  std::vector<Image> images;
  std::vector<Eigen::Matrix<double, 17, 1>> truth;  // t, q_GtoI (JPL), p_IinG, v_IinG, biases
};

[[noreturn]] void fail(const std::string& what) {
  std::cerr << "feed: " << what << '\n';
  std::exit(2);
}

// Rows of numbers of a comma-separated table with a line of names.
template <typename Row>
void for_each_row(const std::string& file, Row&& row) {
  std::ifstream in(file);
  if (!in) fail("cannot read " + file);
  std::string line;
  std::getline(in, line);
  while (std::getline(in, line)) {
    std::vector<std::string> fields;
    std::istringstream text(line);
    for (std::string field; std::getline(text, field, ',');) fields.push_back(field);
    row(fields);
  }
}

double number(const std::string& text) { return std::strtod(text.c_str(), nullptr); }

ov_core::ImuData inertial(double t_s, const std::vector<std::string>& fields) {
  ov_core::ImuData imu;
  imu.timestamp = t_s;
  using Scalar = decltype(imu.wm)::Scalar;
  for (int i = 0; i < 3; ++i) {
    imu.wm(i) = static_cast<Scalar>(number(fields[1 + i]));
    imu.am(i) = static_cast<Scalar>(number(fields[4 + i]));
  }
  return imu;
}

Recording read_measurements(const std::string& folder) {
  Recording recording;
  for_each_row(folder + "/imu.csv", [&](const auto& fields) {
    recording.imu.push_back(inertial(number(fields[0]), fields));
  });
  for_each_row(folder + "/groundtruth.csv", [&](const auto& fields) {
    auto& state = recording.truth.emplace_back();
    for (int i = 0; i < 17; ++i) state(i) = number(fields[i]);
  });
  for_each_row(folder + "/features.csv", [&](const auto& fields) {
    const double t_s = number(fields[0]);
    const int camera = std::atoi(fields[1].c_str());
    if (recording.images.empty() || recording.images.back().t_s != t_s) {
      recording.images.push_back({t_s, {}, {}, {}});
    }
    Image& image = recording.images.back();
    if (image.cameras.empty() || image.cameras.back() != camera) {
      image.cameras.push_back(camera);
      image.features.emplace_back();
    }
    Pixel pixel(2);
    pixel << static_cast<float>(number(fields[3])), static_cast<float>(number(fields[4]));
    image.features.back().emplace_back(std::strtoull(fields[2].c_str(), nullptr, 10), pixel);
  });
  return recording;
}

// A EuRoC folder: stamps in nanoseconds, gyro before accelerometer, truth as p, q_ItoG (w first),
// v, biases.
Recording read_images(const std::string& folder, int cameras) {
  Recording recording;
  const std::string mav = folder + "/mav0/";
  for_each_row(mav + "imu0/data.csv", [&](const auto& fields) {
    recording.imu.push_back(inertial(number(fields[0]) * 1e-9, fields));
  });
  for_each_row(mav + "state_groundtruth_estimate0/data.csv", [&](const auto& fields) {
    if (fields.size() < 17) return;
    auto& state = recording.truth.emplace_back();
    const std::array<int, 17> order = {0, 5, 6, 7, 4, 1, 2, 3, 8, 9, 10, 11, 12, 13, 14, 15, 16};
    for (int i = 0; i < 17; ++i) state(i) = number(fields[order[i]]);
    state(0) *= 1e-9;
  });
  for (int camera = 0; camera < cameras; ++camera) {
    const std::string name = mav + "cam" + std::to_string(camera);
    std::size_t row = 0;
    for_each_row(name + "/data.csv", [&](const auto& fields) {
      const double t_s = number(fields[0]) * 1e-9;
      std::string file = fields[1];
      while (!file.empty() && std::isspace(static_cast<unsigned char>(file.back())) != 0)
        file.pop_back();
      if (camera == 0) recording.images.push_back({t_s, {}, {}, {}});
      while (row < recording.images.size() && recording.images[row].t_s < t_s) ++row;
      if (row == recording.images.size() || recording.images[row].t_s != t_s) return;
      recording.images[row].cameras.push_back(camera);
      recording.images[row].files.push_back(name + "/data/" + file);
    });
  }
  return recording;
}

ov_core::CameraData pictures_of(const Image& image) {
  ov_core::CameraData pictures;
  pictures.timestamp = image.t_s;
  for (std::size_t i = 0; i < image.files.size(); ++i) {
    pictures.sensor_ids.push_back(image.cameras[i]);
    pictures.images.push_back(cv::imread(image.files[i], cv::IMREAD_GRAYSCALE));
    if (pictures.images.back().empty()) fail("cannot decode " + image.files[i]);
    pictures.masks.push_back(cv::Mat::zeros(pictures.images.back().size(), CV_8UC1));
  }
  return pictures;
}

double thread_cpu_s() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

unsigned long allocations_now() { return viwo_allocations != nullptr ? viwo_allocations() : 0; }

struct Estimate {
  double clock_s;             // of the cameras behind that of the IMU
  Eigen::Quaterniond q_ItoG;  // the numbers of the peer's JPL quaternion q_GtoI
  Eigen::Vector3d p_IinG;
  Eigen::Matrix<double, 6, 6> covariance;  // orientation (JPL, left), position
};

Estimate estimate_of(peer::VioManager& system) {
  const auto state = system.get_state();
#ifdef PEER_OPENVINS
  const auto imu = state->_imu;
  const auto clock = state->_calib_dt_CAMtoIMU;
#else
  const auto imu = state->imu;
  const auto clock = state->calib_dt_CAMtoIMU;
#endif
  Estimate estimate;
  estimate.clock_s = static_cast<double>(clock->value()(0));
  const Eigen::Vector4d q = imu->quat().template cast<double>();
  estimate.q_ItoG = Eigen::Quaterniond(q(3), q(0), q(1), q(2)).normalized();
  estimate.p_IinG = imu->pos().template cast<double>();
  estimate.covariance = peer::StateHelper::get_marginal_covariance(state, {imu->q(), imu->p()})
                            .template cast<double>();
  return estimate;
}

// The normalised squared error of a pose; 6 is consistent. Truth between two of its rows: slerp.
double nees_of(const Estimate& estimate, const Recording& recording, double t_s) {
  const auto& truth = recording.truth;
  const auto next = std::lower_bound(truth.begin() + 1, truth.end() - 1, t_s,
                                     [](const auto& state, double t) { return state(0) < t; });
  const auto& a = *(next - 1);
  const auto& b = *next;
  const double s = (t_s - a(0)) / (b(0) - a(0));
  const Eigen::Quaterniond q_a(a(4), a(1), a(2), a(3));
  const Eigen::Quaterniond q_ItoG = q_a.slerp(s, Eigen::Quaterniond(b(4), b(1), b(2), b(3)));
  Eigen::Matrix<double, 6, 1> error;
  // R_GtoI(true) = exp(-theta) R_GtoI(estimated)
  const Eigen::AngleAxisd turn(q_ItoG.conjugate() * estimate.q_ItoG);
  error << -turn.angle() * turn.axis(),
      a.segment<3>(5) + s * (b - a).segment<3>(5) - estimate.p_IinG;
  return error.dot(estimate.covariance.ldlt().solve(error));
}

void start(peer::VioManager& system, const Eigen::Matrix<double, 17, 1>& state) {
  system.initialize_with_gt(state);
#ifdef PEER_SQRTVINS
  // It means these sigmas, too, but leaves zeros for the biases: it writes into columns of a matrix
  // what is read as a vector.
  Eigen::Matrix<double, 15, 1> sigmas = Eigen::Matrix<double, 15, 1>::Constant(0.02);
  sigmas.segment<3>(0).setConstant(0.017);
  sigmas.segment<3>(3).setConstant(0.05);
  sigmas.segment<3>(6).setConstant(0.01);
  peer::StateHelper::set_initial_imu_square_root_covariance(system.get_state(),
                                                            sigmas.cast<DataType>());
#endif
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 4) fail("usage: feed CONFIG FOLDER OUT");
  const std::string folder = argv[2], out = argv[3];
  ov_core::Printer::setPrintLevel("WARNING");
  auto parser = std::make_shared<ov_core::YamlParser>(argv[1]);
  peer::VioManagerOptions options;
  options.print_and_load(parser);
  if (!parser->successful()) fail(std::string("the peer does not understand ") + argv[1]);
  options.num_opencv_threads = 0;  // all in this thread
  options.use_multi_threading_pubs = false;
  options.use_multi_threading_subs = false;

  const bool of_images = std::ifstream(folder + "/mav0/cam0/data.csv").good();
  const auto cameras = static_cast<std::size_t>(options.state_options.num_cameras);
  const Recording recording = of_images ? read_images(folder, options.state_options.num_cameras)
                                        : read_measurements(folder);
  if (recording.imu.empty() || recording.images.empty() || recording.truth.size() < 2) {
    fail(folder + " has no inertial measurements, no images or no truth");
  }
  peer::VioManager system(options);

  std::ofstream trajectory(out + "/trajectory.tum"), timing(out + "/timing.csv");
  trajectory.precision(17);
  timing << "time_s,epoch_ms\n";
  const double begin_s = recording.imu.front().timestamp;
  const auto first = std::find_if(recording.truth.begin(), recording.truth.end(),
                                  [&](const auto& state) { return state(0) > begin_s - 1e-6; });
  if (first == recording.truth.end()) {
    fail(folder + " has no truth during the inertial measurements");
  }
  std::size_t next_imu = 0, epochs = 0;
  unsigned long allocations = 0;
  double nees = 0.0;
  bool started = false;
  for (const Image& image : recording.images) {
    if (of_images && image.cameras.size() != cameras) continue;  // one of a pair
    const ov_core::CameraData pictures = pictures_of(image);
    const double began_s = thread_cpu_s();
    const unsigned long allocated = allocations_now();
    // One reading beyond the image, to interpolate.
    while (next_imu < recording.imu.size() &&
           (next_imu == 0 || recording.imu[next_imu - 1].timestamp <= image.t_s)) {
      // At the first truth behind an inertial measurement, as viwo does.
      if (!started && recording.imu[next_imu].timestamp > (*first)(0) - 1e-6) {
        start(system, *first);
        started = true;
      }
      system.feed_measurement_imu(recording.imu[next_imu++]);
    }
    if (!started || image.t_s <= (*first)(0) || next_imu == recording.imu.size()) continue;
    if (of_images) {
      system.feed_measurement_camera(pictures);
    } else {
      system.feed_measurement_simulation(image.t_s, image.cameras, image.features);
    }
    const double spent_s = thread_cpu_s() - began_s;
    allocations += allocations_now() - allocated;
    const Estimate estimate = estimate_of(system);
    const Eigen::Vector4d& q = estimate.q_ItoG.coeffs();
    const double t_s = image.t_s + estimate.clock_s;
    trajectory << t_s << ' ' << estimate.p_IinG.transpose() << ' ' << q.transpose() << '\n';
    timing << image.t_s - recording.images.front().t_s << ',' << spent_s * 1e3 << '\n';
    nees += nees_of(estimate, recording, t_s);
    ++epochs;
  }
  if (epochs == 0) fail("no image was used");
  std::ofstream(out + "/peer.json")
      << "{\"epochs\": " << epochs << ", \"nees_pose\": " << nees / static_cast<double>(epochs)
      << ", \"allocations\": "
      << (viwo_allocations != nullptr ? std::to_string(allocations) : "null") << "}\n";
}
