#include "viwo/plausibility/channel_change.hpp"

#include <bit>
#include <numbers>
#include <utility>

#include "viwo/math/significant.hpp"
#include "viwo/wheel/twist_solver.hpp"

namespace viwo {
namespace {

constexpr double kDegree = std::numbers::pi / 180.;

}  // namespace

std::vector<ChannelChange> channel_changes(const ModelDescription& description) {
  std::vector<ChannelChange> changes = {{}};
  const auto add_pairs = [&changes](std::size_t n, ChannelChange::Kind exchanged) {
    for (std::size_t a = 0; a < n; ++a) {
      for (std::size_t b = a + 1; b < n; ++b) changes.push_back({exchanged, a, b});
    }
  };
  const auto n_drive = static_cast<std::size_t>(description.n_drive);
  const auto n_steer = static_cast<std::size_t>(description.n_steer);
  for (std::size_t a = 0; a < n_drive; ++a) {
    changes.push_back({ChannelChange::kDriveScale, a, a});
  }
  add_pairs(n_drive, ChannelChange::kDrivesExchanged);
  for (std::size_t a = 0; a < n_steer; ++a) changes.push_back({ChannelChange::kSteerSign, a, a});
  add_pairs(n_steer, ChannelChange::kSteersExchanged);
  if (n_steer > 1) changes.push_back({ChannelChange::kSteerSigns});
  if (n_steer > 0) changes.push_back({ChannelChange::kSteersInDegrees});
  if (n_steer == n_drive) add_pairs(n_drive, ChannelChange::kWheelsExchanged);
  return changes;
}

std::vector<ChannelChange> gear_changes(const ModelDescription& description) {
  std::vector<ChannelChange> changes;
  for (std::size_t a = 0; a < static_cast<std::size_t>(description.n_drive); ++a) {
    for (const double scale : {2., 0.5}) {
      changes.push_back({ChannelChange::kDriveScale, a, a, 0, scale});
    }
  }
  return changes;
}

std::vector<ChannelChange> side_changes(const std::shared_ptr<const WheelModel>& model,
                                        const Intrinsics& x_WI) {
  const auto n = static_cast<std::size_t>(model->description().n_drive);
  TwistSolver solver(model, {});
  solver.set_intrinsics(x_WI);
  TwistSolution solution;
  std::uint32_t left = 0, right = 0;
  for (std::size_t i = 0; i < n; ++i) {
    EncoderSample alone;
    alone.n_drive = model->description().n_drive;
    alone.n_steer = model->description().n_steer;
    alone.end_ns = 1'000'000;
    alone.drive_rad_per_s[i] = 1.;
    if (solver.solve(alone, solution) != Status::kOk || solution.rank_deficient) return {};
    (solution.xi[2] > 0. ? right : left) |= 1u << i;
  }
  if (std::popcount(left) < 2 || std::popcount(right) < 2) return {};
  std::vector<ChannelChange> changes;
  for (const double scale : {-1., 2., 0.5}) {
    for (const std::uint32_t side : {left, right}) {
      changes.push_back({ChannelChange::kSideScale, 0, 0, side, scale});
    }
  }
  return changes;
}

void ChannelChange::undo(EncoderSample& sample) const {
  switch (kind) {
    case kNone:
      break;
    case kDriveScale:
      sample.drive_rad_per_s[a] *= scale;
      break;
    case kDrivesExchanged:
      std::swap(sample.drive_rad_per_s[a], sample.drive_rad_per_s[b]);
      break;
    case kSteerSign:
      sample.steer_rad[a] *= -1.;
      break;
    case kSteersExchanged:
      std::swap(sample.steer_rad[a], sample.steer_rad[b]);
      break;
    case kSteerSigns:
      for (double& angle : sample.steer_rad) angle *= -1.;
      break;
    case kWheelsExchanged:
      std::swap(sample.drive_rad_per_s[a], sample.drive_rad_per_s[b]);
      std::swap(sample.steer_rad[a], sample.steer_rad[b]);
      break;
    case kSteersInDegrees:
      for (double& angle : sample.steer_rad) angle *= kDegree;
      break;
    case kSideScale:
      for (std::size_t i = 0; i < kMaxDrives; ++i) {
        if ((side >> i & 1u) != 0) sample.drive_rad_per_s[i] *= scale;
      }
      break;
    case kNoSteering:
      sample.steer_rad.fill(0.);
      break;
  }
}

std::string ChannelChange::text() const {
  const std::string first = std::to_string(a + 1), second = std::to_string(b + 1);
  switch (kind) {
    case kNone:
    case kNoSteering:
      break;
    case kDriveScale:
      if (scale < 0.) {
        return "drive_" + first + " turns opposite to what the other wheels say: its sign";
      }
      return "drive_" + first + " turns " + significant(1. / scale, 2) +
             " times as fast as the other wheels say: its gear ratio, or counts per turn";
    case kDrivesExchanged:
      return "drives contradict each other, and do not with drive_" + first + " and drive_" +
             second + " exchanged: their order";
    case kSteerSign:
      return "steer_" + first + " turns opposite to what the other wheels say: its sign";
    case kSteersExchanged:
      return "wheels contradict each other, and do not with steer_" + first + " and steer_" +
             second + " exchanged: their order";
    case kSteerSigns:
      return "wheels contradict each other, and do not with all steering angles reversed: their "
             "sign, or left and right of the wheels are exchanged";
    case kWheelsExchanged:
      return "wheels contradict each other, and do not with drive and steering of wheels " + first +
             " and " + second + " exchanged: their order";
    case kSteersInDegrees:
      return "wheels contradict each other, and do not if the steering angles are in degrees";
    case kSideScale: {
      std::string drives;
      for (std::size_t i = 0; i < kMaxDrives; ++i) {
        if ((side >> i & 1u) == 0) continue;
        drives += (drives.empty() ? "drive_" : ", drive_") + std::to_string(i + 1);
      }
      if (scale < 0.) return drives + ", all of one side, are reversed: their sign";
      return drives + ", all of one side, turn " + significant(1. / scale, 2) +
             " times as fast as their wheels: their gear ratio, or counts per turn";
    }
  }
  return "";
}

std::vector<Remedy> ChannelChange::remedies(const std::string& sensor,
                                            const ModelDescription& description) const {
  const auto n_drive = static_cast<std::size_t>(description.n_drive);
  const auto n_steer = static_cast<std::size_t>(description.n_steer);
  const std::string section = "sensors." + sensor + ".";
  const auto factor = [&](std::size_t i) {
    const bool is_changed = kind == kSideScale ? (side >> i & 1u) != 0 : i == a;
    return is_changed || kind == kSteerSigns ? significant(scale, 2) : "1";
  };
  const auto order = [&](std::size_t i) {
    return std::to_string((i == a ? b : i == b ? a : i) + 1);
  };
  const Remedy drives{section + "drive_channel", yaml_list(n_drive, order)};
  const Remedy steers{section + "steer_channel", yaml_list(n_steer, order)};
  switch (kind) {
    case kNone:
    case kNoSteering:
      break;
    case kDriveScale:
    case kSideScale:
      return {{section + "drive_scale", yaml_list(n_drive, factor)}};
    case kDrivesExchanged:
      return {drives};
    case kSteerSign:
    case kSteerSigns:
      return {{section + "steer_scale", yaml_list(n_steer, factor)}};
    case kSteersExchanged:
      return {steers};
    case kWheelsExchanged:
      return {drives, steers};
    case kSteersInDegrees:
      return {{section + "steer_scale",
               yaml_list(n_steer, [](std::size_t) { return significant(kDegree, 15); })}};
  }
  return {};
}

}  // namespace viwo
