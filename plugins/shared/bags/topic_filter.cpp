#include "topic_filter.hpp"

#include <filesystem>

#include "viwo/api/status.hpp"

namespace viwo::bag {

std::string TopicFilter::Place::operator()() const {
  return std::filesystem::path(*at.file).filename().string() + ": message " +
         std::to_string(at.number);
}

void TopicFilter::finish(const std::string& bag, const std::string& lost) const {
  if (order_.empty()) {
    throw InputError(bag + "  topic '" + topic_ + "' has no messages in the time that is read" +
                     lost);
  }
  order_.require_enough(bag, "messages");
}

}  // namespace viwo::bag
