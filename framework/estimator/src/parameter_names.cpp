// Lists of parameters for people to read.
#include <algorithm>
#include <cctype>

#include "viwo/estimator/excitation_monitor.hpp"

namespace viwo {
namespace {

/// A name that ends in a number, in its two parts; without a number: -1.
struct Numbered {
  std::string_view stem;
  int number = -1;
};

Numbered split(std::string_view name) {
  std::size_t digits = 0;
  while (digits < name.size() && digits < 4 &&
         std::isdigit(static_cast<unsigned char>(name[name.size() - 1 - digits])) != 0) {
    ++digits;
  }
  if (digits == 0) return {name};
  const std::string_view stem = name.substr(0, name.size() - digits);
  return {stem, std::stoi(std::string(name.substr(stem.size())))};
}

}  // namespace

std::string compressed(std::span<const std::string> names) {
  std::string text;
  for (std::size_t i = 0; i < names.size();) {
    const Numbered first = split(names[i]);
    std::size_t last = i;
    while (first.number >= 0 && last + 1 < names.size()) {
      const Numbered next = split(names[last + 1]);
      if (next.stem != first.stem || next.number != first.number + static_cast<int>(last + 1 - i)) {
        break;
      }
      ++last;
    }
    if (!text.empty()) text += ", ";
    text += names[i];
    if (last > i) text += (last > i + 1 ? ".." : ", ") + names[last];
    i = last + 1;
  }
  return text;
}

}  // namespace viwo
