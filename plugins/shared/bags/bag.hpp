// A bag: messages on topics, as a file format presents them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "field_reader.hpp"
#include "viwo/api/rejections.hpp"

namespace viwo::bag {

using Bytes = std::vector<std::uint8_t>;

struct Topic {
  std::string name;
  std::string type;  ///< as the bag has it
};

/// InputError where a bag has more topics, `n_before` without this one, or longer names than a
/// recording of a robot has: they are kept, searched and suggested.
void check_topic(const std::string& bag, std::string_view name, std::size_t n_before);

/// Adds a topic of the bag `bag` to `topics`, which stay in the order of their names; one that is
/// there already must have the same type (InputError, also as for check_topic()).
void add_topic(const std::string& bag, const Topic& topic, std::vector<Topic>& topics);

/// A topic that is wanted.
struct Wanted {
  std::string name;
  /// Its messages are large: read() gives the first kHeadBytes (or more), and `load` for the rest.
  bool large = false;
};

inline constexpr std::size_t kHeadBytes = 4096;

/// One message, as long as the visit.
struct Message {
  std::size_t topic = 0;         ///< index in what was wanted
  std::int64_t received_ns = 0;  ///< when the recorder had it
  std::int64_t number = 0;       ///< of its topic in its file, from 1
  const std::string* file = nullptr;
  std::span<const std::uint8_t> bytes;
  /// Reads all its bytes again, later, as long as the bag lives, from any thread. InputError.
  /// Only of large topics.
  std::function<void(Bytes&)> load;
};

/// Everything that is wrong with a file is an InputError "file  what".
class Bag {
 public:
  virtual ~Bag() = default;
  /// For messages: the file or the folder.
  virtual const std::string& name() const = 0;
  virtual const std::vector<Topic>& topics() const = 0;
  /// When the first message of any topic was received; 0 of an empty bag.
  virtual std::int64_t begin_ns() const = 0;
  /// Why topics may be missing, with the place; empty: they are not.
  virtual std::string damage() const { return {}; }
  /// Visits the messages that were received in [from_ns, to_ns], file after file in the order in
  /// which they were received. What a damaged file has lost is counted in `damage`.
  virtual void read(const std::vector<Wanted>& wanted, std::int64_t from_ns, std::int64_t to_ns,
                    const std::function<void(const Message&)>& visit, Rejections& damage) const = 0;
  /// The fields of a message of this bag; BrokenMessage when it is none.
  virtual std::unique_ptr<FieldReader> fields(std::span<const std::uint8_t> message) const = 0;
};

}  // namespace viwo::bag
