// Layouts of WPILib's packed structs, from their schemas ("double speed;Rotation2d angle").
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace viwo::wpilog {

enum class NumberType : std::uint8_t { kBool, kSigned, kUnsigned, kFloat };

/// A number within packed bytes, little endian.
struct Field {
  NumberType type = NumberType::kFloat;
  std::size_t offset = 0;  ///< [bytes]
  std::size_t size = 8;    ///< [bytes]
  unsigned shift = 0;      ///< of a bit-field, from the least significant bit
  unsigned bits = 0;       ///< 0: all of it

  /// InputError never: `bytes` must reach behind the field.
  double read(std::string_view bytes) const;
};

/// One member of a struct: a number, a struct, or an array of them.
struct Member {
  std::string name;
  Field number;             ///< whose offset is that of the member; of the first of an array
  std::string struct_name;  ///< empty for a number
  std::size_t stride = 0;   ///< from one of an array to the next [bytes]
  std::size_t count = 1;
  bool is_array = false;
};

struct Layout {
  std::vector<Member> members;
  std::size_t size = 0;  ///< [bytes]
  int depth = 1;         ///< structs within each other
};

/// The schemas of a log, by the names of their structs.
class Schemas {
 public:
  void add(const std::string& name, std::string_view text);
  /// A schema that was passed over.
  void add_too_long(const std::string& name);

  /// InputError "struct 'X': what" for a schema that is not there, is wrong, contains itself, or is
  /// there in two versions.
  const Layout& layout(const std::string& name) const;

  /// The number at a path of members and indices, "angle/value" or "modules/2/speed", or that of a
  /// struct there that has no other ("angle"); nothing when there is none. InputError as layout().
  std::optional<Field> find(const std::string& name, std::string_view path) const;
  /// The number of a struct that has one member, which is a number or such a struct.
  std::optional<Field> only_number(const std::string& name) const;

 private:
  struct Schema {
    std::string text;
    enum class State : std::uint8_t {
      kNew,
      kBeingRead,
      kRead,
      kTwice,
      kTooLong
    } state = State::kNew;
    Layout layout;
    std::string error;  ///< of a schema that was read; empty: none
  };

  Layout read(const std::string& text) const;

  mutable std::map<std::string, Schema, std::less<>> schemas_;
  mutable int depth_ = 0;  ///< of what is being read
};

}  // namespace viwo::wpilog
