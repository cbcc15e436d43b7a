// A window on a screen that is not there: Xvfb, whose pixels are a file.
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <thread>

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include "in_folder.hpp"
#include "message_of.hpp"
#include "show/window.hpp"
#ifdef VIWO_TEST_USER_INPUT
#include "user_input.hpp"
#endif

namespace viwo::view {
namespace {

namespace fs = std::filesystem;

// Before any window: a toolkit that has a screen keeps it.
TEST(Window, SaysThatThereIsNoScreen) {
  const char* display = std::getenv("DISPLAY");
  const std::string before = display != nullptr ? display : "";
  unsetenv("WAYLAND_DISPLAY");
  const auto message = [] { return testing::error_of([] { const Window window("none"); }); };
  unsetenv("DISPLAY");
  EXPECT_EQ(message(),
            "no screen to show pictures on: neither DISPLAY nor WAYLAND_DISPLAY is set; a video "
            "file needs no screen");
  setenv("DISPLAY", ":98765", 1);
  EXPECT_EQ(message(),
            "no window can be opened on the screen ':98765'; a video file needs no screen");
  if (before.empty()) {
    unsetenv("DISPLAY");
  } else {
    setenv("DISPLAY", before.c_str(), 1);
  }
}

/// One X server for all tests of a process: a toolkit connects once.
class Screen {
 public:
  Screen() {
    std::string pattern = (fs::temp_directory_path() / "viwo_screen_XXXXXX").string();
    int pipe_ends[2];
    if (mkdtemp(pattern.data()) == nullptr || pipe(pipe_ends) != 0) return;
    folder_ = pattern;
    server_ = fork();
    if (server_ == 0) {
      dup2(pipe_ends[1], 3);
      if (freopen("/dev/null", "w", stderr) == nullptr) _exit(126);
      execlp("Xvfb", "Xvfb", "-displayfd", "3", "-screen", "0", "800x600x24", "-nolisten", "tcp",
             "-fbdir", pattern.c_str(), nullptr);
      _exit(127);
    }
    close(pipe_ends[1]);
    char digit = 0;
    while (::read(pipe_ends[0], &digit, 1) == 1 && digit != '\n') number_ += digit;
    close(pipe_ends[0]);
    if (!number_.empty()) setenv("DISPLAY", (":" + number_).c_str(), 1);
  }
  ~Screen() {
    if (server_ > 0) {
      kill(server_, SIGTERM);
      waitpid(server_, nullptr, 0);
    }
    std::error_code ignored;
    fs::remove_all(folder_, ignored);
  }
  bool there() const { return !number_.empty(); }

  /// Pixels of one colour (X stores them as blue, green, red, 0).
  int count(unsigned char blue, unsigned char green, unsigned char red) const {
    const std::string bytes = testing::text_of(folder_ / "Xvfb_screen0");
    const std::string colour{static_cast<char>(blue), static_cast<char>(green),
                             static_cast<char>(red)};
    int n = 0;
    for (std::size_t i = bytes.size() % 4; i + 4 <= bytes.size(); i += 4) {
      if (bytes.compare(i, 3, colour) == 0) ++n;
    }
    return n;
  }

 private:
  fs::path folder_;
  pid_t server_ = -1;
  std::string number_;
};

class WindowTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() { screen_ = new Screen; }
  static void TearDownTestSuite() {
    delete screen_;
    screen_ = nullptr;
  }
  void SetUp() override {
    if (!screen_->there()) GTEST_SKIP() << "there is no Xvfb";
  }
  static Screen* screen_;
};

Screen* WindowTest::screen_ = nullptr;

Picture picture(std::uint8_t blue, std::uint8_t green, std::uint8_t red) {
  Picture all{400, 300, {}};
  for (int i = 0; i < 400 * 300; ++i) all.bgr.insert(all.bgr.end(), {blue, green, red});
  return all;
}

constexpr auto kPatience = std::chrono::seconds(20);

/// Shows a picture again and again until something is so; false: it never was.
template <class F>
bool show_until(Window& window, const Picture& shown, const F& is_so) {
  const auto begin = std::chrono::steady_clock::now();
  while (std::chrono::steady_clock::now() - begin < kPatience) {
    window.show(shown);
    if (is_so()) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  return false;
}

TEST_F(WindowTest, ShowsThePixelsOfThePicture) {
  Window window("pixels");
  EXPECT_TRUE(show_until(window, picture(11, 22, 33),
                         [] { return screen_->count(11, 22, 33) == 400 * 300; }));
  EXPECT_TRUE(show_until(window, picture(99, 5, 200),
                         [] { return screen_->count(99, 5, 200) == 400 * 300; }));
  EXPECT_TRUE(window.open());
}

TEST_F(WindowTest, IsDueAgainAfterAWhile) {
  Window window("due");
  EXPECT_TRUE(window.due());
  window.show(picture(1, 2, 3));
  EXPECT_FALSE(window.due());
  std::this_thread::sleep_for(std::chrono::milliseconds(45));
  EXPECT_TRUE(window.due());
}

#ifdef VIWO_TEST_USER_INPUT
TEST_F(WindowTest, ClosesForQAndEscapeAndItsButton) {
  for (const std::string what : {"q", "Escape", "x", "button"}) {
    Window window("closing");
    ASSERT_TRUE(show_until(window, picture(50, 60, 70),
                           [] { return screen_->count(50, 60, 70) == 400 * 300; }));
    const int windows =
        what == "button" ? close_window("closing") : type_key("closing", what.c_str());
    ASSERT_EQ(windows, 1);
    if (what == "x") {  // any other key
      for (int i = 0; i < 20; ++i) window.show(picture(50, 60, 70));
      EXPECT_TRUE(window.open());
      continue;
    }
    EXPECT_TRUE(show_until(window, picture(50, 60, 70), [&] { return !window.open(); })) << what;
    EXPECT_FALSE(window.due());
    window.show(picture(80, 90, 100));  // nothing happens
    EXPECT_EQ(screen_->count(80, 90, 100), 0) << what;
  }
}
#endif

}  // namespace
}  // namespace viwo::view
