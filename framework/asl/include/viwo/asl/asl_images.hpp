// Images of log folders in the layout of the EuRoC/ASL datasets: camN/data.csv with the stamps
// [ns] and file names, the files in camN/data.
#pragma once

#include <filesystem>
#include <span>

#include "viwo/api/measurement.hpp"
#include "viwo/log/recording.hpp"
#include "viwo/log/table_reader.hpp"

namespace viwo::log {

using ImageRecording = Recording<ImageSample>;

inline constexpr const char* kNoImageFile = "image file that is missing";

/// The text in a column as the name of a file; InputError for one that leads out of its folder: a
/// recording names no files but its own.
std::filesystem::path image_name(const TableReader& table, std::size_t column);

/// The images of the camera folders, index in the list = camera, merged by their stamps, at equal
/// stamps by camera. Files are looked for now, read when their pixels are needed (ImageFile). Rows
/// whose file is missing are dropped and counted, the first one with its name. InputError for a
/// missing folder or table, a table without data, a wrong row ("file:line  what"), when the first
/// image of a camera is missing, or when more are than the limits allow.
ImageRecording read_asl_images(std::span<const std::filesystem::path> folders,
                               const LogLimits& limits);

}  // namespace viwo::log
