#include "bag.hpp"

#include <algorithm>

#include "viwo/api/status.hpp"

namespace viwo::bag {

void check_topic(const std::string& bag, std::string_view name, std::size_t n_before) {
  constexpr std::size_t kMostTopics = 10'000, kLongest = 1024;
  if (n_before >= kMostTopics) {
    throw InputError(bag + "  has more than " + std::to_string(kMostTopics) + " topics");
  }
  if (name.size() > kLongest) {
    throw InputError(bag + "  has a topic whose name or type has " + std::to_string(name.size()) +
                     " bytes");
  }
}

void add_topic(const std::string& bag, const Topic& topic, std::vector<Topic>& topics) {
  const auto at = std::lower_bound(topics.begin(), topics.end(), topic,
                                   [](const Topic& a, const Topic& b) { return a.name < b.name; });
  if (at == topics.end() || at->name != topic.name) {
    check_topic(bag, topic.name, topics.size());
    topics.insert(at, topic);
  } else if (at->type != topic.type) {
    throw InputError(bag + "  topic '" + topic.name + "' is of two types, " + at->type + " and " +
                     topic.type);
  }
}

}  // namespace viwo::bag
