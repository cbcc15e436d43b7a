// Each mistake of an update fails, with a message that names it.
#include "support.hpp"
#include "viwo/api/measurement.hpp"

namespace viwo::conformance {
namespace {

/// The first of the checks that fail.
std::string update_failures(const std::string& defect) {
  const std::string all = failures_of("update", defect);
  return all.substr(0, all.find('\n'));
}

TEST(BrokenUpdate, WithoutAMistakeItPasses) { EXPECT_EQ(failures_of("update", "none"), ""); }

TEST(BrokenUpdate, WhatTheConfigurationDoesNotHave) {
  EXPECT_EQ(update_failures("no_camera"), "declarations: declare(): needs two cameras");
}

TEST(BrokenUpdate, ThatNeedsMoreIsToldWhatThereIs) {
  const Conformance result = check_plugin(broken("update", "no_camera"));
  EXPECT_EQ(result.checks.back().warnings,
            std::vector<std::string>{"the robot of these checks has an IMU, one camera, four "
                                     "driven wheels, a pose reference and a satellite receiver"});
}

TEST(BrokenUpdate, AnExceptionOfItsDeclarations) {
  EXPECT_EQ(update_failures("declare_throws"),
            "declarations: declare() threw 'no wheel set' - throw InputError for what the "
            "configuration lacks");
}

TEST(BrokenUpdate, DeclarationsThatInstancesShare) {
  EXPECT_EQ(
      update_failures("shared_declarations"),
      "declarations: two instances declare differently: the block 'broken.ground': 'height' "
      "in 'm', sigma 0.11, process sigma 0, needs planar in one, 'height' in 'm', sigma 0.12, "
      "process sigma 0, needs planar in the other - what is declared may depend on "
      "parameters and configuration alone");
}

TEST(BrokenUpdate, ABlockThatItDeclaresTwiceInDifferentUnits) {
  EXPECT_EQ(update_failures("twice"),
            "declarations: declare(): updates 'broken_twice' and 'broken_twice' declare the block "
            "'broken.ground' differently: 'height' in 'm' and 'cm'");
}

TEST(BrokenUpdate, ARotationThatIsNone) {
  EXPECT_EQ(update_failures("rotation"),
            "declarations: declare(): block 'broken.ground': its retraction is none: rotation 0 of "
            "its value is not one");
}

TEST(BrokenUpdate, ARotationOfTooFewEntries) {
  EXPECT_EQ(update_failures("few_entries"),
            "declarations: declare(): block 'broken.ground': its retraction is none: 1 rotations "
            "need 3 entries, not 1");
}

TEST(BrokenUpdate, AnEntryWithoutAName) {
  EXPECT_EQ(update_failures("no_name"),
            "declarations: declare(): block 'broken.ground': an entry has no name");
}

TEST(BrokenUpdate, ANameForTwoEntries) {
  EXPECT_EQ(update_failures("name_twice"),
            "declarations: declare(): block 'broken.ground': two of its entries are called "
            "'height'");
}

TEST(BrokenUpdate, ANameThatAnEntryOfTheWheelsHas) {
  EXPECT_EQ(update_failures("name_taken"),
            "declarations: declare(): update 'broken_name_taken': the entry 'r_1' of its block "
            "'broken.ground' is also one of the block 'wheels.intrinsics' of update 'neighbour'");
}

TEST(BrokenUpdate, SamplesOfTheHostsNameInAnotherLayout) {
  EXPECT_EQ(update_failures("layout"),
            "declarations: declare(): update plugin 'broken_layout' 1.0.0 (" +
                broken("update", "layout").string() +
                ") has samples 'encoders' of version 1, 16 bytes, viwo itself of version 1, " +
                std::to_string(sizeof(EncoderSample)) +
                " bytes - build it against this viwo, or give its samples a name of their own");
}

TEST(BrokenUpdate, DeclarationsAfterTheStart) {
  EXPECT_EQ(update_failures("late"),
            "start: start() or the first epochs: update 'broken_late' failed: declares something "
            "after the start");
}

TEST(BrokenUpdate, AnUpdateThatCannotStart) {
  EXPECT_EQ(update_failures("cannot_start"),
            "start: start() or the first epochs: works with four clones or less");
}

TEST(BrokenUpdate, AResidualThatIsNotFinite) {
  EXPECT_EQ(update_failures("nan"),
            "start: residual factor 0 of epoch 1: residual has entries that are not finite");
}

TEST(BrokenUpdate, ColumnsThatOverlap) {
  EXPECT_EQ(update_failures("overlap"),
            "start: residual factor 0 of epoch 1: columns 5 to 7 overlap another block");
}

TEST(BrokenUpdate, ColumnsBeyondTheState) {
  EXPECT_EQ(update_failures("beyond"),
            "start: residual factor 0 of epoch 1: columns 123 to 125 are not in the state of 125");
}

TEST(BrokenUpdate, ColumnsOfABlockThatIsHeld) {
  EXPECT_EQ(update_failures("held"),
            "held calibration: update() threw 'a factor's block is held or negative' in epoch 1 - "
            "leave out what cannot be used, and count it in rejections()");
}

TEST(BrokenUpdate, JacobiansThatTheResidualDoesNotFollow) {
  const std::string begin = "derivatives: residual factor 0, column ";
  const std::string end =
      " - residual = measured - predicted = H dx + noise, R_GtoI = Exp(-dtheta) R_GtoI_hat";
  EXPECT_EQ(update_failures("wrong_sign"),
            begin +
                "5 (p of the IMU, 3): by H row 0 of the residual should change by 1 for 1, and "
                "does by -1" +
                end);
  EXPECT_EQ(update_failures("no_derivative"),
            begin +
                "103 (block 7, entry 1): by H row 0 of the residual should change by 0 for 1, "
                "and does by -1" +
                end);
}

TEST(BrokenUpdate, WhatIsWrittenBesideTheFactor) {
  const std::string sizes = " - set_rows(2), for 4 columns, has made room for no more";
  EXPECT_EQ(
      update_failures("more_rows"),
      "start: residual factor 0 of epoch 1: residual is written to behind its last row" + sizes);
  EXPECT_EQ(update_failures("more_columns"),
            "start: residual factor 0 of epoch 1: H is written to behind its last column" + sizes);
}

TEST(BrokenUpdate, ANoiseThatIsNotSymmetric) {
  EXPECT_EQ(update_failures("asymmetric"),
            "start: residual factor 0 of epoch 1: R is not symmetric (by up to 0.001)");
}

TEST(BrokenUpdate, ANoiseThatIsNotPositive) {
  EXPECT_EQ(update_failures("negative"),
            "start: residual factor 0 of epoch 1: R is not positive definite (eigenvalue -0.5)");
}

TEST(BrokenUpdate, StateThatInstancesShare) {
  EXPECT_EQ(update_failures("shared"),
            "start: two instances give different factors for the same epoch (epoch 1) - no "
            "static variables, no clock, no random numbers but from HostServices::seed");
}

TEST(BrokenUpdate, ARejectionWithoutAReason) {
  EXPECT_EQ(update_failures("rejections"),
            "start: rejections() gives an entry without reason or count");
}

TEST(BrokenUpdate, SamplesThatAreReadAsOthers) {
  EXPECT_EQ(update_failures("other_samples"),
            "factors: update() threw 'samples of another kind than the stream was declared with' "
            "in epoch 1 - leave out what cannot be used, and count it in rejections()");
}

TEST(BrokenUpdate, ABlockInNoRoom) {
  EXPECT_EQ(update_failures("no_room"),
            "factors: update() adds a block to a room that it has not declared in epoch 1");
}

TEST(BrokenUpdate, ABlockInTheRoomOfAnother) {
  EXPECT_EQ(update_failures("foreign_room"),
            "factors: update() adds a block to a room that it has not declared in epoch 1");
}

TEST(BrokenUpdate, ABlockWhereThereIsNoRoomLeft) {
  EXPECT_EQ(update_failures("assumes_room"),
            "full rooms: update() threw 'bad optional access' in epoch 1 - leave out what cannot "
            "be used, and count it in rejections()");
}

TEST(BrokenUpdate, ABlockThatNoFactorDetermines) {
  EXPECT_EQ(update_failures("undetermined"),
            "factors: added block of epoch 1: is not in the information factor of that call - it "
            "exists by what the factor says of it");
}

TEST(BrokenUpdate, ABlockThatIsDroppedTwice) {
  EXPECT_EQ(update_failures("drops_twice"),
            "factors: settle() drops a block that does not exist (any more) in epoch 2 - only "
            "blocks that it has added itself, as long as they exist");
}

TEST(BrokenUpdate, BlocksOfOthersThatAreDroppedOrWritten) {
  constexpr const char* kRemedy = " - only blocks that it has added itself, as long as they exist";
  EXPECT_EQ(update_failures("drops_others"),
            std::string("start: settle() drops a block that is not its own in epoch 1") + kRemedy);
  EXPECT_EQ(
      update_failures("rewrites_others"),
      std::string("factors: settle() rewrites a block that is not its own in epoch 1") + kRemedy);
}

TEST(BrokenUpdate, AnExceptionInAnEpochWithoutImu) {
  EXPECT_EQ(update_failures("throws"),
            "hostile epochs: update() threw 'no IMU' in epoch 9 - leave out what cannot be "
            "used, and count it in rejections()");
  EXPECT_EQ(update_failures("throws_int"),
            "hostile epochs: update() threw something that is not a std::exception in epoch 9 - "
            "leave out what cannot be used, and count it in rejections()");
}

TEST(BrokenUpdate, ACrashInAnEpochWithoutImu) {
  EXPECT_EQ(update_failures("crash"),
            "hostile epochs: crashed: Segmentation fault - run it under a debugger, or build "
            "plugin and host with VIWO_SANITIZE=address,undefined");
}

/// The checks that are left out, "CHECK: why" each.
std::vector<std::string> skipped(const std::string& name) {
  std::vector<std::string> texts;
  const Conformance result = check_plugin(broken("update", name));
  EXPECT_TRUE(result.passed());
  for (const CheckResult& check : result.checks) {
    if (!check.skipped.empty()) texts.push_back(check.name + ": " + check.skipped);
  }
  return texts;
}

TEST(UpdateThatWantsMore, OfSamplesIsNotCheckedWhereTheyMatter) {
  const auto texts = skipped("foreign");
  ASSERT_EQ(texts.size(), 6u);
  EXPECT_EQ(texts.front(),
            "factors: takes samples of kinds that the robot of these checks does not give: 'range' "
            "- try it in a run with the sensor that does");
  EXPECT_EQ(texts.back().substr(0, 16), "hostile epochs: ");
}

TEST(UpdateThatWantsMore, OfBlocksIsNotStarted) {
  const auto texts = skipped("wants_block");
  ASSERT_EQ(texts.size(), 8u);
  EXPECT_EQ(texts.front(),
            "start: needs 'gnss0.p_AinI', blocks of other updates, which these checks lack");
}

}  // namespace
}  // namespace viwo::conformance
