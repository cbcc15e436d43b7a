// OpenCV without what it says on stderr itself.
#pragma once

#include <opencv2/core/utils/logger.hpp>

namespace viwo {

/// As long as it lives.
class SilentOpenCv {
 public:
  SilentOpenCv() : level_(cv::utils::logging::setLogLevel(cv::utils::logging::LOG_LEVEL_SILENT)) {}
  ~SilentOpenCv() { cv::utils::logging::setLogLevel(level_); }
  SilentOpenCv(const SilentOpenCv&) = delete;
  SilentOpenCv& operator=(const SilentOpenCv&) = delete;

 private:
  cv::utils::logging::LogLevel level_;
};

}  // namespace viwo
