// Where an installation is, and the faster copies that it may have.
//
// A package is for any processor of its architecture. It may hold the program and plugins more than
// once: as bin/viwo and lib/viwo/plugins/v<api>/NAME.so, and, compiled for more instructions, as
// lib/viwo/ISA/viwo and lib/viwo/plugins/v<api>/ISA/NAME.so. All are of one layout in memory
// (VIWO_FASTER_COPIES in viwo_options.cmake), so any of them goes with any other.
// VIWO_NO_FASTER_COPY=1 in the environment leaves the copies alone.
#pragma once

#include <filesystem>
#include <string_view>
#include <vector>

namespace viwo {

/// The instruction sets of faster copies that this processor has, the fastest first: "x86-64-v4"
/// (with AVX-512), "x86-64-v3" (AVX2, FMA, BMI).
std::vector<std::string_view> faster_instruction_sets();

/// The folder that holds bin/viwo, of which this program may be a faster copy; empty if unknown.
std::filesystem::path installation_prefix();

/// The copy of a plugin's file that is to be loaded: a faster one, or the file itself.
std::filesystem::path fastest_copy(const std::filesystem::path& plugin);

/// Goes on as the faster copy of this program; returns where there is none.
void become_faster_copy(char** argv);

}  // namespace viwo
