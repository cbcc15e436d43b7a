#include "schema.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>

#include "log_file.hpp"
#include "viwo/api/status.hpp"
#include "viwo/log/text.hpp"

namespace viwo::wpilog {
namespace {

constexpr std::string_view kBlanks = " \t\r\n\f\v";
constexpr int kDeepest = 32;
constexpr std::size_t kMostMembers = 1000;
constexpr const char* kTooDeep = "more than 32 structs within each other";

struct TypeName {
  std::string_view name;
  NumberType type;
  std::size_t size;
};

constexpr std::array kTypes = {
    TypeName{"bool", NumberType::kBool, 1},       TypeName{"char", NumberType::kUnsigned, 1},
    TypeName{"int8", NumberType::kSigned, 1},     TypeName{"int16", NumberType::kSigned, 2},
    TypeName{"int32", NumberType::kSigned, 4},    TypeName{"int64", NumberType::kSigned, 8},
    TypeName{"uint8", NumberType::kUnsigned, 1},  TypeName{"uint16", NumberType::kUnsigned, 2},
    TypeName{"uint32", NumberType::kUnsigned, 4}, TypeName{"uint64", NumberType::kUnsigned, 8},
    TypeName{"float", NumberType::kFloat, 4},     TypeName{"float32", NumberType::kFloat, 4},
    TypeName{"double", NumberType::kFloat, 8},    TypeName{"float64", NumberType::kFloat, 8}};

std::string_view trim(std::string_view text) {
  const std::size_t first = text.find_first_not_of(kBlanks);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(kBlanks) - first + 1);
}

[[noreturn]] void refuse(std::string_view declaration, const std::string& what) {
  throw InputError("declaration " + log::quoted(declaration) + ": " + what);
}

/// A declaration taken apart.
struct Declaration {
  std::string_view whole, type, name;
  bool is_enum = false;
  std::optional<std::size_t> count;  ///< of an array
  std::optional<std::size_t> bits;   ///< of a bit-field
};

/// What stands before the type: "enum {...}" or "{...}".
bool take_enum(std::string_view& rest) {
  std::string_view after = rest;
  if (after.starts_with("enum")) after = trim(after.substr(4));
  if (!after.starts_with('{')) return false;
  const std::size_t end = after.find('}');
  if (end == std::string_view::npos) refuse(rest, "an enum without its '}'");
  rest = trim(after.substr(end + 1));
  return true;
}

std::size_t count_in(std::string_view whole, std::string_view text) {
  const auto count = log::parse_integer(trim(text));
  if (!count || *count < 1 || *count > kMaxPayload) refuse(whole, "no number of what there is");
  return static_cast<std::size_t>(*count);
}

Declaration take_apart(std::string_view whole) {
  Declaration out;
  out.whole = whole;
  std::string_view rest = whole;
  out.is_enum = take_enum(rest);
  const std::size_t type_end = rest.find_first_of(kBlanks);
  if (type_end == std::string_view::npos) refuse(whole, "a type and a name are needed");
  out.type = rest.substr(0, type_end);
  rest = trim(rest.substr(type_end));
  const std::size_t name_end = rest.find_first_of("[:");
  out.name = trim(rest.substr(0, name_end));
  if (out.name.empty() || out.name.find_first_of(kBlanks) != std::string_view::npos) {
    refuse(whole, "a type and a name are needed");
  }
  if (name_end == std::string_view::npos) return out;
  const bool is_array = rest[name_end] == '[';
  rest = trim(rest.substr(name_end + 1));
  if (!is_array) {
    out.bits = count_in(whole, rest);
  } else if (!rest.ends_with(']')) {
    refuse(whole, "an array without its ']', or of bits");
  } else {
    out.count = count_in(whole, rest.substr(0, rest.size() - 1));
  }
  return out;
}

/// Puts members one behind the other, bit-fields together where they fit.
class LayoutBuilder {
 public:
  void add_number(const Declaration& declaration, const TypeName& type) {
    if (declaration.is_enum && !is_integer(type))
      refuse(declaration.whole, "an enum of no integer");
    Member member;
    member.name = declaration.name;
    member.number = {type.type, layout_.size, type.size, 0, 0};
    if (declaration.bits) {
      place_bits(declaration, type, *declaration.bits, member.number);
      push(declaration, std::move(member));
    } else {
      add(declaration, std::move(member), type.size);
    }
  }
  void add_struct(const Declaration& declaration, const Layout& inner) {
    if (declaration.bits || declaration.is_enum) {
      refuse(declaration.whole, "only integers and bool have bits, only integers are enums");
    }
    Member member;
    member.name = declaration.name;
    member.number.offset = layout_.size;
    member.struct_name = declaration.type;
    layout_.depth = std::max(layout_.depth, inner.depth + 1);
    if (layout_.depth > kDeepest) refuse(declaration.whole, kTooDeep);
    add(declaration, std::move(member), inner.size);
  }
  Layout finish() { return std::move(layout_); }

 private:
  static bool is_integer(const TypeName& type) {
    return type.type == NumberType::kSigned ||
           (type.type == NumberType::kUnsigned && type.name != "char");
  }

  void add(const Declaration& declaration, Member member, std::size_t size) {
    member.stride = size;
    member.count = declaration.count.value_or(1);
    member.is_array = declaration.count.has_value();
    grow(declaration, size * member.count);  // both at most kMaxPayload
    push(declaration, std::move(member));
    unit_size_ = 0;
  }

  void push(const Declaration& declaration, Member member) {
    if (layout_.members.size() == kMostMembers) refuse(declaration.whole, "too many members");
    const auto same = [&](const Member& other) { return other.name == member.name; };
    if (std::any_of(layout_.members.begin(), layout_.members.end(), same)) {
      refuse(declaration.whole, "a member of that name is there already");
    }
    layout_.members.push_back(std::move(member));
  }

  void place_bits(const Declaration& declaration, const TypeName& type, std::size_t bits,
                  Field& field) {
    const bool is_bool = type.type == NumberType::kBool;
    if (!is_bool && !is_integer(type)) refuse(declaration.whole, "bits of no integer");
    if (bits > (is_bool ? 1 : 8 * type.size)) refuse(declaration.whole, "too many bits");
    const bool same = is_bool ? unit_size_ > 0 : unit_size_ == type.size;
    if (!same || used_bits_ + bits > 8 * unit_size_) {
      unit_size_ = type.size;
      used_bits_ = 0;
      unit_ = layout_.size;
      grow(declaration, unit_size_);
    }
    field.offset = unit_;
    field.size = unit_size_;
    field.shift = static_cast<unsigned>(used_bits_);
    field.bits = static_cast<unsigned>(bits);
    used_bits_ += bits;
  }

  void grow(const Declaration& declaration, std::size_t size) {
    layout_.size += size;
    if (layout_.size > kMaxPayload) refuse(declaration.whole, "a struct of more than 1 MiB");
  }

  Layout layout_;
  std::size_t unit_size_ = 0;  ///< of what the last bit-field is in; 0: none
  std::size_t unit_ = 0;       ///< its offset
  std::size_t used_bits_ = 0;
};

}  // namespace

double Field::read(std::string_view bytes) const {
  std::uint64_t value = little_endian(bytes.data() + offset, size);
  if (type == NumberType::kFloat) {
    if (size == 8) return std::bit_cast<double>(value);
    return static_cast<double>(std::bit_cast<float>(static_cast<std::uint32_t>(value)));
  }
  const unsigned width = bits > 0 ? bits : static_cast<unsigned>(8 * size);
  value = value >> shift << (64 - width);  // the rest is zero, the sign is the highest bit
  if (type == NumberType::kSigned) {
    return static_cast<double>(static_cast<std::int64_t>(value) >> (64 - width));
  }
  value >>= 64 - width;
  return type == NumberType::kBool ? (value != 0 ? 1. : 0.) : static_cast<double>(value);
}

void Schemas::add(const std::string& name, std::string_view text) {
  const auto [known, is_new] = schemas_.try_emplace(name);
  if (is_new) known->second.text = text;
  if (known->second.text != text) known->second.state = Schema::State::kTwice;
}

void Schemas::add_too_long(const std::string& name) {
  schemas_[name].state = Schema::State::kTooLong;
}

Layout Schemas::read(const std::string& text) const {
  LayoutBuilder builder;
  for (std::string_view rest = text; !rest.empty();) {
    const std::size_t end = std::min(rest.find(';'), rest.size());
    const std::string_view whole = trim(rest.substr(0, end));
    rest.remove_prefix(std::min(end + 1, rest.size()));
    if (whole.empty()) continue;
    const Declaration declaration = take_apart(whole);
    const auto* const type = std::find_if(kTypes.begin(), kTypes.end(), [&](const TypeName& t) {
      return t.name == declaration.type;
    });
    if (type != kTypes.end()) {
      builder.add_number(declaration, *type);
    } else {
      builder.add_struct(declaration, layout(std::string(declaration.type)));
    }
  }
  return builder.finish();
}

const Layout& Schemas::layout(const std::string& name) const {
  using State = Schema::State;
  const auto fail = [&name](const std::string& what) {
    throw InputError("struct " + log::quoted(name) + ": " + what);
  };
  const auto found = schemas_.find(name);
  if (found == schemas_.end()) fail("the log has no schema of it");
  Schema& schema = found->second;
  if (schema.state == State::kTooLong) {
    fail("its schema has more than 1 MiB and was passed over");
  }
  if (schema.state == State::kTwice) fail("the log has two schemas of it");
  if (schema.state == State::kBeingRead) fail("it contains itself");
  if (schema.state == State::kNew) {
    schema.state = State::kBeingRead;
    try {
      if (++depth_ > kDeepest) fail(kTooDeep);
      schema.layout = read(schema.text);
    } catch (const InputError& error) {
      schema.error = error.what();
    }
    --depth_;
    schema.state = State::kRead;
  }
  if (!schema.error.empty()) fail(schema.error);
  return schema.layout;
}

std::optional<Field> Schemas::find(const std::string& name, std::string_view path) const {
  const Layout* inner = &layout(name);
  std::size_t offset = 0;
  for (;;) {
    std::size_t end = std::min(path.find('/'), path.size());
    const auto member =
        std::find_if(inner->members.begin(), inner->members.end(),
                     [&](const Member& m) { return m.name == path.substr(0, end); });
    if (member == inner->members.end()) return std::nullopt;
    path.remove_prefix(std::min(end + 1, path.size()));
    if (member->is_array) {
      end = std::min(path.find('/'), path.size());
      const auto index = log::parse_integer(path.substr(0, end));
      if (!index || *index < 0 || *index >= static_cast<std::int64_t>(member->count)) {
        return std::nullopt;
      }
      offset += static_cast<std::size_t>(*index) * member->stride;
      path.remove_prefix(std::min(end + 1, path.size()));
    }
    if (member->struct_name.empty()) {
      if (!path.empty()) return std::nullopt;
      Field field = member->number;
      field.offset += offset;
      return field;
    }
    offset += member->number.offset;
    if (path.empty()) {
      auto field = only_number(member->struct_name);
      if (field) field->offset += offset;
      return field;
    }
    inner = &layout(member->struct_name);
  }
}

std::optional<Field> Schemas::only_number(const std::string& name) const {
  const Layout& all = layout(name);
  if (all.members.size() != 1 || all.members[0].is_array) return std::nullopt;
  const Member& member = all.members[0];  // at offset 0
  return member.struct_name.empty() ? member.number : only_number(member.struct_name);
}

}  // namespace viwo::wpilog
