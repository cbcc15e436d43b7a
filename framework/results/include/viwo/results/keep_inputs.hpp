// What is read is not lost to results.
#pragma once

#include <filesystem>
#include <initializer_list>
#include <vector>

namespace viwo {

/// InputError where results of these names in `folder`, or what holds them until they are whole,
/// would replace one of the inputs.
void keep_inputs(const std::filesystem::path& folder, std::initializer_list<const char*> results,
                 const std::vector<std::filesystem::path>& inputs);

}  // namespace viwo
