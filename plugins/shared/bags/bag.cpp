#include "bag.hpp"

#include <algorithm>

#include "viwo/api/status.hpp"

namespace viwo::bag {

void add_topic(const std::string& bag, const Topic& topic, std::vector<Topic>& topics) {
  const auto at = std::lower_bound(topics.begin(), topics.end(), topic,
                                   [](const Topic& a, const Topic& b) { return a.name < b.name; });
  if (at == topics.end() || at->name != topic.name) {
    topics.insert(at, topic);
  } else if (at->type != topic.type) {
    throw InputError(bag + "  topic '" + topic.name + "' is of two types, " + at->type + " and " +
                     topic.type);
  }
}

}  // namespace viwo::bag
