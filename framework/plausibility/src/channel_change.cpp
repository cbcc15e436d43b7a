#include "viwo/plausibility/channel_change.hpp"

#include <algorithm>
#include <bit>
#include <numbers>
#include <numeric>
#include <utility>

#include "viwo/math/significant.hpp"
#include "viwo/wheel/twist_solver.hpp"

namespace viwo {
namespace {

constexpr double kDegree = std::numbers::pi / 180., kRevolution = 2. * std::numbers::pi;

/// What angles are in, and what they have been taken for.
struct SteerUnit {
  double scale;
  const char* text;
};
constexpr std::array<SteerUnit, 6> kSteerUnits = {{
    {kDegree, "in degrees"},
    {kRevolution, "in turns"},
    {1. / kDegree, "in radians, and are taken for degrees"},
    {1. / kRevolution, "in radians, and are taken for turns"},
    {kDegree / kRevolution, "in degrees, and are taken for turns"},
    {kRevolution / kDegree, "in turns, and are taken for degrees"},
}};

using Order = ChannelChange::Order;

Order in_order() {
  Order order;
  std::iota(order.begin(), order.end(), std::size_t{0});
  return order;
}

/// Channels that are not where they are read.
std::vector<std::size_t> moved(const Order& order) {
  std::vector<std::size_t> channels;
  for (std::size_t i = 0; i < order.size(); ++i) {
    if (order[i] != i) channels.push_back(i);
  }
  return channels;
}

template <class Values>
void reorder(const Order& order, Values& values) {
  const Values read = values;
  for (std::size_t i = 0; i < order.size(); ++i) values[i] = read[order[i]];
}

/// "with drive_1 and drive_2 exchanged: their order", `name` being "drive_".
std::string text_of(const Order& order, const std::string& name, const std::string& exchanged) {
  const std::vector<std::size_t> channels = moved(order);
  if (channels.size() == 2) {
    return " with " + exchanged + std::to_string(channels[0] + 1) + " and " + name +
           std::to_string(channels[1] + 1) + " exchanged: their order";
  }
  std::string text;
  for (const std::size_t i : channels) {
    text += (text.empty() ? " if " : ", ") + name + std::to_string(i + 1) +
            (text.empty() ? " is what is read as " : " ") + name + std::to_string(order[i] + 1);
  }
  return text + ": their order";
}

}  // namespace

std::vector<ChannelChange> channel_changes(const ModelDescription& description) {
  std::vector<ChannelChange> changes = {{}};
  const auto add_pairs = [&changes](std::size_t n, ChannelChange::Kind kind) {
    for (std::size_t a = 0; a < n; ++a) {
      for (std::size_t b = a + 1; b < n; ++b) {
        ChannelChange& change = changes.emplace_back(ChannelChange{kind});
        change.order = in_order();
        std::swap(change.order[a], change.order[b]);
      }
    }
  };
  const auto n_drive = static_cast<std::size_t>(description.n_drive);
  const auto n_steer = static_cast<std::size_t>(description.n_steer);
  for (std::size_t a = 0; a < n_drive; ++a) changes.push_back({ChannelChange::kDriveScale, a});
  add_pairs(n_drive, ChannelChange::kDriveOrder);
  for (std::size_t a = 0; a < n_steer; ++a) changes.push_back({ChannelChange::kSteerSign, a});
  add_pairs(n_steer, ChannelChange::kSteerOrder);
  if (n_steer > 1) changes.push_back({ChannelChange::kSteerSigns});
  for (const SteerUnit& unit : kSteerUnits) {
    if (n_steer > 0) changes.push_back({ChannelChange::kSteerUnit, 0, 0, unit.scale});
  }
  if (n_steer == n_drive) add_pairs(n_drive, ChannelChange::kWheelOrder);
  for (std::size_t a = 0; a < n_drive; ++a) {
    for (const double scale : {2., 0.5}) {
      changes.push_back({ChannelChange::kDriveScale, a, 0, scale});
    }
  }
  return changes;
}

std::vector<ChannelChange> order_changes(const ModelDescription& description) {
  constexpr int kMost = 5;
  std::vector<ChannelChange> changes;
  const auto add_orders = [&changes](int n, ChannelChange::Kind kind) {
    if (n > kMost) return;
    Order order = in_order();
    while (std::next_permutation(order.begin(), order.begin() + n)) {
      if (moved(order).size() > 2) changes.push_back({kind, 0, 0, -1., order});
    }
  };
  add_orders(description.n_drive, ChannelChange::kDriveOrder);
  add_orders(description.n_steer, ChannelChange::kSteerOrder);
  if (description.n_steer == description.n_drive) {
    add_orders(description.n_drive, ChannelChange::kWheelOrder);
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
      changes.push_back({ChannelChange::kSideScale, 0, side, scale});
    }
  }
  return changes;
}

void ChannelChange::undo(EncoderSample& sample) const {
  switch (kind) {
    case kNone:
      break;
    case kDriveScale:
      sample.drive_rad_per_s[channel] *= scale;
      break;
    case kDriveOrder:
      reorder(order, sample.drive_rad_per_s);
      break;
    case kSteerSign:
      sample.steer_rad[channel] *= -1.;
      break;
    case kSteerOrder:
      reorder(order, sample.steer_rad);
      break;
    case kSteerSigns:
      for (double& angle : sample.steer_rad) angle *= -1.;
      break;
    case kWheelOrder:
      reorder(order, sample.drive_rad_per_s);
      reorder(order, sample.steer_rad);
      break;
    case kSteerUnit:
      for (double& angle : sample.steer_rad) angle *= scale;
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
  const std::string number = std::to_string(channel + 1);
  switch (kind) {
    case kNone:
    case kNoSteering:
      break;
    case kDriveScale:
      if (scale < 0.) {
        return "drive_" + number + " turns opposite to what the other wheels say: its sign";
      }
      return "drive_" + number + " turns " + significant(1. / scale, 2) +
             " times as fast as the other wheels say: its gear ratio, or counts per turn";
    case kDriveOrder:
      return "drives contradict each other, and do not" + text_of(order, "drive_", "drive_");
    case kSteerSign:
      return "steer_" + number + " turns opposite to what the other wheels say: its sign";
    case kSteerOrder:
      return "wheels contradict each other, and do not" + text_of(order, "steer_", "steer_");
    case kSteerSigns:
      return "wheels contradict each other, and do not with all steering angles reversed: their "
             "sign, or left and right of the wheels are exchanged";
    case kWheelOrder:
      return "wheels contradict each other, and do not" +
             text_of(order, moved(order).size() == 2 ? "" : "wheel ",
                     "drive and steering of wheels ");
    case kSteerUnit:
      return "wheels contradict each other, and do not if the steering angles are " +
             std::string(std::ranges::find(kSteerUnits, scale, &SteerUnit::scale)->text);
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

bool ChannelChange::moves_many() const {
  const bool is_order = kind == kDriveOrder || kind == kSteerOrder || kind == kWheelOrder;
  return is_order && moved(order).size() > 2;
}

std::string text_of(const std::vector<ChannelChange>& changes) {
  std::string text;
  for (const ChannelChange& change : changes) {
    text += (text.empty() ? "" : " - or, which explains it as well, ") + change.text();
  }
  return text;
}

std::vector<Remedy> ChannelChange::remedies(const std::string& sensor,
                                            const ModelDescription& description) const {
  const auto n_drive = static_cast<std::size_t>(description.n_drive);
  const auto n_steer = static_cast<std::size_t>(description.n_steer);
  const std::string section = "sensors." + sensor + ".";
  const auto factor = [&](std::size_t i) {
    const bool is_changed = kind == kSideScale ? (side >> i & 1u) != 0 : i == channel;
    return is_changed || kind == kSteerSigns ? significant(scale, 2) : "1";
  };
  // Of which channel that is which is read as channel i.
  const auto place = [&](std::size_t i) {
    return std::to_string(std::find(order.begin(), order.end(), i) - order.begin() + 1);
  };
  const Remedy drives{section + "drive_channel", yaml_list(n_drive, place)};
  const Remedy steers{section + "steer_channel", yaml_list(n_steer, place)};
  switch (kind) {
    case kNone:
    case kNoSteering:
      break;
    case kDriveScale:
    case kSideScale:
      return {{section + "drive_scale", yaml_list(n_drive, factor)}};
    case kDriveOrder:
      return {drives};
    case kSteerSign:
    case kSteerSigns:
      return {{section + "steer_scale", yaml_list(n_steer, factor)}};
    case kSteerOrder:
      return {steers};
    case kWheelOrder:
      return {drives, steers};
    case kSteerUnit:
      return {{section + "steer_scale",
               yaml_list(n_steer, [this](std::size_t) { return significant(scale, 15); })}};
  }
  return {};
}

}  // namespace viwo
