// Which numbers of an entry's payloads are used.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "schema.hpp"

namespace viwo::wpilog {

/// Fields of each element of a payload.
struct Pick {
  std::vector<Field> fields;  ///< within one element
  std::size_t element = 0;    ///< size of one [bytes]
  /// How many elements a payload has: one, any number, or one and whatever stands behind it.
  enum class Many : std::uint8_t { kOne, kAny, kOneAndMore } many = Many::kOne;

  /// Robots have fewer modules. Of a payload of a byte each a megabyte would become 8 of numbers.
  static constexpr std::size_t kMostElements = 64;

  /// Appends the numbers of all elements; false for a payload of another size.
  bool decode(std::string_view payload, std::vector<double>& out) const;
};

/// What a drive number of a swerve module is.
enum class Drive : std::uint8_t { kSaidByParameters, kRate, kAngle };

struct ModulePick {
  Pick pick;  ///< of each module the drive, then the steering angle
  Drive drive = Drive::kSaidByParameters;
};

/// Of one type of entries; nothing when it has no such numbers. `path` of members and indices
/// within it, or empty. InputError for a struct whose schema is missing or wrong.
std::optional<Pick> pick_number(const std::string& type, std::string_view path,
                                const Schemas& schemas);
/// The same, or the quaternion w, x, y, z of a Rotation3d.
std::optional<Pick> pick_heading(const std::string& type, std::string_view path,
                                 const Schemas& schemas);
/// Swerve modules: structs with speed (or velocity) or distance, and an angle; or, of arrays of
/// numbers, pairs of angle and speed.
std::optional<ModulePick> pick_modules(const std::string& type, const Schemas& schemas);
/// x, y, yaw, or x, y, z and a quaternion w, x, y, z, as Pose2d and Pose3d have them, or arrays of
/// 3 or 7 numbers; `size`: of a payload, 0 where it is not known.
std::optional<Pick> pick_pose(const std::string& type, std::size_t size, const Schemas& schemas);

}  // namespace viwo::wpilog
