#include <filesystem>
#include <sstream>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include <gmock/gmock.h>
#include <sys/stat.h>

#include "in_folder.hpp"
#include "message_of.hpp"
#include "viwo/files/files.hpp"
#include "viwo/files/printable_output.hpp"
#include "viwo/files/text_writer.hpp"

namespace viwo::files {
namespace {

using testing::error_of;
using testing::InFolder;
using testing::text_of;

class TextWriterTest : public InFolder {};

TEST_F(TextWriterTest, ReportsAFullDiskAndAMissingFolder) {
  EXPECT_EQ(error_of<std::runtime_error>([] {
              TextWriter out("/dev/full");
              out << "text";
              out.close();
            }),
            "cannot write /dev/full: No space left on device");
  EXPECT_EQ(error_of<std::runtime_error>([&] { TextWriter{folder_ / "none" / "a"}; }),
            "cannot write " + (folder_ / "none" / "a").string() + ": No such file or directory");
}

TEST_F(TextWriterTest, WritesIntoNoFileThatALinkLeadsTo) {
  const auto others = folder_ / "others.txt", file = folder_ / "file.txt";
  write_text(others, "of somebody else");
  for (const Appears appears : {Appears::kWhole, Appears::kAtOnce}) {
    for (const char* end : {"", ".tmp"}) {
      const auto link = file.string() + end;
      std::filesystem::remove(link);
      std::filesystem::create_symlink(others, link);
      FileWriter out(file, appears);
      out.write("text");
      out.commit();
      EXPECT_EQ(text_of(file), "text");
      EXPECT_EQ(text_of(others), "of somebody else");
      EXPECT_FALSE(std::filesystem::is_symlink(file));
      std::filesystem::remove(link);
    }
  }
}

TEST_F(TextWriterTest, DoesNotWaitForThoseWhoReadAPipe) {
  const auto pipe = folder_ / "pipe", file = folder_ / "beside.txt";
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  EXPECT_EQ(error_of<std::runtime_error>([&] { write_text(pipe, "text"); }),
            "cannot write " + pipe.string() + ": No such device or address");
  ASSERT_EQ(::mkfifo((file.string() + ".tmp").c_str(), 0600), 0);
  write_text(file, "text");
  EXPECT_EQ(text_of(file), "text");
}

TEST_F(TextWriterTest, WritesUtf8WhateverTheTexts) {
  const auto file = folder_ / "names.csv";
  TextWriter out(file);
  out << "caf\xe9,"
      << "caf\xc3\xa9\n";
  out.close();
  EXPECT_EQ(text_of(file), "caf\xef\xbf\xbd,caf\xc3\xa9\n");
  write_text(file, "na\xefve");
  EXPECT_EQ(text_of(file), "na\xef\xbf\xbdve");
  write_bytes(file, "na\xefve");
  EXPECT_EQ(text_of(file), "na\xefve");
}

TEST(PrintableOutput, LetsNoControlCharacterThrough) {
  std::ostringstream terminal;
  {
    const PrintableOutput guard(terminal);
    terminal << "\x1b]0;title\x07\tcaf\xc3\xa9 \xc2\xa0|\xc2" << std::flush << "\x9b"
             << "2J\r\x7f\n";
  }
  EXPECT_EQ(terminal.str(), "?]0;title?\tcaf\xc3\xa9 \xc2\xa0|?2J??\n");
}

TEST(PrintableOutput, LosesNothingOfThreadsThatPrintAtOnce) {
  constexpr int kThreads = 4;
  constexpr int kTimes = 5000;
  std::ostringstream terminal;
  {
    const PrintableOutput guard(terminal);
    std::streambuf* const out = static_cast<std::ostream&>(terminal).rdbuf();  // not the string's
    std::vector<std::thread> threads;
    for (int k = 0; k < kThreads; ++k) {
      threads.emplace_back([out] {
        for (int i = 0; i < kTimes; ++i) out->sputn("\xc3\xa9\n", 3);
      });
    }
    for (std::thread& thread : threads) thread.join();
  }
  std::string all;
  for (int i = 0; i < kThreads * kTimes; ++i) all += "\xc3\xa9\n";
  EXPECT_TRUE(terminal.str() == all);
}

TEST(PrintableOutput, LetsNothingThroughThatIsNoUtf8) {
  const std::string none = "\xef\xbf\xbd";
  std::ostringstream terminal;
  {
    const PrintableOutput guard(terminal);
    // Characters of two, three and four bytes, in pieces; then what is none of itself, cut short,
    // a detour and half of a pair.
    terminal << "\xc3" << std::flush << "\xa9\xe2\x82" << std::flush << "\xac\xf0\x9f"
             << "\x98\x80|";
    terminal << "\x9b"
             << "31m\xff|\xe2\x82|\xe0\x80\xaf|\xed\xa0\x80|\xf4\x90|\xe2\xc2"
             << "\x85|\xf0\x9f";
  }
  EXPECT_EQ(terminal.str(), "\xc3\xa9\xe2\x82\xac\xf0\x9f\x98\x80|" + none + "31m" + none + "|" +
                                none + none + "|" + none + none + none + "|" + none + none + none +
                                "|" + none + none + "|" + none + "?|" + none + none);
}

}  // namespace
}  // namespace viwo::files
