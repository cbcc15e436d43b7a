#include "viwo/config/errors.hpp"

#include <algorithm>
#include <tuple>

#include "viwo/api/status.hpp"

namespace viwo::config {

std::string Mark::text() const {
  if (line == 0) return file;
  return file + ":" + std::to_string(line) + ":" + std::to_string(column);
}

void Errors::add(const Mark& mark, std::string text) {
  errors_.emplace_back(mark, std::move(text));
}

std::string Errors::text() const {
  auto sorted = errors_;
  std::stable_sort(sorted.begin(), sorted.end(), [](const auto& a, const auto& b) {
    return std::tie(a.first.file, a.first.line, a.first.column) <
           std::tie(b.first.file, b.first.line, b.first.column);
  });
  // Who reads further would not read them either; their number says that something else is wrong.
  constexpr std::size_t kMaxShown = 100;
  const std::size_t more = sorted.size() - std::min(sorted.size(), kMaxShown);
  sorted.resize(sorted.size() - more);
  std::string all;
  for (const auto& [mark, text] : sorted) {
    if (!all.empty()) all += '\n';
    const std::string position = mark.text();
    if (!position.empty()) all += position + "  ";
    all += text;
  }
  if (more > 0) all += "\nand " + std::to_string(more) + " more";
  return all;
}

void Errors::throw_if_any() const {
  if (!errors_.empty()) throw InputError(text());
}

void fail(const Mark& mark, const std::string& text) {
  Errors errors;
  errors.add(mark, text);
  throw InputError(errors.text());
}

}  // namespace viwo::config
