// The writers of formats, and what they share.
#pragma once

#include <string>
#include <vector>

#include "robot.hpp"
#include "viwo/config/node.hpp"
#include "viwo/export/export_calibration.hpp"

namespace viwo::exports {

/// What a format does not hold of a calibration; texts for the user.
class Lost {
 public:
  explicit Lost(const Robot& robot) : robot_(robot) {}

  void add(const std::string& text) { texts_.push_back(text); }
  /// Of the sections that the format has no place for, and of what stands beside the geometry.
  void sigmas();
  void mount();
  void clocks();
  void cameras();
  void beside();
  /// All of these, of a format that has the geometry of the wheels alone.
  void all_but_geometry();
  /// What differs from wheel to wheel where the format has one number for all.
  void radii_but_the_mean(const std::vector<Wheel>& wheels);
  const std::vector<std::string>& texts() const { return texts_; }

 private:
  const Robot& robot_;
  std::vector<std::string> texts_;
};

/// Where the text is from, whether it is to be trusted, and what is lost: each line behind `mark`.
std::string head(const Robot& robot, const std::vector<std::string>& lost, const std::string& mark);

/// A number with a point, as YAML 1.1 wants it: 1 would be an integer, which ROS refuses for a
/// double, and 1e-05 a text to Python, and so to Kalibr.
config::Node real_number(double value);

std::string drive_joint(const Wheel& wheel);
std::string steer_joint(const Wheel& wheel);

/// The wheels of a mecanum base in the order front left, front right, rear left, rear right; none
/// if it has other ones.
std::vector<Wheel> corners(const Robot& robot);

Exported to_urdf(const Robot& robot);
Exported to_ros2_control(const Robot& robot);
Exported to_wpilib(const Robot& robot);
Exported to_kalibr(const Robot& robot);
Exported to_csv(const Robot& robot);

}  // namespace viwo::exports
