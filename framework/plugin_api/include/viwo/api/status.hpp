// How a plugin answers the host: a Status for what is expected to happen now and then, an exception
// for what must not happen (broken input, broken contract).
#pragma once

#include <cstdint>
#include <stdexcept>
#include <string>

#include "viwo/api/export.hpp"

namespace viwo {

/// Outcome of a call whose failure is part of normal operation.
enum class Status : std::uint8_t {
  kOk,           ///< the output is complete
  kEnd,          ///< a sensor has no further measurement
  kRejected,     ///< this datum cannot be used (the host counts it and goes on)
  kUnsupported,  ///< the plugin does not offer this optional call
};

/// Input that the user has to mend: a log, a configuration value. The text says file, line, what is
/// wrong and what was probably meant. The command line ends with exit code 2 on it.
class VIWO_API InputError : public std::runtime_error {
 public:
  explicit InputError(const std::string& text);
  ~InputError() override;
};

/// A parameter value that a plugin's constructor refuses, for instance because two parameters
/// contradict each other. The host adds the position of `key` in the configuration file.
class VIWO_API ParamError : public InputError {
 public:
  ParamError(std::string key, const std::string& text);
  ~ParamError() override;
  const std::string& key() const { return key_; }

 private:
  std::string key_;
};

/// A plugin does what its contract forbids: it drops a block that it does not own, or declares
/// something after the start. The host turns it off.
class VIWO_API ContractError : public std::logic_error {
 public:
  explicit ContractError(const std::string& text);
  ~ContractError() override;
};

}  // namespace viwo
