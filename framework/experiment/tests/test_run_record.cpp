// What is kept of a run, and given back.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "message_of.hpp"
#include "odd_result.hpp"
#include "viwo/results/run_record.hpp"
#include "viwo/run/thin.hpp"

namespace viwo {
namespace {

using testing::error_of;
using ::testing::HasSubstr;
using testing::odd_result;

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

}  // namespace
}  // namespace viwo
