// export_openvins CONFIG SECONDS OUT: measurements of OpenVINS's simulator as a folder that viwo's
// sensor vio_csv reads. Compiled against OpenVINS by ../compare_peers.sh; see feed.cpp.
#include <cstdlib>
#include <fstream>
#include <iostream>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "core/VioManagerOptions.h"
#include "sim/Simulator.h"
#include "utils/opencv_yaml_parse.h"
#include "utils/print.h"

namespace {

std::ofstream table(const std::string& file, const char* header) {
  std::ofstream out(file);
  out.precision(17);
  out << header << '\n';
  return out;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 4) {
    std::cerr << "usage: export_openvins CONFIG SECONDS OUT\n";
    return 2;
  }
  const double seconds = std::atof(argv[2]);
  const std::string out = argv[3];
  ov_core::Printer::setPrintLevel("WARNING");
  auto parser = std::make_shared<ov_core::YamlParser>(argv[1]);
  ov_msckf::VioManagerOptions options;
  options.print_and_load(parser);
  options.print_and_load_simulation(parser);
  if (!parser->successful()) {
    std::cerr << "export_openvins: OpenVINS does not understand " << argv[1] << '\n';
    return 2;
  }
  ov_msckf::Simulator simulator(options);

  auto imu = table(out + "/imu.csv", "t,wx,wy,wz,ax,ay,az");
  auto features = table(out + "/features.csv", "t,cam_id,feat_id,u,v");
  auto truth =
      table(out + "/groundtruth.csv", "t,qx,qy,qz,qw,px,py,pz,vx,vy,vz,bgx,bgy,bgz,bax,bay,baz");
  double first_s = -1.0;
  while (simulator.ok()) {
    double t_s = 0.0;
    Eigen::Vector3d gyro, accel;
    if (simulator.get_next_imu(t_s, gyro, accel)) {
      Eigen::Matrix<double, 17, 1> state;
      if (first_s < 0.0) first_s = t_s;
      if (t_s - first_s > seconds) break;
      if (simulator.get_state(t_s, state)) {
        const Eigen::IOFormat commas(17, Eigen::DontAlignCols, ",", ",");
        imu << t_s << ',' << gyro.transpose().format(commas) << ','
            << accel.transpose().format(commas) << '\n';
        state(0) = t_s;
        truth << state.transpose().format(commas) << '\n';
      }
    }
    std::vector<int> cameras;
    std::vector<std::vector<std::pair<size_t, Eigen::VectorXf>>> seen;
    if (first_s >= 0.0 && simulator.get_next_cam(t_s, cameras, seen)) {
      for (std::size_t i = 0; i < cameras.size(); ++i) {
        for (const auto& [id, pixel] : seen[i]) {
          features << t_s << ',' << cameras[i] << ',' << id << ',' << pixel(0) << ',' << pixel(1)
                   << '\n';
        }
      }
    }
  }
}
