// The sensor wpilog as the host loads it, on logs that a test writes.
#pragma once

#include <string>

#include <gmock/gmock.h>
#include <zlib.h>

#include "support.hpp"
#include "test_writer.hpp"

namespace viwo::wpilog {

class WpiLog : public SensorsInFolder {
 protected:
  /// The section of a sensor on a log of these bytes.
  std::string log(const std::string& bytes, const std::string& rest) const {
    return "{type: wpilog, path: " + write("a.wpilog", bytes) + ", " + rest + "}";
  }
  std::string gzipped(const std::string& bytes) const {
    const std::string file = (folder_ / "a.wpilog.gz").string();
    gzFile out = gzopen(file.c_str(), "wb");
    gzwrite(out, bytes.data(), static_cast<unsigned>(bytes.size()));
    gzclose(out);
    return file;
  }
};

inline constexpr std::int64_t kMs = 1000;  ///< [us]

}  // namespace viwo::wpilog
