// A part of an experiment that is run by itself, on one of several machines say.
#pragma once

#include <cstddef>
#include <string>

namespace viwo::experiment {

/// The cells k of an experiment with k mod count = index.
struct Shard {
  int index = 0;
  int count = 1;

  bool has(std::size_t cell) const {
    return cell % static_cast<std::size_t>(count) == static_cast<std::size_t>(index);
  }
};

/// "I/N": each a number, or the name of an environment variable that has it, as the engines of
/// arrays of jobs set them. I counts from 0 or from 1: N is 0. Throws InputError.
Shard read_shard(const std::string& text);

}  // namespace viwo::experiment
