#pragma once

#include <stdexcept>
#include <string>
#include <system_error>
#include <thread>
#include <utility>

namespace viwo {

/// A thread that does `work` for `whom`, which must catch what it throws. std::runtime_error that
/// names it when the system has no thread to give.
template <class Work>
std::thread begin_thread(const std::string& whom, Work&& work) {
  try {
    return std::thread(std::forward<Work>(work));
  } catch (const std::system_error& error) {
    throw std::runtime_error("there is no thread for " + whom + ": " + error.code().message());
  }
}

}  // namespace viwo
