#include "viwo/rendering/textured_room.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <string>

#include "viwo/api/status.hpp"
#include "viwo/math/number_text.hpp"
#include "viwo/sim/random.hpp"

namespace viwo::rendering {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr std::size_t kTextures = 4;
/// Fine enough for what is near, coarse enough for what is far; a texture repeats after
/// texture_size texels.
constexpr float kTexelsPerMetreOfWalls = 220.F;
constexpr float kTexelsPerMetreOfFloor = 350.F;
constexpr float kTexelsPerMetreOfBlocks = 400.F;
constexpr int kPlaceTries = 50;  ///< to find a place for a block

/// Draws of one room; the textures have streams of their own.
class Builder {
 public:
  Builder(const RoomOptions& options, std::span<const Vector3d> path)
      : options_(options), path_(path), random_(options.seed, sim::Stream::kLandmarks) {
    for (std::size_t i = 0; i < kTextures; ++i) {
      textures_.push_back(std::make_shared<const Texture>(
          leaves_texture(options.texture_size, options.seed, 1 + i)));
    }
  }

  Block room() {
    Block out;
    const double middle = options_.floor_m + 0.5 * options_.height_m;
    out.centre = Vector3d(options_.centre_m.x(), options_.centre_m.y(), middle).cast<float>();
    out.half =
        Vector3d(0.5 * options_.size_m.x(), 0.5 * options_.size_m.y(), 0.5 * options_.height_m)
            .cast<float>();
    for (std::size_t i = 0; i < out.faces.size(); ++i) {
      out.faces[i] = face(i == 4 ? kTexelsPerMetreOfFloor : kTexelsPerMetreOfWalls);
    }
    return out;
  }

  std::optional<Block> block() {
    for (int i = 0; i < kPlaceTries; ++i) {
      Block out = candidate();
      if (!fits(out)) continue;
      for (Face& on : out.faces) on = face(kTexelsPerMetreOfBlocks);
      return out;
    }
    return std::nullopt;
  }

 private:
  double draw(double from, double to) { return from + random_.uniform() * (to - from); }

  Face face(float texels_per_m) {
    const auto which = static_cast<std::size_t>(draw(0., kTextures));
    return {textures_[std::min(which, kTextures - 1)], texels_per_m,
            static_cast<float>(draw(0., options_.texture_size)),
            static_cast<float>(draw(0., options_.texture_size))};
  }

  /// Somewhere beside the path: a box on the floor, or a panel that stands or hangs.
  Block candidate() {
    const auto at = static_cast<std::size_t>(draw(0., static_cast<double>(path_.size())));
    const Vector3d& from = path_[std::min(at, path_.size() - 1)];
    const double direction = draw(-M_PI, M_PI);
    const double distance = draw(options_.clearance_m, options_.reach_m);
    const bool panel = random_.uniform() < 0.3;
    const double width = draw(0.2, 0.9);
    const double depth = panel ? 0.04 : draw(0.2, 0.7);
    const double height = std::min(draw(0.15, 1.6), options_.height_m);
    const double hanging = panel && random_.uniform() < 0.7 ? draw(0., 1.2) : 0.;
    const double yaw = draw(-M_PI, M_PI);
    Block out;
    out.half = 0.5F * Vector3d(width, depth, height).cast<float>();
    out.centre =
        Vector3d(from.x() + distance * std::cos(direction),
                 from.y() + distance * std::sin(direction),
                 options_.floor_m + std::min(hanging, options_.height_m - height) + 0.5 * height)
            .cast<float>();
    out.cosine = static_cast<float>(std::cos(yaw));
    out.sine = static_cast<float>(std::sin(yaw));
    return out;
  }

  bool fits(const Block& block) const {
    const Vector2d centre = block.centre.head<2>().cast<double>();
    const double radius = block.half.head<2>().norm();
    const Vector2d room = 0.5 * options_.size_m.array() - radius;
    if (((centre - options_.centre_m).array().abs() > room.array()).any()) return false;
    const double clear = radius + options_.clearance_m;
    return std::all_of(path_.begin(), path_.end(), [&](const Vector3d& p) {
      return (p.head<2>() - centre).squaredNorm() > clear * clear;
    });
  }

  const RoomOptions& options_;
  std::span<const Vector3d> path_;
  sim::RandomStream random_;
  std::vector<std::shared_ptr<const Texture>> textures_;
};

std::string interval(double from, double to) {
  const auto rounded = [](double value) { return number_text(std::round(value * 1e3) * 1e-3); };
  return rounded(from) + " to " + rounded(to) + " m";
}

void require_inside(const RoomOptions& options, std::span<const Vector3d> path) {
  Vector3d low = path.front(), high = path.front();
  for (const Vector3d& p : path) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  const Vector2d half = 0.5 * options.size_m;
  Vector3d room_low, room_high;
  room_low << options.centre_m - half, options.floor_m;
  room_high << options.centre_m + half, options.floor_m + options.height_m;
  for (int i = 0; i < 3; ++i) {
    if (low[i] >= room_low[i] + kRoomMargin && high[i] <= room_high[i] - kRoomMargin) continue;
    throw InputError("the cameras leave the room or come closer than " + number_text(kRoomMargin) +
                     " m to it: along " + "xyz"[i] + " they move from " +
                     interval(low[i], high[i]) + ", the room reaches from " +
                     interval(room_low[i], room_high[i]));
  }
}

}  // namespace

TexturedRoom make_room(const RoomOptions& options, std::span<const Vector3d> path) {
  require_inside(options, path);
  Builder builder(options, path);
  TexturedRoom out;
  out.room = builder.room();
  for (int i = 0; i < options.blocks; ++i) {
    if (auto block = builder.block()) out.blocks.push_back(std::move(*block));
  }
  return out;
}

}  // namespace viwo::rendering
