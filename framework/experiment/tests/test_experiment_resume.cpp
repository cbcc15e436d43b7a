// Experiments that are interrupted: the journal of their runs, and going on from it.
#include <csignal>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include "checksum.hpp"
#include "experiment_file.hpp"
#include "message_of.hpp"
#include "odd_result.hpp"
#include "peak_memory.hpp"
#include "run_journal.hpp"
#include "viwo/results/run_record.hpp"
#include "viwo/run/thin.hpp"

namespace viwo {
namespace {

namespace fs = std::filesystem;
using namespace experiment;
using testing::error_of;
using ::testing::HasSubstr;
using testing::kVariants;
using testing::odd_result;
using testing::registry;
using testing::text_of;

int files_in(const fs::path& folder) {
  if (!fs::exists(folder)) return 0;
  return static_cast<int>(std::distance(fs::directory_iterator(folder), fs::directory_iterator()));
}

class Journal : public testing::ExperimentFile {
 protected:
  const RunKey kKey{"full", "circle", 3, "viwo 1\nx: 1\n"};
};

TEST_F(Journal, GivesARunBackOnlyUnderItsOwnKey) {
  const RunJournal journal(folder_);
  journal.write(kKey, odd_result());
  ASSERT_TRUE(journal.read(kKey));
  EXPECT_EQ(journal.read(kKey)->cause, odd_result().cause);
  EXPECT_EQ(files_in(folder_ / "journal"), 1);
  EXPECT_FALSE(journal.read({"full", "circle", 4, kKey.configuration}));
  EXPECT_FALSE(journal.read({"full", "circle", 3, "viwo 2\nx: 1\n"}));
  // A file under a foreign name.
  fs::copy(folder_ / "journal/full,circle,3.cbor", folder_ / "journal/full,circle,4.cbor");
  EXPECT_FALSE(journal.read({"full", "circle", 4, kKey.configuration}));
  EXPECT_EQ(journal.size(), 2);
  std::ofstream(folder_ / "journal" / "notes.txt") << "of somebody else";
  journal.remove();
  EXPECT_EQ(files_in(folder_ / "journal"), 1);
}

// The same shard may run twice: what one has not finished is not the other's.
TEST_F(Journal, HasUnfinishedFilesOfEachProcessAndRemovesThem) {
  const fs::path folder = folder_ / "journal";
  fs::create_directories(folder);
  std::ofstream(folder / "a,b,1.cbor.4711@elsewhere.tmp") << "of another process";
  const RunJournal journal(folder_);
  journal.write({"a", "b", 1, "configuration"}, odd_result());
  EXPECT_EQ(files_in(folder), 2);
  journal.remove();
  EXPECT_FALSE(fs::exists(folder));
}

TEST_F(Journal, TakesNothingFromAFileThatIsCutOrChangedAnywhere) {
  const RunJournal journal(folder_);
  RunResult run;
  run.cause = "short";
  journal.write(kKey, run);
  const fs::path file = folder_ / "journal" / "full,circle,3.cbor";
  const std::string whole = text_of(file);
  const auto is_taken = [&](const std::string& bytes) {
    std::ofstream(file, std::ios::binary) << bytes;
    return journal.read(kKey).has_value();
  };
  ASSERT_TRUE(is_taken(whole));
  for (std::size_t n = 0; n < whole.size(); n += 5) {
    EXPECT_FALSE(is_taken(whole.substr(0, n))) << n;
    std::string changed = whole;
    changed[n] = static_cast<char>(changed[n] ^ 0x10);
    EXPECT_FALSE(is_taken(changed)) << n;
  }
  EXPECT_FALSE(is_taken(whole + "x"));
}

TEST_F(Journal, TakesNothingFromWhatIsNoFileOrTooDeep) {
  const RunJournal journal(folder_);
  fs::create_directory(folder_ / "journal");
  const fs::path file = folder_ / "journal" / "full,circle,3.cbor";
  ASSERT_EQ(::mkfifo(file.c_str(), 0600), 0);
  EXPECT_FALSE(journal.read(kKey));
  EXPECT_EQ(journal.size(), 1);
  fs::remove(file);
  fs::create_symlink("/dev/zero", file);
  EXPECT_FALSE(journal.read(kKey));
  fs::remove(file);
  fs::create_directory(file);
  EXPECT_FALSE(journal.read(kKey));
  EXPECT_EQ(journal.size(), 0);
  fs::remove(file);
  const auto is_read = [&](std::string bytes) {
    const std::uint32_t crc = crc_of(bytes);
    for (int i = 0; i < 4; ++i) bytes += static_cast<char>((crc >> (8 * i)) & 0xff);
    std::ofstream(file, std::ios::binary) << bytes;
    return journal.read(kKey).has_value();
  };
  // 200000 arrays, each in the one before.
  EXPECT_FALSE(is_read(std::string(200'000, '\x81') + '\0'));
  // An array of 60 million nulls, a byte each.
  const long before_mb = testing::peak_mb();
  EXPECT_FALSE(is_read("\x9f" + std::string(60'000'000, '\xf6') + "\xff"));
  EXPECT_LT(testing::peak_mb() - before_mb, 500);
}

TEST_F(Journal, LeavesWhatIsNotItsOwnAlone) {
  const RunJournal journal(folder_ / "out");
  fs::create_directories(folder_ / "out");
  fs::create_directory(folder_ / "others");
  std::ofstream(folder_ / "others" / "a,b,1.cbor") << "of somebody else";
  fs::create_directory_symlink("../others", folder_ / "out" / "journal");
  EXPECT_THAT(error_of<InputError>([&] { journal.remove(); }), HasSubstr("is a link"));
  EXPECT_THAT(error_of<InputError>([&] { journal.write(kKey, {}); }), HasSubstr("is a link"));
  EXPECT_EQ(files_in(folder_ / "others"), 1);
  fs::remove(folder_ / "out" / "journal");
  fs::create_directory(folder_ / "out" / "journal");
  std::ofstream(folder_ / "out" / "journal" / "notes.cbor") << "of somebody else";
  journal.write(kKey, {});
  journal.remove();
  EXPECT_EQ(files_in(folder_ / "out" / "journal"), 1);
}

class Resume : public testing::ExperimentFile {
 protected:
  ExperimentResult run(const ExperimentOptions& options, const fs::path& out) {
    return run_experiment(read_experiment(file_, options), options, registry(), out);
  }

  /// Runs on one core until `runs` are in the journal; what is said then.
  std::string interrupt_after(int runs, ExperimentOptions options, const fs::path& out) {
    options.jobs = 1;
    options.interrupted = [=] { return files_in(out / "journal") >= runs; };
    return error_of<Interrupted>([&] { run(options, out); });
  }

  void expect_same_results(const fs::path& a, const fs::path& b) {
    for (const char* name : {"runs.csv", "summary.json", "report.html"}) {
      EXPECT_FALSE(text_of(a / name).empty()) << name;
      EXPECT_TRUE(text_of(a / name) == text_of(b / name)) << name << " differs";
    }
  }

  fs::path file_;
};

TEST_F(Resume, GivesTheFilesOfAnExperimentThatWasNotInterrupted) {
  file_ = write(kVariants);
  const fs::path whole = folder_ / "whole", parts = folder_ / "parts";
  ExperimentOptions options;
  write_without_times(run(options, whole), whole);
  EXPECT_EQ(interrupt_after(3, options, parts),
            "interrupted after 3 of 8 runs; continue with --resume");
  EXPECT_EQ(files_in(parts / "journal"), 3);
  EXPECT_FALSE(fs::exists(parts / "runs.csv"));
  options.resume = true;
  EXPECT_EQ(interrupt_after(5, options, parts),
            "interrupted after 5 of 8 runs; continue with --resume");
  testing::Told told;
  options.progress = &told;
  const ExperimentResult result = run(options, parts);
  EXPECT_THAT(told.text(), HasSubstr("5 of 8 runs taken over from an interrupted experiment"));
  for (std::size_t i = 0; i < 8; ++i) EXPECT_EQ(result.runs[i].taken_over, i < 5);
  EXPECT_EQ(files_in(parts / "journal"), 8);
  write_without_times(result, parts);
  EXPECT_FALSE(fs::exists(parts / "journal"));
  expect_same_results(whole, parts);
}

TEST_F(Resume, LeavesTheResultsOfAnExperimentBeforeUntilItIsDone) {
  file_ = write(kVariants);
  const fs::path out = folder_ / "out";
  ExperimentOptions options;
  write_without_times(run(options, out), out);
  const std::string before = text_of(out / "summary.json");
  interrupt_after(3, options, out);
  EXPECT_EQ(text_of(out / "summary.json"), before);
}

TEST_F(Resume, GivesTheFilesOfAnExperimentWithTheFilterToo) {
  file_ = VIWO_TEST_SOURCE_DIR "/configs/experiments/paper_accuracy.yaml";
  const fs::path whole = folder_ / "whole", parts = folder_ / "parts";
  ExperimentOptions options;
  options.seeds = 2;
  options.assignments = {"sensors.simulator0.duration_s=4"};
  write_without_times(run(options, whole), whole);
  interrupt_after(7, options, parts);
  ASSERT_EQ(files_in(parts / "journal"), 7);
  options.resume = true;
  const ExperimentResult result = run(options, parts);
  EXPECT_EQ(std::count_if(result.runs.begin(), result.runs.end(),
                          [](const ExperimentRun& cell) { return cell.taken_over; }),
            7);
  write_without_times(result, parts);
  expect_same_results(whole, parts);
}

TEST_F(Resume, EndsARunOfTheFilterInItsMiddle) {
  file_ = VIWO_TEST_SOURCE_DIR "/configs/experiments/paper_accuracy.yaml";
  ExperimentOptions options;
  options.jobs = 1;
  options.seeds = 1;
  options.assignments = {"sensors.simulator0.duration_s=4"};
  // Once for each variant before the first run, once when it starts, then at each epoch.
  int asked = 0;
  options.interrupted = [&] { return ++asked > 6 + 1 + 10; };
  EXPECT_EQ(error_of<Interrupted>([&] { run(options, {}); }), "interrupted after 0 of 6 runs");
  EXPECT_EQ(asked, 18 + 5);  // and the other runs do not start
}

TEST_F(Resume, DiscardsWhatIsThereUnlessAskedToGoOn) {
  file_ = write(kVariants);
  const fs::path out = folder_ / "out";
  interrupt_after(3, {}, out);
  testing::Told told;
  ExperimentOptions anew;
  anew.progress = &told;
  const ExperimentResult result = run(anew, out);
  EXPECT_THAT(told.text(),
              HasSubstr("3 runs of an interrupted experiment are discarded (not --resume): " +
                        (out / "journal").string()));
  for (const ExperimentRun& cell : result.runs) EXPECT_FALSE(cell.taken_over);
}

TEST_F(Resume, RunsAgainWhatDoesNotFitOrIsDamaged) {
  file_ = write(kVariants);
  const fs::path out = folder_ / "out";
  interrupt_after(4, {}, out);
  std::ofstream(out / "journal" / "redundant,circle,2.cbor") << "not a run";
  std::ofstream(out / "journal" / "a,b,1.cbor") << "of something else";
  ExperimentOptions options;
  options.resume = true;
  testing::Told told;
  options.progress = &told;
  ExperimentResult result = run(options, out);
  EXPECT_THAT(told.text(),
              HasSubstr("2 of 5 files in " + (out / "journal").string() + " are not used"));
  EXPECT_TRUE(result.runs[0].taken_over);
  EXPECT_FALSE(result.runs[1].taken_over);
  EXPECT_TRUE(result.runs[2].taken_over);
  EXPECT_EQ(result.runs[1].result.status, RunStatus::kOk);
  // And nothing fits another configuration.
  options.assignments = {"evaluation.segment_lengths_m=[5]"};
  result = run(options, out);
  for (const ExperimentRun& cell : result.runs) EXPECT_FALSE(cell.taken_over);
}

TEST_F(Resume, RunsAgainWhatHasNoFolderWhenThatIsToBeKept) {
  file_ = write(kVariants);
  const fs::path out = folder_ / "out";
  ExperimentOptions options;
  options.keep_runs = true;
  interrupt_after(2, options, out);
  fs::remove_all(out / "runs" / "redundant_circle_1");
  options.resume = true;
  const ExperimentResult result = run(options, out);
  EXPECT_FALSE(result.runs[0].taken_over);
  EXPECT_TRUE(result.runs[1].taken_over);
  EXPECT_EQ(files_in(out / "runs"), 8);
  // What is kept is not thinned: 20 s at 10 Hz.
  const std::string kept = text_of(out / "runs" / "redundant_circle_1" / "trajectory.tum");
  EXPECT_GT(std::count(kept.begin(), kept.end(), '\n'), 190);
  EXPECT_LE(result.runs[0].result.estimate.size(), kRecordPoints + 1);
}

TEST_F(Resume, StopsWithAClearMessageWhenTheDiskIsFull) {
  file_ = write(kVariants);
  const fs::path out = folder_ / "out";
  fs::create_directories(out / "journal");
  fs::create_symlink("/dev/full", out / "journal" / "redundant,lateral,1.cbor");
  ExperimentOptions options;
  options.resume = true;
  options.jobs = 1;
  try {
    run(options, out);
    FAIL() << "nothing was thrown";
  } catch (const Interrupted&) {
    FAIL() << "this is no interruption";
  } catch (const std::runtime_error& error) {
    EXPECT_EQ(std::string(error.what()),
              "cannot write " + (out / "journal" / "redundant,lateral,1.cbor").string() +
                  ": No space left on device");
  }
  EXPECT_TRUE(fs::exists(out / "journal" / "redundant,circle,1.cbor"));
}

}  // namespace
}  // namespace viwo
