// Experiments that are interrupted: the journal of their runs, and going on from it.
#include <csignal>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include "checksum.hpp"
#include "experiment_file.hpp"
#include "message_of.hpp"
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
using testing::registry;
using testing::text_of;

int files_in(const fs::path& folder) {
  if (!fs::exists(folder)) return 0;
  return static_cast<int>(std::distance(fs::directory_iterator(folder), fs::directory_iterator()));
}

/// A result with one of everything, and with numbers that text does not carry.
RunResult odd_result() {
  RunResult run;
  run.status = RunStatus::kDiverged;
  run.cause = "a \"cause\",\nof two lines";
  run.epochs = 7;
  run.duration_s = 0.1;
  run.wall_s = 1e-300;
  run.estimate = {{-5, {0.1, -0., 1. / 3.}, Eigen::Quaterniond(0.5, -0.5, 0.5, 0.1)}};
  run.reference = run.estimate;
  run.accuracy.emplace();
  run.accuracy->alignment = eval::Alignment::kSe3;
  run.accuracy->ate_m = std::numeric_limits<double>::infinity();
  run.accuracy->rpe = {{10., 3, 0.1, 0.2, 0.3, 0.4}};
  run.accuracy->series = {{0., 0.1}, {0., 1.}, {0.3, 0.4}, {0.1, 0.2}};
  run.nees_planar = 3.3;
  run.total.g = {0.7, 0.1, 0.2};
  run.total.samples = 11;
  run.epoch_ms = {{0.1, 0.2}};
  run.stages = {{"propagate", {0.1, 0.2, 0.3}}};
  run.total_ms = {0.4, 0.5, 0.6};
  run.rejections = {{"wheels0", {"late", 3, "odom.csv:17"}}};
  run.nees.pose = std::numeric_limits<double>::quiet_NaN();
  run.nees.series = {{0.1, 6.1}};
  run.errors = {{0.1, {0.1, 0.2, 0.3}, {0.4, 0.5, 0.6}, 0.7, 0.8}};
  run.epoch_t_s = {0., 0.1};
  run.calibration = {{"r_1", "m", {0.1, 0.2}, {0.3, 0.4}, 0.5, 0.6}};
  run.updates = {{"parity", {8, 9}, {1, 2}, {3, 4}, {2, true, "lost"}}};
  run.monitor.t_s = {0.5};
  run.monitor.parameters = {"r_1"};
  run.monitor.sigma_ratio = {{0.25}};
  run.monitor.held = {1};
  run.monitor.warnings = {{0.5, "turn", {"r_1"}}};
  return run;
}

TEST(RunRecord, ComesBackBitForBit) {
  const RunResult run = odd_result();
  const auto bytes = nlohmann::json::to_cbor(to_record(run));
  const RunResult back = from_record(nlohmann::json::from_cbor(bytes));
  EXPECT_EQ(nlohmann::json::to_cbor(to_record(back)), bytes);
  EXPECT_EQ(back.status, RunStatus::kDiverged);
  EXPECT_EQ(back.cause, run.cause);
  EXPECT_EQ(back.wall_s, 1e-300);
  EXPECT_EQ(back.estimate[0].t_ns, -5);
  EXPECT_EQ(back.estimate[0].p_BinW, run.estimate[0].p_BinW);
  EXPECT_TRUE(std::signbit(back.estimate[0].p_BinW.y()));
  EXPECT_EQ(back.estimate[0].q_BtoW.coeffs(), run.estimate[0].q_BtoW.coeffs());
  ASSERT_TRUE(back.accuracy);
  EXPECT_EQ(back.accuracy->alignment, eval::Alignment::kSe3);
  EXPECT_TRUE(std::isinf(back.accuracy->ate_m));
  EXPECT_EQ(back.accuracy->rpe[0].mean_deg, 0.3);
  EXPECT_TRUE(std::isnan(back.nees.pose));
  EXPECT_EQ(back.errors[0].position_sigma_m, run.errors[0].position_sigma_m);
  EXPECT_EQ(back.calibration[0].sigma, run.calibration[0].sigma);
  EXPECT_EQ(back.calibration[0].final_error, 0.6);
  EXPECT_EQ(back.updates[0].total.rejected, 9);
  EXPECT_EQ(back.rejections[0].second.first, "odom.csv:17");
  EXPECT_EQ(back.monitor.warnings[0].parameters, std::vector<std::string>{"r_1"});
  EXPECT_FALSE(from_record(to_record(RunResult())).accuracy);
}

TEST(RunRecord, IsRefusedWhereNoRunCanHaveMadeIt) {
  const nlohmann::json whole = to_record(odd_result());
  EXPECT_NO_THROW(from_record(whole));
  const std::vector<std::pair<const char*, nlohmann::json>> changes{
      {"/status", 99},
      {"/epochs", -5},
      {"/epochs", 7.5},
      {"/epochs", 1e300},
      {"/duration_s", true},
      {"/a_member_of_nobody", 1},
      {"/estimate/0/1/0", std::numeric_limits<double>::quiet_NaN()},
      {"/estimate/1", whole.at("estimate").at(0)},
      {"/accuracy/alignment", 99},
      {"/accuracy/n_poses", -1},
      {"/accuracy/series/t_s/2", 0.3},
      {"/epoch_t_s/2", 0.3},
      {"/epoch_t_s/1", -1.},
      {"/calibration/0/estimate/2", 0.3},
      {"/updates/0/applied/2", 1},
      {"/updates/0/total/rejected", -1},
      {"/monitor/held/1", 1},
      {"/monitor/parameters/1", "r_2"},
  };
  for (const auto& [at, value] : changes) {
    nlohmann::json changed = whole;
    changed[nlohmann::json::json_pointer(at)] = value;
    EXPECT_ANY_THROW(from_record(changed)) << at << ": " << value;
  }
}

TEST(RunRecord, IsThinnedToItsEndsAndEveryNthPointWithCountsSummed) {
  RunResult run;
  run.updates = {{"parity", {}, {}, {}}};
  run.calibration.emplace_back();
  run.calibration.back().name = "r_1";
  for (int i = 0; i < 1001; ++i) {
    run.epoch_t_s.push_back(i);
    run.calibration[0].estimate.push_back(i);
    run.updates[0].applied.push_back(1);
  }
  thin(run);
  ASSERT_LE(run.epoch_t_s.size(), kRecordPoints + 1);
  ASSERT_GE(run.epoch_t_s.size(), kRecordPoints * 9 / 10);
  EXPECT_EQ(run.epoch_t_s.front(), 0.);
  EXPECT_EQ(run.epoch_t_s[1], 7.);  // 1001 / 150, rounded up
  EXPECT_EQ(run.epoch_t_s.back(), 1000.);
  EXPECT_EQ(run.calibration[0].estimate, run.epoch_t_s);
  ASSERT_EQ(run.updates[0].applied.size(), run.epoch_t_s.size());
  EXPECT_EQ(run.updates[0].applied[0], 1);
  EXPECT_EQ(run.updates[0].applied[1], 7);
  int sum = 0;
  for (const int count : run.updates[0].applied) sum += count;
  EXPECT_EQ(sum, 1001);
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
