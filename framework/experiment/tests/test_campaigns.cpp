// Experiments in parts: shards that run anywhere, in any order, and what collects them.
#include <cstdlib>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "experiment_file.hpp"
#include "message_of.hpp"
#include "run_identity.hpp"
#include "told.hpp"

namespace viwo {
namespace {

namespace fs = std::filesystem;
using namespace experiment;
using ::testing::AllOf;
using testing::error_of;
using ::testing::HasSubstr;
using testing::registry;
using testing::text_of;

std::string refusal(const std::string& text) {
  return error_of([&] { read_shard(text); });
}

TEST(Shard, IsTwoNumbersOrTheVariablesThatHaveThem) {
  EXPECT_EQ(read_shard("2/7").index, 2);
  EXPECT_EQ(read_shard("2/7").count, 7);
  EXPECT_EQ(read_shard("7/7").index, 0);  // of an array that counts from 1
  ::setenv("VIWO_TEST_INDEX", "3", 1);
  ::setenv("VIWO_TEST_COUNT", "5", 1);
  const Shard shard = read_shard("VIWO_TEST_INDEX/VIWO_TEST_COUNT");
  EXPECT_EQ(shard.index, 3);
  EXPECT_EQ(shard.count, 5);
  EXPECT_EQ(read_shard("VIWO_TEST_INDEX/8").count, 8);
  EXPECT_TRUE(shard.has(8));
  EXPECT_FALSE(shard.has(9));
}

TEST(Shard, RefusesWhatIsNoPartOfAWhole) {
  ::unsetenv("VIWO_TEST_NONE");
  ::setenv("VIWO_TEST_TEXT", "three", 1);
  EXPECT_THAT(refusal("3"), HasSubstr("there is no '/'"));
  EXPECT_THAT(refusal("8/7"), HasSubstr("8 is none of 7 shards"));
  EXPECT_THAT(refusal("-1/7"), HasSubstr("-1 is none of 7 shards"));
  EXPECT_THAT(refusal("0/0"), HasSubstr("at least one shard"));
  EXPECT_THAT(refusal("1x/7"), HasSubstr("'1x' is no number"));
  EXPECT_THAT(refusal("/7"), HasSubstr("'' is no number"));
  EXPECT_THAT(refusal("1/99999999999"), HasSubstr("is no number"));
  EXPECT_THAT(refusal("VIWO_TEST_NONE/7"), HasSubstr("no environment variable VIWO_TEST_NONE"));
  EXPECT_THAT(refusal("VIWO_TEST_TEXT/7"), HasSubstr("'VIWO_TEST_TEXT=three' is no number"));
}

class Campaign : public testing::ExperimentFile {
 protected:
  Campaign() {
    options_.seeds = 2;
    options_.assignments = {"sensors.simulator0.duration_s=4"};
  }

  ExperimentResult run(const ExperimentOptions& options, const fs::path& out) {
    const fs::path file = VIWO_TEST_SOURCE_DIR "/configs/experiments/paper_accuracy.yaml";
    return run_experiment(read_experiment(file, options), options, registry(), out);
  }

  void run_shard(int index, int count, const fs::path& out) {
    ExperimentOptions options = options_;
    options.shard = Shard{index, count};
    run(options, out);
  }

  /// What runs.csv says, but for times.
  static std::string table_of(const ExperimentResult& result, const fs::path& out) {
    write_without_times(result, out);
    return text_of(out / "runs.csv");
  }

  std::string collected(const fs::path& out) {
    ExperimentOptions options = options_;
    options.collect = true;
    return table_of(run(options, out), out);
  }

  std::string missing(const fs::path& out) {
    return error_of([&] { collected(out); });
  }

  ExperimentOptions options_;
};

TEST_F(Campaign, GivesTheTableOfOneRunWhateverTheNumberOfShards) {
  const std::string whole = table_of(run(options_, folder_ / "whole"), folder_ / "whole");
  ASSERT_NE(whole, "");
  for (const int count : {1, 3, 7}) {
    const fs::path out = folder_ / std::to_string(count);
    for (int index = count - 1; index >= 0; --index) run_shard(index, count, out);
    EXPECT_FALSE(fs::exists(out / "runs.csv"));
    EXPECT_EQ(collected(out), whole) << count;
    EXPECT_FALSE(fs::exists(out / "journal"));
  }
}

TEST_F(Campaign, NamesWhatIsMissingAndRunsNothing) {
  const fs::path out = folder_ / "out";
  run_shard(0, 3, out);
  run_shard(2, 3, out);
  EXPECT_THAT(missing(out),
              AllOf(HasSubstr("4 of 12 runs are not in " + (out / "journal").string()),
                    HasSubstr("\n  1  true_init_calib_on  seed 2"),
                    HasSubstr("\n  10  bad_init_drive_only  seed 1"),
                    HasSubstr("cell k is in shard k mod N")));
  EXPECT_FALSE(fs::exists(out / "runs.csv"));
  // What another number of shards has left is as good.
  run_shard(1, 1 + 1, out);
  run_shard(0, 2, out);
  EXPECT_EQ(missing(out), "");
}

TEST_F(Campaign, GoesOnWhereAShardWasKilled) {
  const fs::path out = folder_ / "out";
  ExperimentOptions killed = options_;
  killed.jobs = 1;
  killed.shard = Shard{0, 2};
  killed.interrupted = [&] {
    return fs::exists(out / "journal") &&
           std::distance(fs::directory_iterator(out / "journal"), fs::directory_iterator()) >=
               3;  // with of_shards
  };
  EXPECT_THROW(run(killed, out), Interrupted);
  run_shard(1, 2, out);
  ExperimentOptions again = options_;
  again.shard = Shard{0, 2};
  const ExperimentResult result = run(again, out);
  int taken_over = 0;
  for (const ExperimentRun& cell : result.runs) taken_over += cell.taken_over ? 1 : 0;
  EXPECT_EQ(taken_over, 2);
  EXPECT_EQ(collected(out), table_of(run(options_, folder_ / "whole"), folder_ / "whole"));
}

TEST_F(Campaign, ShardsLookOnlyAtWhatTheyRun) {
  const fs::path file = write(
      "experiment: test\nbase: run.yaml\nmotions: [circle, nowhere]\nvariants:\n  redundant:\n");
  const auto shard = [&](int index) {
    ExperimentOptions options;
    options.shard = Shard{index, 2};
    return error_of([&] {
      run_experiment(read_experiment(file, options), options, registry(), folder_ / "out");
    });
  };
  EXPECT_EQ(shard(0), "");
  EXPECT_THAT(shard(1), HasSubstr("nowhere"));
}

TEST_F(Campaign, AWordThatIsMissingDoesNotDiscardTheRunsOfShards) {
  const fs::path out = folder_ / "out";
  run_shard(0, 3, out);
  EXPECT_THAT(error_of([&] { run(options_, out); }),
              AllOf(HasSubstr("there are 4 runs of shards in " + (out / "journal").string()),
                    HasSubstr("--collect"), HasSubstr("--resume")));
  ExperimentOptions rest = options_;
  rest.resume = true;
  const std::string table = table_of(run(rest, out), out);
  EXPECT_EQ(table, table_of(run(options_, folder_ / "whole"), folder_ / "whole"));
  EXPECT_EQ(table_of(run(options_, out), out), table);  // the shards' are used up
}

TEST_F(Campaign, RunsThatAnotherExperimentLeftAreReplacedAndThatIsSaid) {
  const fs::path out = folder_ / "out";
  run_shard(0, 3, out);
  options_.assignments = {"sensors.simulator0.duration_s=5"};
  testing::Told told;
  options_.progress = &told;
  run_shard(0, 3, out);
  EXPECT_THAT(told.text(), HasSubstr("4 runs in " + (out / "journal").string() +
                                     " are damaged, or of another configuration"));
}

TEST(RunIdentity, IsOfTheProgram) {
  const std::string size = std::to_string(fs::file_size(fs::canonical("/proc/self/exe")));
  RunSetup run;
  run.resolved = config::Node::empty_map();
  EXPECT_THAT(RunIdentity("").of(run), HasSubstr(": " + size + " bytes, crc "));
}

TEST(RunIdentity, IsOfContentsWhereverTheyLie) {
  const fs::path folder = fs::path(::testing::TempDir()) / "viwo_run_identity";
  fs::remove_all(folder);
  const auto identity = [&](const char* place) {
    RunSetup run;
    run.resolved = config::Node::empty_map();
    for (const char* name : {"log.csv", "images", "log2.csv"}) {
      run.resolved.set(name, config::Node::scalar_of((folder / place / name).string()));
    }
    return RunIdentity(folder / place / "images" / "out").of(run);
  };
  for (const char* place : {"here", "there"}) {
    fs::create_directories(folder / place / "images" / "cam0");
    std::ofstream(folder / place / "log.csv") << "1,2\n";
    std::ofstream(folder / place / "log2.csv.gz") << "gzip";
    std::ofstream(folder / place / "images" / "cam0" / "1.png") << "pixels";
  }
  const std::string first = identity("here");
  EXPECT_EQ(first, identity("there"));
  EXPECT_THAT(first, Not(HasSubstr(folder.string())));
  // Results may lie among the inputs.
  fs::create_directories(folder / "there" / "images" / "out" / "journal");
  std::ofstream(folder / "there" / "images" / "out" / "journal" / "1.cbor") << "run";
  EXPECT_EQ(first, identity("there"));
  // Another digit, another file in a folder, another name of one.
  std::ofstream(folder / "there" / "log.csv") << "1,3\n";
  EXPECT_NE(first, identity("there"));
  std::ofstream(folder / "there" / "log.csv") << "1,2\n";
  EXPECT_EQ(first, identity("there"));
  std::ofstream(folder / "there" / "log2.csv.gz") << "gzap";
  EXPECT_NE(first, identity("there"));
  std::ofstream(folder / "there" / "log2.csv.gz") << "gzip";
  fs::rename(folder / "there" / "images" / "cam0" / "1.png",
             folder / "there" / "images" / "cam0" / "2.png");
  EXPECT_NE(first, identity("there"));
  // Parts of a log may be links: what they lead to counts.
  for (const char* place : {"one", "other"}) {
    fs::create_directories(folder / place);
    std::ofstream(folder / place / "1.png") << place;
  }
  fs::create_directory_symlink(folder / "one", folder / "there" / "images" / "cam1");
  const std::string with_one = identity("there");
  fs::remove(folder / "there" / "images" / "cam1");
  fs::create_directory_symlink(folder / "other", folder / "there" / "images" / "cam1");
  EXPECT_NE(with_one, identity("there"));
  fs::create_directory_symlink(folder / "there" / "images", folder / "there" / "images" / "round");
  EXPECT_THAT(testing::error_of<std::runtime_error>([&] { identity("there"); }),
              HasSubstr("lies too deep: a link to where it is?"));
}

}  // namespace
}  // namespace viwo
