// Results that take the place of those before.
#include <gmock/gmock.h>

#include "in_folder.hpp"
#include "message_of.hpp"
#include "viwo/files/files.hpp"

namespace viwo::files {
namespace {

using testing::error_of;
using testing::InFolder;
using testing::text_of;

namespace fs = std::filesystem;
using ::testing::ElementsAre;

class NewResultsTest : public InFolder {
 protected:
  void SetUp() override {
    for (const char* name : {"summary.json", "report.html", "old.csv", "table.csv"}) {
      write_text(folder_ / name, "before");
    }
  }

  /// Name and text of all that is there, in the order of the names.
  std::vector<std::string> there() const {
    std::vector<std::string> files;
    for (const auto& entry : fs::directory_iterator(folder_)) {
      files.push_back(entry.path().filename().string() + ": " +
                      (entry.is_regular_file() ? text_of(entry.path()) : "none"));
    }
    std::sort(files.begin(), files.end());
    return files;
  }
};

TEST_F(NewResultsTest, TakeTheirPlaceAndTheRestOfThoseBeforeGoes) {
  NewResults results(folder_);
  write_text(results.file("table.csv"), "new");
  write_text(results.file("summary.json"), "new");
  EXPECT_EQ(text_of(folder_ / "summary.json"), "before");
  results.commit({"summary.json", "report.html"});
  EXPECT_THAT(there(), ElementsAre("old.csv: before", "summary.json: new", "table.csv: new",
                                   "unfinished.tmp: none"));
}

TEST_F(NewResultsTest, LeaveThoseBeforeIfTheyAreNotComplete) {
  {
    NewResults results(folder_);
    write_text(results.file("summary.json"), "new");
  }
  EXPECT_THAT(there(), ElementsAre("old.csv: before", "report.html: before", "summary.json: before",
                                   "table.csv: before"));
}

TEST_F(NewResultsTest, LeaveThoseBeforeIfOneCannotTakeItsPlace) {
  fs::create_directory(folder_ / "trajectory.tum");
  fs::create_symlink("/dev/full", folder_ / "timing.csv");
  for (const std::string name : {"trajectory.tum", "timing.csv"}) {
    NewResults results(folder_);
    write_text(results.file(name.c_str()), "new");
    write_text(results.file("summary.json"), "new");
    EXPECT_EQ(error_of<std::runtime_error>([&] { results.commit({"summary.json"}); }),
              "cannot write " + (folder_ / name).string() + ": " +
                  (name == "timing.csv" ? "No space left on device" : "Is a directory"));
    EXPECT_EQ(text_of(folder_ / "summary.json"), "before");
  }
}

TEST_F(NewResultsTest, OfACommandThatWasKilledAreNotTakenForNew) {
  write_text(make_folder_in(folder_, "unfinished.tmp") / "table.csv", "half");
  NewResults results(folder_);
  results.commit({});
  EXPECT_EQ(text_of(folder_ / "table.csv"), "before");
}

}  // namespace
}  // namespace viwo::files
