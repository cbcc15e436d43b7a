#include "pick.hpp"

#include <algorithm>
#include <initializer_list>

#include "log_file.hpp"
#include "viwo/log/text.hpp"

namespace viwo::wpilog {
namespace {

constexpr std::string_view kStruct = "struct:";
constexpr std::string_view kArray = "[]";

/// "struct:Pose2d[]" taken apart.
struct Type {
  explicit Type(std::string_view text) {
    is_array = text.ends_with(kArray);
    if (is_array) text.remove_suffix(kArray.size());
    is_struct = text.starts_with(kStruct);
    if (is_struct) text.remove_prefix(kStruct.size());
    base = text;
  }
  Pick::Many many() const { return is_array ? Pick::Many::kAny : Pick::Many::kOne; }

  bool is_array = false;
  bool is_struct = false;
  std::string base;
};

std::optional<Field> primitive(const std::string& base) {
  if (base == "double") return Field{NumberType::kFloat, 0, 8, 0, 0};
  if (base == "float") return Field{NumberType::kFloat, 0, 4, 0, 0};
  if (base == "int64") return Field{NumberType::kSigned, 0, 8, 0, 0};
  if (base == "boolean") return Field{NumberType::kBool, 0, 1, 0, 0};
  return std::nullopt;
}

/// The fields at these paths; nothing when one is missing.
std::optional<Pick> pick_fields(const Type& type, std::initializer_list<std::string> paths,
                                const Schemas& schemas) {
  Pick pick{{}, schemas.layout(type.base).size, type.many()};
  for (const std::string& path : paths) {
    const auto field = schemas.find(type.base, path);
    if (!field) return std::nullopt;
    pick.fields.push_back(*field);
  }
  return pick;
}

/// Of an element of `order.size()` numbers of one kind, those in this order.
Pick pick_array(Field number, std::initializer_list<std::size_t> order, Pick::Many many) {
  Pick pick{{}, order.size() * number.size, many};
  for (const std::size_t i : order) {
    pick.fields.push_back(number);
    pick.fields.back().offset = i * number.size;
  }
  return pick;
}

}  // namespace

bool Pick::decode(std::string_view payload, std::vector<double>& out) const {
  const bool fits = many == Many::kOne   ? payload.size() == element
                    : many == Many::kAny ? element > 0 && payload.size() % element == 0
                                         : payload.size() >= element;
  if (!fits || (many == Many::kAny && payload.size() / element > kMostElements)) return false;
  do {
    if (payload.size() < element) break;
    for (const Field& field : fields) out.push_back(field.read(payload));
    payload.remove_prefix(element);
  } while (many == Many::kAny);
  return true;
}

std::optional<Pick> pick_number(const std::string& type_text, std::string_view path,
                                const Schemas& schemas) {
  const Type type(type_text);
  std::size_t index = 0;
  if (type.is_array) {
    const std::size_t end = std::min(path.find('/'), path.size());
    const auto number = log::parse_integer(path.substr(0, end));
    if (!number || *number < 0 || *number > kMaxPayload) return std::nullopt;
    index = static_cast<std::size_t>(*number);
    path.remove_prefix(std::min(end + 1, path.size()));
  }
  std::optional<Field> field;
  std::size_t element = 0;
  if (type.is_struct) {
    element = schemas.layout(type.base).size;
    field = path.empty() ? schemas.only_number(type.base) : schemas.find(type.base, path);
  } else if (path.empty()) {
    field = primitive(type.base);
    if (field) element = field->size;
  }
  if (!field) return std::nullopt;
  field->offset += index * element;
  return Pick{
      {*field}, (index + 1) * element, type.is_array ? Pick::Many::kOneAndMore : Pick::Many::kOne};
}

std::optional<Pick> pick_heading(const std::string& type_text, std::string_view path,
                                 const Schemas& schemas) {
  if (auto number = pick_number(type_text, path, schemas)) return number;
  const Type type(type_text);
  if (!type.is_struct || type.is_array) return std::nullopt;
  const std::string q = (path.empty() ? "" : std::string(path) + "/") + "q/";
  return pick_fields(type, {q + "w", q + "x", q + "y", q + "z"}, schemas);
}

std::optional<ModulePick> pick_modules(const std::string& type_text, const Schemas& schemas) {
  const Type type(type_text);
  if (!type.is_struct) {
    const auto number = primitive(type.base);
    if (!type.is_array || !number || number->type != NumberType::kFloat) return std::nullopt;
    return ModulePick{pick_array(*number, {1, 0}, Pick::Many::kAny), Drive::kSaidByParameters};
  }
  for (const char* rate : {"speed", "velocity"}) {
    auto pick = pick_fields(type, {rate, "angle/value"}, schemas);
    if (pick) return ModulePick{std::move(*pick), Drive::kRate};
  }
  auto pick = pick_fields(type, {"distance", "angle/value"}, schemas);
  if (pick) return ModulePick{std::move(*pick), Drive::kAngle};
  return std::nullopt;
}

std::optional<Pick> pick_pose(const std::string& type_text, std::size_t size,
                              const Schemas& schemas) {
  const Type type(type_text);
  if (type.is_struct) {
    auto pick = pick_fields(type, {"translation/x", "translation/y", "rotation/value"}, schemas);
    if (pick) return pick;
    return pick_fields(type,
                       {"translation/x", "translation/y", "translation/z", "rotation/q/w",
                        "rotation/q/x", "rotation/q/y", "rotation/q/z"},
                       schemas);
  }
  const auto number = primitive(type.base);
  if (!type.is_array || !number || number->type != NumberType::kFloat) return std::nullopt;
  if (size == 0 || size == 3 * number->size) {
    return pick_array(*number, {0, 1, 2}, Pick::Many::kOne);
  }
  if (size == 7 * number->size) {
    return pick_array(*number, {0, 1, 2, 3, 4, 5, 6}, Pick::Many::kOne);
  }
  return std::nullopt;
}

}  // namespace viwo::wpilog
