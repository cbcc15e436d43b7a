// One file of a ROS 2 bag, whatever it is stored by.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "bag.hpp"

namespace viwo::bag {

/// All of it may be called from any thread. InputError "file  what" for everything that is wrong.
class BagFile {
 public:
  virtual ~BagFile() = default;

  virtual const std::string& name() const = 0;
  virtual const std::vector<Topic>& topics() const = 0;
  virtual bool is_empty() const = 0;
  virtual std::int64_t begin_ns() const = 0;  ///< of the first message
  /// As Bag::damage().
  virtual std::string damage() const { return {}; }
  /// As Bag::read(); the messages of topics that this file does not have are none.
  virtual void read(const std::vector<Wanted>& wanted, std::int64_t from_ns, std::int64_t to_ns,
                    const std::function<void(const Message&)>& visit, Rejections& damage) const = 0;
};

}  // namespace viwo::bag
