// A window of OpenCV's toolkit.
#pragma once

#include <chrono>
#include <string>

#include "viwo/view/show.hpp"

namespace viwo::view {

class Window final : public Screen {
 public:
  explicit Window(std::string title);
  ~Window() override;
  Window(const Window&) = delete;
  Window& operator=(const Window&) = delete;

  bool open() const override { return open_; }
  bool due() const override;
  void show(const Picture& picture) override;

 private:
  std::string title_;
  bool open_ = true;
  bool made_ = false;
  std::chrono::steady_clock::time_point last_{};
};

}  // namespace viwo::view
